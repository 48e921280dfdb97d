//! First cut: many small, nearly flat patches whose borders later merging can only remove.
//!
//! In: the surface. Out: a patch index per face. Greedy bottom-up clustering of faces (Garland, Willmott,
//! Heckbert 2001) with the normal-variance error of Cohen-Steiner, Alliez, Desbrun 2004 and a term that
//! favours compact patches; then border faces move between patches where that shortens the borders. Quads may
//! first be put into `blocks`.

mod blocks;
mod cluster;
mod constants;
mod seeds;
mod smooth;

use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;
use cluster::{Cluster, cost};
use constants::SEGMENT;
use rayon::prelude::*;
pub(crate) use seeds::FirstCut;
use seeds::{Seeds, seeds};
use smooth::{smooth, split_components};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A cut of the surface.
pub(crate) struct Segmentation {
    /// Patch per face; [`NONE`] for unusable faces.
    pub label: Vec<u32>,
    /// Number of patches.
    pub count: usize,
}

/// Two neighbouring clusters, as found when looking for the best partner of one of them.
#[derive(Clone, Copy, PartialEq)]
struct Candidate {
    cost: f64,
    a: u32,
    b: u32,
    /// How often each had grown.
    stamps: [u32; 2],
    /// The one whose best partner the other is.
    of: u32,
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}

impl Ord for Candidate {
    // Reversed: the heap gives the cheapest first; ties by index keep the order fixed.
    fn cmp(&self, o: &Self) -> Ordering {
        let key = |c: &Self| (c.a, c.b, c.of, c.stamps);
        o.cost.total_cmp(&self.cost).then_with(|| key(o).cmp(&key(self)))
    }
}

/// The cheapest partner of a cluster.
fn cheapest(clusters: &[Cluster], of: u32, flatness: f64) -> Option<Candidate> {
    let candidate = |&(other, l): &(u32, f64)| {
        let (a, b) = (of.min(other), of.max(other));
        let (ca, cb) = (&clusters[a as usize], &clusters[b as usize]);
        let cost = cost(ca, cb, l, flatness)?;
        Some(Candidate { cost, a, b, stamps: [ca.stamp, cb.stamp], of })
    };
    // The greatest comes first.
    clusters[of as usize].near.iter().filter_map(candidate).max()
}

/// Has cluster `a` take in its neighbour `b`.
fn take_in(clusters: &mut [Cluster], a: u32, b: u32) {
    let both = clusters[a as usize].with(&clusters[b as usize]);
    let taken = std::mem::take(&mut clusters[b as usize].near);
    clusters[b as usize].stamp = NONE;
    let ca = &mut clusters[a as usize];
    (ca.area, ca.sum, ca.angle) = (both.area, both.sum, both.angle);
    ca.stamp += 1;
    let mut near = std::mem::take(&mut ca.near);
    near.retain(|n| n.0 != b);
    for (g, l) in taken {
        if g == a {
            continue;
        }
        let of_g = &mut clusters[g as usize].near;
        of_g.retain(|n| n.0 != b);
        match near.iter_mut().find(|n| n.0 == g) {
            Some(n) => {
                n.1 += l;
                let total = n.1;
                if let Some(back) = of_g.iter_mut().find(|n| n.0 == a) {
                    back.1 = total;
                }
            }
            None => {
                near.push((g, l));
                of_g.push((a, l));
            }
        }
    }
    clusters[a as usize].near = near;
}

/// Joins clusters, cheapest pair first, until none fits another. Gives for each the cluster that took it in;
/// itself for those that are left.
fn join_all(clusters: &mut [Cluster], flatness: f64, ctx: &Context<'_>) -> Result<Vec<u32>> {
    // The queue holds the cheapest partner of every cluster. One that has changed since is looked for again
    // when its turn comes: what got cheaper is in the queue for the cluster that it got cheaper with.
    let all: Vec<u32> = (0..clusters.len() as u32).collect();
    let first: Vec<Vec<Candidate>> = all
        .par_chunks(SEGMENT.chunk)
        .map(|some| {
            ctx.check()?;
            Ok(some.iter().filter_map(|&c| cheapest(clusters, c, flatness)).collect())
        })
        .collect::<Result<_>>()?;
    let mut heap = BinaryHeap::from(first.into_iter().flatten().collect::<Vec<_>>());
    ctx.check()?;
    let mut taken_by = all;
    let (mut steps, mut looks) = (0usize, 0usize);
    while let Some(Candidate { a, b, stamps, of, .. }) = heap.pop() {
        looks += 1;
        // One with very many neighbours takes a millisecond.
        if looks.is_multiple_of(16) {
            ctx.check()?;
        }
        let (ca, cb) = (&clusters[a as usize], &clusters[b as usize]);
        let as_was = [ca.stamp == stamps[0], cb.stamp == stamps[1]];
        if as_was != [true; 2] {
            // One that grew is in the queue anew already.
            if as_was[usize::from(of == b)] {
                heap.extend(cheapest(clusters, of, flatness));
            }
            continue;
        }
        steps += 1;
        if steps.is_multiple_of(1024) {
            ctx.advance(1024);
        }
        // The one with more neighbours takes in the other.
        let (a, b) = if ca.near.len() >= cb.near.len() { (a, b) } else { (b, a) };
        taken_by[b as usize] = a;
        take_in(clusters, a, b);
        heap.extend(cheapest(clusters, a, flatness));
    }
    Ok(taken_by)
}

/// Cuts the surface into patches.
pub(crate) fn patches(s: &Surface, cut: FirstCut, ctx: &Context<'_>) -> Result<Segmentation> {
    let flatness = cut.flatness;
    let Seeds { mut clusters, of_face } = seeds(s, cut, ctx)?;
    let mut taken_by = join_all(&mut clusters, flatness, ctx)?;
    ctx.check()?;
    // Not the disjoint sets of `spatial`: a set's root is the cluster that holds its sums, not its smallest
    // member.
    let mut last = |mut c: u32| {
        while taken_by[c as usize] != c {
            taken_by[c as usize] = taken_by[taken_by[c as usize] as usize];
            c = taken_by[c as usize];
        }
        c
    };
    let mut label: Vec<u32> =
        (s.usable.iter().zip(&of_face)).map(|(&usable, &c)| if usable { last(c) } else { NONE }).collect();
    smooth(s, &mut label, &clusters, ctx)?;
    drop(clusters);
    ctx.check()?;
    let (label, count) = split_components(s, &label, ctx)?;
    Ok(Segmentation { label, count })
}
