//! Long boundaries cut in pieces where their two sides come close.
//!
//! In: rings of boundary vertices. Out: rings that are short enough to be triangulated; those of a slit are
//! cut across it.

use super::constants::CONTOUR;
use super::patch::TakenEdges;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbours;

/// Rings after cutting.
pub(super) struct Pieces {
    /// Rings short enough to be triangulated.
    pub short: Vec<Vec<u32>>,
    /// Rings, or what cuts have left of them, that are too long and cannot be cut.
    pub long: Vec<Vec<u32>>,
}

/// Cuts rings of more than `CONTOUR.max_edges` edges in two, and those again, by edges at most `longest` long
/// that are not taken.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn cut(
    positions: &[Vec3],
    rings: Vec<Vec<u32>>,
    taken: &TakenEdges,
    longest: f64,
    ctx: &Context<'_>,
) -> Result<Pieces> {
    let (mut todo, mut out) = (Vec::new(), Pieces { short: Vec::new(), long: Vec::new() });
    for ring in rings {
        let long = ring.len() > CONTOUR.max_edges;
        let pairs = if long { close_pairs(positions, &ring, taken, longest, ctx)? } else { vec![] };
        todo.push((ring, pairs));
    }
    while let Some((ring, pairs)) = todo.pop() {
        ctx.check()?;
        let n = ring.len() as u32;
        if ring.len() <= CONTOUR.max_edges {
            out.short.push(ring);
            continue;
        }
        // The most even cut; the shortest of several.
        let even = |p: &CloseVertices| (p.j - p.i).min(n - (p.j - p.i));
        let better =
            |p: &&CloseVertices, q: &&CloseVertices| even(p).cmp(&even(q)).then(q.dist2.total_cmp(&p.dist2));
        let Some(&CloseVertices { i, j, .. }) = pairs.iter().max_by(better) else {
            out.long.push(ring);
            continue;
        };
        let inner = ring[i as usize..=j as usize].to_vec();
        let outer = ring[j as usize..].iter().chain(&ring[..=i as usize]).copied().collect();
        let (mut within, mut beyond) = (Vec::new(), Vec::new());
        // The place in `outer` of a place in the ring.
        let in_outer = |k: u32| if k >= j { k - j } else { n - j + k };
        for p in pairs.into_iter().filter(|p| (p.i, p.j) != (i, j)) {
            if p.i >= i && p.j <= j {
                within.push(CloseVertices { i: p.i - i, j: p.j - i, ..p });
            } else if [p.i, p.j].iter().all(|&k| k <= i || k >= j) {
                let (a, b) = (in_outer(p.i), in_outer(p.j));
                beyond.push(CloseVertices { i: a.min(b), j: a.max(b), ..p });
            }
        }
        todo.push((inner, within));
        todo.push((outer, beyond));
    }
    Ok(out)
}

/// Two places of a ring that lie close together, i < j.
struct CloseVertices {
    i: u32,
    j: u32,
    dist2: f64,
}

/// The pairs of a ring's vertices that are at most `longest` apart but `CONTOUR.behind` times as far along
/// the ring, and have no edge between them yet.
fn close_pairs(
    positions: &[Vec3],
    ring: &[u32],
    taken: &TakenEdges,
    longest: f64,
    ctx: &Context<'_>,
) -> Result<Vec<CloseVertices>> {
    let at: Vec<Vec3> = ring.iter().map(|&v| positions[v as usize]).collect();
    let tree = Neighbours::build(&at, ctx)?;
    // How far along the ring each vertex is.
    let mut along = Vec::with_capacity(at.len());
    let mut whole = 0.0;
    for (i, p) in at.iter().enumerate() {
        along.push(whole);
        whole += (*p).dist2(at[(i + 1) % at.len()]).sqrt();
    }
    let (mut found, mut out) = (Vec::new(), Vec::new());
    for (i, &p) in at.iter().enumerate() {
        if i % 256 == 0 {
            ctx.check()?;
        }
        tree.within(p, longest, &mut found);
        for f in &found {
            let j = f.index as usize;
            let apart = (along[j] - along[i]).abs();
            let far = apart.min(whole - apart) > CONTOUR.behind * longest;
            if j > i + 1 && far && !taken.contains(ring[i], ring[j]) {
                out.push(CloseVertices { i: i as u32, j: j as u32, dist2: f.dist2 });
            }
        }
    }
    Ok(out)
}
