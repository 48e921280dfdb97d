//! The charts blended into a signed distance on a thin band of voxels.
//!
//! In: charts with signs, the points that vouch for them, the side of a voxel. Out: a [`Grid`]. The band is
//! cut into blocks that are made independently of each other, in ascending order of their keys; pairs of a
//! block and a point are sorted by block, share by share, so that the memory stays bounded.

use super::blocks::{Corners, Grid, block_of_key, find, level_of_key, side, within_range};
use super::constants::{BLEND, BLOCK};
use super::corners::BlockBlend;
use super::gauge;
use super::levels::{Levels, Voxels};
use crate::atlas::{BlendSite, Chart, Pair, Relation};
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::{Context, Stage};
use rayon::prelude::*;

/// What the blocks are made from.
struct Source<'a> {
    charts: &'a [Chart],
    sites: &'a [BlendSite],
    relations: &'a [Relation],
    /// Whether each chart contradicts another.
    contradicted: &'a [bool],
    /// Side of the finest voxels.
    h: f64,
    levels: Levels,
}

/// A block that a point influences: the block's key and the point's index.
type BlockSite = (u64, u32);

/// A block on its way into the grid.
struct Block {
    key: u64,
    list: Vec<u32>,
    turned: Vec<bool>,
    own_gauge: bool,
    corners: Corners,
}

/// Evaluates the charts at the corners of a band of voxels. Sites out of range ([`within_range`]) are left
/// out. `relations` ascend by their first chart; `conflicts` are pairs of charts whose signs contradict each
/// other.
///
/// # Errors
/// Cancelled, out of time or memory.
pub(crate) fn sample<'c>(
    charts: &'c [Chart],
    mut sites: Vec<BlendSite>,
    relations: &[Relation],
    conflicts: &[Pair],
    voxels: Voxels,
    ctx: &Context<'_>,
) -> Result<Grid<'c>> {
    let h = voxels.finest;
    sites.retain(|a| within_range(a.position, h));
    let mut contradicted = vec![false; charts.len()];
    for &(a, b) in conflicts {
        contradicted[a as usize] = true;
        contradicted[b as usize] = true;
    }
    let levels = Levels::of(&sites, voxels, ctx)?;
    let source = Source { charts, sites: &sites, relations, contradicted: &contradicted, h, levels };
    let shares = shares(&source, ctx)?;
    let mut grid = Grid {
        charts,
        h,
        pairs: shares.pairs,
        keys: vec![],
        contoured: vec![],
        start: vec![0],
        lists: vec![],
        turned: vec![],
        own_gauge: vec![],
        around: vec![],
        corners: vec![],
    };
    let fixed = BLEND.bytes_per_chart * charts.len() as u64 + BLEND.bytes_per_point * sites.len() as u64;
    let (mut from, mut done) = (0, 0);
    for to in shares.ends {
        let pairs = pairs_between(&source, from, to, ctx)?;
        let groups: Vec<&[BlockSite]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
        // Stopping early beats running out of memory late.
        done += pairs.len();
        let blocks = (grid.blocks() + groups.len()) as f64 * grid.pairs as f64 / done.max(1) as f64;
        ctx.reserve(
            fixed + BLEND.bytes_per_block * blocks as u64,
            "Raise the limit, lower the detail, or give fewer points",
        )?;
        append(&mut grid, blocks_of(&source, &groups, ctx)?, &source.levels, ctx)?;
        from = to;
    }
    grid.around = around(&grid.keys, ctx)?;
    Ok(grid)
}

/// The pairs of a block and a point cut into shares of about equal size.
struct Shares {
    /// Number of pairs.
    pairs: usize,
    /// For each share the key before which its blocks end.
    ends: Vec<u64>,
}

/// Counts the pairs and cuts the keys, by a sample of them, into shares of about `BLEND.pairs`. Enters the
/// stage.
fn shares(source: &Source<'_>, ctx: &Context<'_>) -> Result<Shares> {
    let counts: Vec<(usize, Vec<u64>)> = source
        .sites
        .par_chunks(BLEND.chunk)
        .map(|chunk| {
            ctx.check()?;
            let (mut count, mut some) = (0, Vec::new());
            for site in chunk {
                source.levels.visit(site, |key| {
                    if count % BLEND.pair_sample == 0 {
                        some.push(key);
                    }
                    count += 1;
                });
            }
            Ok((count, some))
        })
        .collect::<Result<_>>()?;
    let pairs: usize = counts.iter().map(|c| c.0).sum();
    // The pairs are gone through twice: here, and when the blocks are contoured.
    ctx.stage(Stage::Surface, 2 * pairs);
    let mut sample: Vec<u64> = counts.into_iter().flat_map(|c| c.1).collect();
    sort(&mut sample, ctx)?;
    let count = pairs.div_ceil(BLEND.pairs);
    let mut ends: Vec<u64> = (1..count).map(|k| sample[k * sample.len() / count]).collect();
    ends.dedup();
    ends.push(u64::MAX);
    Ok(Shares { pairs, ends })
}

/// The pairs whose block's key is in `from..to`, sorted.
fn pairs_between(source: &Source<'_>, from: u64, to: u64, ctx: &Context<'_>) -> Result<Vec<BlockSite>> {
    let level = level_of_key(from);
    let size = side(source.h, level) * f64::from(BLOCK);
    let one_level = level == level_of_key(to - 1).min(source.levels.top);
    let (low, high) = (block_of_key(from)[2], block_of_key(to - 1)[2]);
    let found: Vec<Vec<BlockSite>> = source
        .sites
        .par_chunks(BLEND.chunk)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            let mut out = Vec::new();
            for (i, site) in chunk.iter().enumerate() {
                let [z0, z1] =
                    [-1.0, 1.0].map(|s| (site.position[2] + s * BLEND.reach * site.spacing) / size);
                if one_level && ((z1.floor() as i32) < low || (z0.floor() as i32) > high) {
                    continue;
                }
                source.levels.visit(site, |key| {
                    if (from..to).contains(&key) {
                        out.push((key, (c * BLEND.chunk + i) as u32));
                    }
                });
            }
            Ok(out)
        })
        .collect::<Result<_>>()?;
    let mut pairs: Vec<BlockSite> = Vec::with_capacity(found.iter().map(Vec::len).sum());
    for some in found {
        ctx.check()?;
        pairs.extend(some);
    }
    sort(&mut pairs, ctx)?;
    Ok(pairs)
}

/// Makes the blocks of groups of pairs, one block from each group, in order.
fn blocks_of(source: &Source<'_>, groups: &[&[BlockSite]], ctx: &Context<'_>) -> Result<Vec<Vec<Block>>> {
    groups
        .par_chunks(BLEND.chunk)
        .map(|groups| {
            let mut out = Vec::new();
            for near in groups {
                ctx.check()?;
                ctx.advance(near.len());
                out.extend(make(source, near));
            }
            Ok(out)
        })
        .collect()
}

/// Evaluates the charts at the corners of one block, from the points that influence it; `None` where nothing
/// is known.
fn make(source: &Source<'_>, near: &[BlockSite]) -> Option<Block> {
    let &Source { charts, sites, relations, contradicted, h, .. } = source;
    let key = near[0].0;
    let h = side(h, level_of_key(key));
    let mut list: Vec<u32> = near
        .iter()
        .flat_map(|&(_, a)| sites[a as usize].charts.iter().map(|c| c.0).filter(|&c| c != u32::MAX))
        .collect();
    list.sort_unstable();
    list.dedup();
    if list.is_empty() {
        return None;
    }
    let own_gauge = list.iter().any(|&c| contradicted[c as usize]);
    let signs = gauge::signs(charts, relations, own_gauge, &list);
    let blend = BlockBlend { charts, list: &list, signs: &signs, h, band: source.levels.band(key) };
    let corners = blend.corners(block_of_key(key), near.iter().map(|&(_, a)| &sites[a as usize]))?;
    let turned = list.iter().zip(&signs).map(|(&c, s)| s * charts[c as usize].sign < 0.0).collect();
    Some(Block { key, list, turned, own_gauge, corners })
}

/// Appends blocks to the grid.
fn append(grid: &mut Grid<'_>, blocks: Vec<Vec<Block>>, levels: &Levels, ctx: &Context<'_>) -> Result<()> {
    for (i, b) in blocks.into_iter().flatten().enumerate() {
        ctx.check_at(i)?;
        grid.keys.push(b.key);
        grid.contoured.push(levels.contours(b.key));
        grid.lists.extend(b.list);
        grid.turned.extend(b.turned);
        grid.start.push(grid.lists.len() as u32);
        grid.own_gauge.push(b.own_gauge);
        grid.corners.push(b.corners);
    }
    Ok(())
}

/// The indices of the 27 blocks around each block, itself in the middle; `u32::MAX` where there is none.
fn around(keys: &[u64], ctx: &Context<'_>) -> Result<Vec<[u32; 27]>> {
    let around = |&key: &u64| {
        let (level, at) = (level_of_key(key), block_of_key(key));
        std::array::from_fn(|n| {
            let n = n as i32;
            find(keys, level, [at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1])
        })
    };
    let found = keys
        .par_chunks(1024)
        .map(|chunk| {
            ctx.check()?;
            Ok(chunk.iter().map(around).collect::<Vec<[u32; 27]>>())
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.concat())
}
