//! First cut: many small, nearly flat patches whose borders later merging can only remove.
//!
//! In: the surface. Out: a patch index per face. Greedy bottom-up clustering of faces (Garland, Willmott, Heckbert
//! 2001) with the normal-variance error of Cohen-Steiner, Alliez, Desbrun 2004 and a term that favours compact
//! patches; then border faces move between patches where that shortens the borders.

use super::surface::{Cells, NONE, Surface};
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Weight of compactness against flatness: a normal turn of about 0.3 rad weighs as much as shape.
const COMPACT: f64 = 0.01;
/// A patch's normals must stay within this angle of its mean, so that projection to a plane cannot flip: cos 70°.
const CONE_COS: f64 = 0.342;

/// Passes of [`seeds`] at most: each leaves about two thirds of the clusters.
const SEED_PASSES: usize = 6;
/// But more while there are more clusters than this: the queue's cost for each grows with their number.
const SEEDS: usize = 60_000;
/// Seeds are flatter than patches by this factor, so that the queue decides everything that matters.
const SEED_FLATNESS: f64 = 0.3;

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

struct Cluster {
    area: f64,
    sum: Vec3,
    /// Cone round the normals: axis is `sum` normalised, half angle in radians.
    angle: f64,
    stamp: u32,
    /// Neighbouring clusters and the length shared with each.
    near: Vec<(u32, f64)>,
}

fn cone(a: &Cluster, b: &Cluster, axis: Vec3) -> f64 {
    [a, b].iter().map(|c| c.sum.normalized().dot(axis).clamp(-1.0, 1.0).acos() + c.angle).fold(0.0, f64::max)
}

/// Cost of joining two clusters; `None` where the result would not be flat enough.
fn cost(a: &Cluster, b: &Cluster, shared: f64, flatness: f64, cone_limit: f64) -> Option<f64> {
    let area = a.area + b.area;
    let sum = a.sum + b.sum;
    let error = area - sum.norm();
    if error > flatness * area {
        return None;
    }
    let gain = error - (a.area - a.sum.norm()) - (b.area - b.sum.norm());
    if cone(a, b, sum.normalized()) > cone_limit {
        return None;
    }
    Some((gain.max(0.0) + COMPACT * area) / (shared.max(1e-12) * area.max(1e-300).sqrt()))
}

/// Groups faces a few at a time without a queue: every cluster picks its cheapest neighbour, and pairs that pick
/// each other join; repeated until it stops paying. Returns clusters with their neighbours, and one per face.
fn seeds(s: &Surface, flatness: f64, ctx: &Context<'_>) -> Result<(Vec<Cluster>, Vec<u32>)> {
    let m = s.faces();
    let cone_limit = CONE_COS.acos();
    let one = |f: usize| Cluster {
        area: s.area[f],
        sum: (s.normal[f] * s.area[f]),
        angle: 0.0,
        stamp: 0,
        near: Vec::new(),
    };
    let (mut of_face, mut clusters): (Vec<u32>, Vec<Cluster>) = match &s.cells {
        None => ((0..m as u32).collect(), (0..m).map(one).collect()),
        Some(cells) => {
            let join = |c: u32| {
                cells.faces(c).iter().map(|&f| one(f as usize)).reduce(|a, b| {
                    let sum = a.sum + b.sum;
                    let angle = cone(&a, &b, sum.normalized());
                    Cluster { area: a.area + b.area, sum, angle, stamp: 0, near: Vec::new() }
                })
            };
            (cells.of_face.clone(), (0..cells.count() as u32).filter_map(join).collect())
        }
    };
    ctx.check()?;
    // Edges (a, b, length) with a < b, sorted.
    let mut edges: Vec<(u32, u32, f64)> = Vec::with_capacity(m * 3 / 2);
    for f in 0..m {
        ctx.check_at(f)?;
        for k in 0..3 {
            let h = s.twin[f][k];
            if h != NONE && h / 3 > f as u32 {
                let (a, b) = (s.cell(f as u32), s.cell(h / 3));
                if a != b {
                    edges.push((a.min(b), a.max(b), f64::from(s.length[f][k])));
                }
            }
        }
    }
    for pass in 0.. {
        ctx.check()?;
        if pass >= SEED_PASSES && clusters.len() <= SEEDS {
            break;
        }
        let mut costs = vec![f64::INFINITY; edges.len()];
        edges.par_chunks(4096).zip(costs.par_chunks_mut(4096)).try_for_each(|(edges, costs)| {
            ctx.check()?;
            for (&(a, b, l), c) in edges.iter().zip(costs) {
                if let Some(cost) =
                    cost(&clusters[a as usize], &clusters[b as usize], l, flatness, cone_limit)
                {
                    *c = cost;
                }
            }
            Ok(())
        })?;
        let mut pick = vec![(f64::INFINITY, NONE); clusters.len()];
        for (e, (&(a, b, _), &c)) in edges.iter().zip(&costs).enumerate() {
            ctx.check_at(e)?;
            for v in [a, b] {
                if c < pick[v as usize].0 {
                    pick[v as usize] = (c, e as u32);
                }
            }
        }
        ctx.check()?;
        let mut name = vec![NONE; clusters.len()];
        let mut joined: Vec<Cluster> = Vec::with_capacity(clusters.len() * 2 / 3);
        for c in 0..clusters.len() {
            ctx.check_at(c)?;
            if name[c] != NONE {
                continue;
            }
            name[c] = joined.len() as u32;
            let e = pick[c].1;
            let partner = if e == NONE { NONE } else { edges[e as usize].0 ^ edges[e as usize].1 ^ c as u32 };
            let one = &clusters[c];
            if partner != NONE && pick[partner as usize].1 == e {
                let two = &clusters[partner as usize];
                name[partner as usize] = name[c];
                let sum = one.sum + two.sum;
                let angle = cone(one, two, sum.normalized());
                joined.push(Cluster { area: one.area + two.area, sum, angle, stamp: 0, near: Vec::new() });
            } else {
                joined.push(Cluster { near: Vec::new(), ..*one });
            }
        }
        ctx.check()?;
        of_face.par_iter_mut().for_each(|c| *c = name[*c as usize]);
        edges.par_iter_mut().for_each(|e| {
            let (a, b) = (name[e.0 as usize], name[e.1 as usize]);
            (e.0, e.1) = (a.min(b), a.max(b));
        });
        edges.retain(|e| e.0 != e.1);
        sort_by(&mut edges, |x, y| (x.0, x.1).cmp(&(y.0, y.1)).then(x.2.total_cmp(&y.2)), ctx)?;
        edges.dedup_by(|x, kept| {
            let same = (x.0, x.1) == (kept.0, kept.1);
            if same {
                kept.2 += x.2;
            }
            same
        });
        ctx.check()?;
        let fewer = clusters.len() - joined.len();
        clusters = joined;
        if fewer * 8 < clusters.len() {
            break;
        }
    }
    for &(a, b, l) in &edges {
        clusters[a as usize].near.push((b, l));
        clusters[b as usize].near.push((a, l));
    }
    Ok((clusters, of_face))
}

/// Cuts the surface into patches. `flatness` bounds 1 - |mean normal| of a patch. Returns patch per face
/// ([`NONE`] for unusable faces) and the number of patches.
pub(super) fn patches(s: &Surface, flatness: f64, ctx: &Context<'_>) -> Result<(Vec<u32>, usize)> {
    let m = s.faces();
    let cone_limit = CONE_COS.acos();
    let (mut clusters, seed_of) = seeds(s, flatness * SEED_FLATNESS, ctx)?;
    // The queue holds the cheapest partner of every cluster. One that has changed since is looked for again when its turn comes: what got cheaper is
    // in the queue for the cluster that it got cheaper with.
    let best = |clusters: &[Cluster], of: u32| {
        let candidate = |&(other, l): &(u32, f64)| {
            let (a, b) = (of.min(other), of.max(other));
            let (ca, cb) = (&clusters[a as usize], &clusters[b as usize]);
            let cost = cost(ca, cb, l, flatness, cone_limit)?;
            Some(Candidate { cost, a, b, stamps: [ca.stamp, cb.stamp], of })
        };
        // The greatest comes first.
        clusters[of as usize].near.iter().filter_map(candidate).max()
    };
    let first = (0..clusters.len() as u32).into_par_iter().filter_map(|c| best(&clusters, c));
    let mut heap = BinaryHeap::from(first.collect::<Vec<_>>());
    ctx.check()?;
    let mut owner: Vec<u32> = (0..clusters.len() as u32).collect();
    let (mut steps, mut looks) = (0usize, 0usize);
    while let Some(Candidate { a, b, stamps, of, .. }) = heap.pop() {
        looks += 1;
        if looks.is_multiple_of(1024) {
            ctx.check()?;
        }
        let (ca, cb) = (&clusters[a as usize], &clusters[b as usize]);
        let as_was = [ca.stamp == stamps[0], cb.stamp == stamps[1]];
        if as_was != [true; 2] {
            // One that grew is in the queue anew already.
            if as_was[usize::from(of == b)] {
                heap.extend(best(&clusters, of));
            }
            continue;
        }
        steps += 1;
        if steps.is_multiple_of(1024) {
            ctx.advance(1024);
        }
        // The one with more neighbours takes in the other.
        let (a, b) = if ca.near.len() >= cb.near.len() { (a, b) } else { (b, a) };
        let sum = ca.sum + cb.sum;
        let angle = cone(ca, cb, sum.normalized());
        let taken = std::mem::take(&mut clusters[b as usize].near);
        let b_area = clusters[b as usize].area;
        clusters[b as usize].stamp = NONE;
        owner[b as usize] = a;
        let ca = &mut clusters[a as usize];
        ca.area += b_area;
        ca.sum = sum;
        ca.angle = angle;
        ca.stamp += 1;
        let mut near = std::mem::take(&mut ca.near);
        near.retain(|n| n.0 != b);
        for (g, l) in taken {
            if g == a {
                continue;
            }
            let gn = &mut clusters[g as usize].near;
            gn.retain(|n| n.0 != b);
            match near.iter_mut().find(|n| n.0 == g) {
                Some(n) => {
                    n.1 += l;
                    let total = n.1;
                    if let Some(back) = gn.iter_mut().find(|n| n.0 == a) {
                        back.1 = total;
                    }
                }
                None => {
                    near.push((g, l));
                    gn.push((a, l));
                }
            }
        }
        clusters[a as usize].near = near;
        heap.extend(best(&clusters, a));
    }
    drop(heap);
    ctx.check()?;
    let mut label = vec![NONE; m];
    for f in 0..m {
        if s.usable[f] {
            let mut r = seed_of[f];
            while owner[r as usize] != r {
                owner[r as usize] = owner[owner[r as usize] as usize];
                r = owner[r as usize];
            }
            label[f] = r;
        }
    }
    smooth(s, &mut label, &clusters, ctx)?;
    drop(clusters);
    ctx.check()?;
    Ok(split_components(s, &label))
}

/// Moves border cells to the neighbouring patch where that shortens the border.
fn smooth(s: &Surface, label: &mut [u32], clusters: &[Cluster], ctx: &Context<'_>) -> Result<()> {
    let axis: Vec<Vec3> =
        clusters.iter().map(|c| if c.stamp == NONE { Vec3::ZERO } else { c.sum.normalized() }).collect();
    // Patches beyond each edge of the cell, and how long the border with each is.
    let mut near: Vec<(u32, f64)> = Vec::new();
    for _ in 0..8 {
        ctx.check()?;
        let mut moved = 0;
        for c in 0..s.cells.as_ref().map_or(label.len(), Cells::count) as u32 {
            let own = [c];
            let faces = s.cells.as_ref().map_or(&own[..], |cells| cells.faces(c));
            let first = faces[0] as usize;
            if label[first] == NONE {
                continue;
            }
            near.clear();
            let mut here = 0.0;
            for &f in faces {
                for k in 0..3 {
                    let h = s.twin[f as usize][k];
                    if h == NONE || s.cells.is_some() && s.cell(h / 3) == c {
                        continue;
                    }
                    let (l, length) = (label[h as usize / 3], f64::from(s.length[f as usize][k]));
                    if l == label[first] {
                        here += length;
                    } else if l != NONE {
                        match near.iter_mut().find(|n| n.0 == l) {
                            Some(n) => n.1 += length,
                            None => near.push((l, length)),
                        }
                    }
                }
            }
            let mut best = (0.0, label[first]);
            for &(l, share) in &near {
                let to = axis[l as usize];
                if faces.iter().any(|&f| s.normal[f as usize].dot(to) < CONE_COS) {
                    continue;
                }
                // A cell that is much flatter against the other patch goes there even at equal length.
                let normal = s.normal[first];
                let turn = normal.dot(to) - normal.dot(axis[label[first] as usize]);
                let gain = share - here + 0.3 * turn * share.max(here);
                if gain > best.0 + 1e-9 {
                    best = (gain, l);
                }
            }
            if best.1 != label[first] {
                faces.iter().for_each(|&f| label[f as usize] = best.1);
                moved += 1;
            }
        }
        if moved == 0 {
            break;
        }
    }
    Ok(())
}

/// Numbers the connected pieces of equal label.
pub(super) fn split_components(s: &Surface, label: &[u32]) -> (Vec<u32>, usize) {
    let mut out = vec![NONE; label.len()];
    let mut count = 0;
    let mut stack = Vec::new();
    for f in 0..label.len() {
        if out[f] != NONE || label[f] == NONE {
            continue;
        }
        out[f] = count;
        stack.push(f as u32);
        while let Some(f) = stack.pop() {
            for &h in &s.twin[f as usize] {
                if h != NONE {
                    let g = h as usize / 3;
                    if out[g] == NONE && label[g] == label[f as usize] {
                        out[g] = count;
                        stack.push(g as u32);
                    }
                }
            }
        }
        count += 1;
    }
    (out, count as usize)
}
