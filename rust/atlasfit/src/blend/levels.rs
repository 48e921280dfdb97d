//! How wide the voxels are where: levels of blocks, as the points ask.
//!
//! In: points with their spacing, the side of the finest voxels. Out: which blocks a point reaches. Blocks of
//! a level are twice as wide as those of the level before; each is either whole or cut into the eight of the
//! level before. Blocks that touch differ by one level at the most (a balanced octree; von Herzen and Barr
//! 1987). Beside a coarser block, a fine one needs corners that the coarser one has not: blocks of the fine
//! level lie over it there and lend theirs.

use super::blocks::{LEVELS, block_key, block_of_key, level_of_key, side};
use super::constants::BLEND;
use super::influence::{Reach, visit_blocks};
use crate::atlas::BlendSite;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// How wide voxels are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Voxels {
    /// Side of the finest.
    pub finest: f64,
    /// Side in spacings of the points where those lie far apart; zero: all are of one size.
    pub per_spacing: f64,
}

impl Voxels {
    /// The level that a point asks for.
    fn level(self, site: &BlendSite) -> usize {
        let ratio = self.per_spacing * site.spacing / self.finest;
        if ratio >= 2.0 { (ratio.log2() as usize).min(LEVELS - 1) } else { 0 }
    }
}

/// Which blocks of which level there are.
pub(super) struct Levels {
    /// Side of the finest voxels.
    h: f64,
    /// The coarsest level.
    pub(super) top: usize,
    /// Blocks that are cut into eight.
    cut: FxHashSet<u64>,
    /// Whole blocks that blocks of the level before lie over.
    covered: FxHashSet<u64>,
    /// Those.
    lenders: FxHashSet<u64>,
}

impl Levels {
    /// The levels that points ask for.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn of(sites: &[BlendSite], voxels: Voxels, ctx: &Context<'_>) -> Result<Self> {
        let h = voxels.finest;
        let top = sites.par_iter().map(|site| voxels.level(site)).max().unwrap_or(0);
        let mut levels =
            Self { h, top, cut: FxHashSet::default(), covered: FxHashSet::default(), lenders: FxHashSet::default() };
        // Blocks of the level before that are cut.
        let mut before: Vec<u64> = Vec::new();
        for level in 1..=top {
            let mut cut = asked(sites, voxels, level - 1, ctx)?;
            cut.extend(before.iter().flat_map(|&key| around(key)).map(parent));
            unique(&mut cut, ctx)?;
            levels.cut.extend(&cut);
            before = cut;
        }
        levels.lend(ctx)?;
        Ok(levels)
    }

    /// Puts lenders where whole blocks touch coarser ones on their upper sides.
    fn lend(&mut self, ctx: &Context<'_>) -> Result<()> {
        for (i, &cut) in self.cut.iter().enumerate() {
            ctx.check_at(i)?;
            for whole in children(cut).filter(|child| !self.cut.contains(child)) {
                let (level, b) = (level_of_key(whole), block_of_key(whole));
                for o in 1..8 {
                    let beside = block_key(level, [0, 1, 2].map(|k| b[k] + (o >> k & 1)));
                    if !self.cut.contains(&parent(beside)) {
                        self.lenders.insert(beside);
                        self.covered.insert(parent(beside));
                    }
                }
            }
        }
        Ok(())
    }

    /// Names the blocks that a point reaches.
    pub(super) fn visit(&self, site: &BlendSite, mut visit: impl FnMut(u64)) {
        let reach = Reach::new(site, side(self.h, self.top));
        visit_blocks(&reach, |b| self.descend(site, block_key(self.top, b), &mut visit));
    }

    /// The same within a block that the point reaches.
    fn descend(&self, site: &BlendSite, key: u64, visit: &mut impl FnMut(u64)) {
        let level = level_of_key(key);
        let below = || {
            let reach = Reach::new(site, side(self.h, level - 1));
            children(key).filter(move |&child| reach.holds(block_of_key(child)))
        };
        if level > 0 && self.cut.contains(&key) {
            below().for_each(|child| self.descend(site, child, visit));
            return;
        }
        visit(key);
        if level > 0 && self.covered.contains(&key) {
            below().filter(|child| self.lenders.contains(child)).for_each(visit);
        }
    }

    /// Whether the voxels of a block are contoured.
    pub(super) fn contours(&self, key: u64) -> bool {
        !self.lenders.contains(&key)
    }
}

/// The blocks of the level after the given that hold those that points of this level reach.
fn asked(sites: &[BlendSite], voxels: Voxels, level: usize, ctx: &Context<'_>) -> Result<Vec<u64>> {
    let found: Vec<Vec<u64>> = sites
        .par_chunks(BLEND.level_chunk)
        .map(|chunk| {
            ctx.check()?;
            let mut found = Vec::new();
            for site in chunk.iter().filter(|site| voxels.level(site) == level) {
                let reach = Reach::new(site, side(voxels.finest, level));
                visit_blocks(&reach, |b| found.push(parent(block_key(level, b))));
            }
            found.sort_unstable();
            found.dedup();
            Ok(found)
        })
        .collect::<Result<_>>()?;
    Ok(found.concat())
}

fn unique(keys: &mut Vec<u64>, ctx: &Context<'_>) -> Result<()> {
    sort(keys, ctx)?;
    keys.dedup();
    Ok(())
}

/// The block of the next level that holds a block.
fn parent(key: u64) -> u64 {
    block_key(level_of_key(key) + 1, block_of_key(key).map(|x| x.div_euclid(2)))
}

/// The eight blocks of the level before in a block.
fn children(key: u64) -> impl Iterator<Item = u64> {
    let (level, b) = (level_of_key(key), block_of_key(key));
    (0..8).map(move |c| block_key(level - 1, [0, 1, 2].map(|k| 2 * b[k] + (c >> k & 1))))
}

/// A block and the 26 around it.
fn around(key: u64) -> impl Iterator<Item = u64> {
    let (level, b) = (level_of_key(key), block_of_key(key));
    (0..27).map(move |n| block_key(level, [b[0] + n % 3 - 1, b[1] + n / 3 % 3 - 1, b[2] + n / 9 - 1]))
}
