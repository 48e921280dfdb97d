//! The first clusters, a few faces each.
//!
//! In: the surface. Out: clusters with their neighbours, and one per face.

use super::blocks::blocks;
use super::cluster::{Cluster, cost};
use super::constants::SEGMENT;
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::run::Context;
use crate::unwrap::surface::{Cells, NONE, Surface};
use rayon::prelude::*;

/// What patches are cut first.
#[derive(Clone, Copy)]
pub(crate) struct FirstCut {
    /// Bound on 1 - |mean normal| of a patch.
    pub flatness: f64,
    /// Whether quads are first put into blocks.
    pub blocks: bool,
}

/// The border between two clusters.
#[derive(Clone, Copy)]
struct Edge {
    /// The two clusters, the smaller number first.
    ends: [u32; 2],
    /// Its length.
    length: f64,
}

/// Clusters, and which one each face lies in.
pub(super) struct Seeds {
    pub clusters: Vec<Cluster>,
    pub of_face: Vec<u32>,
}

/// Groups faces a few at a time without a queue: every cluster picks its cheapest neighbour, and pairs that
/// pick each other join; repeated until it stops paying. Clusters are flatter than the patches, but for
/// blocks.
pub(super) fn seeds(s: &Surface, cut: FirstCut, ctx: &Context<'_>) -> Result<Seeds> {
    let Seeds { mut clusters, mut of_face } = cells_alone(s, ctx)?;
    ctx.check()?;
    let mut edges = cell_edges(s, ctx)?;
    if cut.blocks {
        let (joined, name) = join_blocks(&clusters, &blocks(s, &clusters, cut.flatness, ctx)?);
        of_face.iter_mut().for_each(|c| *c = name[*c as usize]);
        rename(&mut edges, &name, ctx)?;
        clusters = joined;
    }
    let flatness = cut.flatness * SEGMENT.seed_flatness;
    for pass in 0.. {
        ctx.check()?;
        if pass >= SEGMENT.seed_passes && clusters.len() <= SEGMENT.most_seeds {
            break;
        }
        let cheapest = cheapest_edges(&clusters, &edges, flatness, ctx)?;
        let (joined, name) = join_pairs(&clusters, &edges, &cheapest, ctx)?;
        ctx.check()?;
        of_face.par_iter_mut().for_each(|c| *c = name[*c as usize]);
        rename(&mut edges, &name, ctx)?;
        ctx.check()?;
        let fewer = clusters.len() - joined.len();
        clusters = joined;
        if fewer * SEGMENT.fewest_joined < clusters.len() {
            break;
        }
    }
    for (i, &Edge { ends: [a, b], length }) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        clusters[a as usize].near.push((b, length));
        clusters[b as usize].near.push((a, length));
    }
    Ok(Seeds { clusters, of_face })
}

/// Every cell, or face, a cluster of its own.
pub(super) fn cells_alone(s: &Surface, ctx: &Context<'_>) -> Result<Seeds> {
    let m = s.faces();
    let mut clusters = Vec::with_capacity(s.cells.as_ref().map_or(m, Cells::count));
    let one = |f: usize| Cluster::new(s.area[f], s.normal[f] * s.area[f], 0.0);
    let of_face = match &s.cells {
        None => {
            for f in 0..m {
                ctx.check_at(f)?;
                clusters.push(one(f));
            }
            (0..m as u32).collect()
        }
        Some(cells) => {
            let join = |c: u32| cells.faces(c).iter().map(|&f| one(f as usize)).reduce(|a, b| a.with(&b));
            for c in 0..cells.count() {
                ctx.check_at(c)?;
                clusters.extend(join(c as u32));
            }
            cells.of_face.clone()
        }
    };
    Ok(Seeds { clusters, of_face })
}

/// The edges between cells, in the order of the faces.
fn cell_edges(s: &Surface, ctx: &Context<'_>) -> Result<Vec<Edge>> {
    let mut edges: Vec<Edge> = Vec::with_capacity(s.faces() * 3 / 2);
    for f in 0..s.faces() {
        ctx.check_at(f)?;
        for k in 0..3 {
            let h = s.twin[f][k];
            if h != NONE && h / 3 > f as u32 {
                let (a, b) = (s.cell(f as u32), s.cell(h / 3));
                if a != b {
                    edges.push(Edge { ends: [a.min(b), a.max(b)], length: s.cost(f, k) });
                }
            }
        }
    }
    Ok(edges)
}

/// For each cluster the edge across which it is joined most cheaply; [`NONE`] where nothing may be joined.
fn cheapest_edges(
    clusters: &[Cluster],
    edges: &[Edge],
    flatness: f64,
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let mut costs = vec![f64::INFINITY; edges.len()];
    edges.par_chunks(SEGMENT.chunk).zip(costs.par_chunks_mut(SEGMENT.chunk)).try_for_each(
        |(edges, costs)| {
            ctx.check()?;
            for (&Edge { ends: [a, b], length }, c) in edges.iter().zip(costs) {
                if let Some(cost) = cost(&clusters[a as usize], &clusters[b as usize], length, flatness) {
                    *c = cost;
                }
            }
            Ok(())
        },
    )?;
    let mut least = vec![(f64::INFINITY, NONE); clusters.len()];
    for (e, (edge, &c)) in edges.iter().zip(&costs).enumerate() {
        ctx.check_at(e)?;
        for v in edge.ends {
            if c < least[v as usize].0 {
                least[v as usize] = (c, e as u32);
            }
        }
    }
    ctx.check()?;
    Ok(least.into_iter().map(|l| l.1).collect())
}

/// Makes the clusters of each block one. Gives the clusters then, and the new number of each old one.
fn join_blocks(clusters: &[Cluster], block_of: &[u32]) -> (Vec<Cluster>, Vec<u32>) {
    let mut joined: Vec<Cluster> = Vec::new();
    let mut of_block = vec![NONE; clusters.len()];
    let mut name = Vec::with_capacity(clusters.len());
    for (one, &b) in clusters.iter().zip(block_of) {
        let known = if b == NONE { NONE } else { of_block[b as usize] };
        if known == NONE {
            if b != NONE {
                of_block[b as usize] = joined.len() as u32;
            }
            name.push(joined.len() as u32);
            joined.push(one.bare());
        } else {
            name.push(known);
            joined[known as usize] = joined[known as usize].with(one);
        }
    }
    (joined, name)
}

/// Joins each two clusters that have the same cheapest edge. Gives the clusters then, and the new number of
/// each old one.
fn join_pairs(
    clusters: &[Cluster],
    edges: &[Edge],
    cheapest: &[u32],
    ctx: &Context<'_>,
) -> Result<(Vec<Cluster>, Vec<u32>)> {
    let mut name = vec![NONE; clusters.len()];
    let mut joined: Vec<Cluster> = Vec::with_capacity(clusters.len() * 2 / 3);
    for (c, one) in clusters.iter().enumerate() {
        ctx.check_at(c)?;
        if name[c] != NONE {
            continue;
        }
        name[c] = joined.len() as u32;
        let e = cheapest[c];
        let partner = edges.get(e as usize).map_or(NONE, |e| e.ends[0] ^ e.ends[1] ^ c as u32);
        if partner != NONE && cheapest[partner as usize] == e {
            name[partner as usize] = name[c];
            joined.push(one.with(&clusters[partner as usize]));
        } else {
            joined.push(one.bare());
        }
    }
    Ok((joined, name))
}

/// Gives the edges their clusters' new numbers; those inside a cluster go, and those between the same two
/// become one.
fn rename(edges: &mut Vec<Edge>, name: &[u32], ctx: &Context<'_>) -> Result<()> {
    edges.par_iter_mut().for_each(|e| {
        let [a, b] = e.ends.map(|c| name[c as usize]);
        e.ends = [a.min(b), a.max(b)];
    });
    edges.retain(|e| e.ends[0] != e.ends[1]);
    sort_by(edges, |x, y| x.ends.cmp(&y.ends).then(x.length.total_cmp(&y.length)), ctx)?;
    edges.dedup_by(|x, kept| {
        let same = x.ends == kept.ends;
        if same {
            kept.length += x.length;
        }
        same
    });
    Ok(())
}
