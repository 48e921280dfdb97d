//! A filling's triangles made as small as those about it.
//!
//! In: triangles that fill a hole, all between vertices of its boundary. Out: the same place with triangles
//! of about one size, by halving edges and flipping them to be Delaunay (after Liepa 2003). The boundary
//! stays.

use super::constants::CONTOUR;
use super::patch::TakenEdges;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::{Edges, HalfEdge};
use crate::spatial::triangle::area_vector;
use std::collections::BTreeSet;

/// Halves edges until none within is longer than `longest`; no edge `taken` is made. New vertices go behind
/// `positions`. Returns for each which older vertex it is made of.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn refine(
    positions: &mut Vec<Vec3>,
    triangles: &mut Vec<[u32; 3]>,
    longest: f64,
    taken: &TakenEdges,
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let mut made_of = Vec::new();
    for _ in 0..CONTOUR.refinements {
        let length2 =
            |[e, _]: &[HalfEdge; 2]| positions[e.low() as usize].dist2(positions[e.high() as usize]);
        let mut long: Vec<(f64, [HalfEdge; 2])> =
            inner(triangles, ctx)?.into_iter().map(|e| (length2(&e), e)).collect();
        long.retain(|(length2, _)| *length2 > longest * longest);
        if long.is_empty() {
            break;
        }
        long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut changed = vec![false; triangles.len()];
        for (_, edge) in long {
            ctx.check()?;
            if edge.iter().any(|e| changed[e.face()]) {
                continue;
            }
            let [a, b] = edge[0].ends();
            let middle = positions.len() as u32;
            positions.push((positions[a as usize] + positions[b as usize]) * 0.5);
            made_of.push(a);
            for e in edge {
                changed[e.face()] = true;
                let [across, from, to] = from_across(e, triangles);
                triangles[e.face()] = [across, from, middle];
                triangles.push([across, middle, to]);
            }
        }
        for _ in 0..CONTOUR.flips {
            if !flip(positions, triangles, taken, ctx)? {
                break;
            }
        }
    }
    Ok(made_of)
}

/// The corners of a half-edge's triangle, the one across the edge first.
fn from_across(e: HalfEdge, triangles: &[[u32; 3]]) -> [u32; 3] {
    [2, 0, 1].map(|i| triangles[e.face()][(e.side() + i) % 3])
}

/// All edges between two of the triangles.
fn inner(triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Vec<[HalfEdge; 2]>> {
    let edges = Edges::new(triangles, ctx)?;
    Ok(edges.iter().filter_map(|e| <[HalfEdge; 2]>::try_from(e).ok()).collect())
}

/// Flips edges whose angles across are more than 180 degrees together. Returns whether it flipped any.
fn flip(
    positions: &[Vec3],
    triangles: &mut [[u32; 3]],
    taken: &TakenEdges,
    ctx: &Context<'_>,
) -> Result<bool> {
    let at = |v: u32| positions[v as usize];
    let edges = inner(triangles, ctx)?;
    let mut there: BTreeSet<[u32; 2]> = edges.iter().map(|e| e[0].ends()).collect();
    let mut changed = vec![false; triangles.len()];
    for &[e, f] in &edges {
        ctx.check()?;
        let (s, t) = (e.face(), f.face());
        let ([c, a, b], [d, b2, a2]) = (from_across(e, triangles), from_across(f, triangles));
        let flipped = [c.min(d), c.max(d)];
        let stays = changed[s] || changed[t] || [a, b] != [a2, b2];
        if stays || c == d || there.contains(&flipped) || taken.contains(c, d) {
            continue;
        }
        let cotangent = |p: Vec3, q: Vec3, r: Vec3| {
            let (x, y) = (q - p, r - p);
            x.dot(y) / x.cross(y).norm().max(f64::MIN_POSITIVE)
        };
        if cotangent(at(c), at(a), at(b)) + cotangent(at(d), at(a), at(b)) > -1e-9 {
            continue;
        }
        let new = [[a, d, c], [d, b, c]];
        let normal = |t: [u32; 3]| area_vector(t.map(at));
        let before = normal(triangles[s]) + normal(triangles[t]);
        if new.iter().any(|&t| normal(t).dot(before) <= 0.0) {
            continue;
        }
        [triangles[s], triangles[t]] = new;
        (changed[s], changed[t]) = (true, true);
        there.insert(flipped);
    }
    Ok(changed.contains(&true))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    #[test]
    fn a_fan_over_a_polygon_becomes_triangles_of_one_size_that_cover_the_same_area() {
        let n = 40;
        let angle = |i: u32| f64::from(i) * std::f64::consts::TAU / f64::from(n);
        let mut positions: Vec<Vec3> = (0..n).map(|i| Vec3([angle(i).cos(), angle(i).sin(), 0.0])).collect();
        let mut triangles: Vec<[u32; 3]> = (1..n - 1).map(|i| [0, i, i + 1]).collect();
        let area = |p: &[Vec3], ts: &[[u32; 3]]| -> f64 {
            ts.iter().map(|t| 0.5 * area_vector(t.map(|v| p[v as usize]))[2]).sum()
        };
        let before = area(&positions, &triangles);
        let side = 2.0 * (0.5 * angle(1)).sin();
        Run::default()
            .execute(|ctx| {
                let taken = TakenEdges::among(&[], &[], ctx)?;
                refine(&mut positions, &mut triangles, 1.5 * side, &taken, ctx)
            })
            .unwrap();
        assert!((area(&positions, &triangles) - before).abs() < 1e-12);
        let smallest =
            triangles.iter().map(|t| area_vector(t.map(|v| positions[v as usize]))[2]).fold(1.0, f64::min);
        assert!(smallest > 0.05 * side * side, "{smallest} for sides of {side}");
        let edges = Run::default().execute(|ctx| inner(&triangles, ctx)).unwrap();
        let length2 = |e: &[HalfEdge; 2]| {
            let [a, b] = e[0].ends().map(|v| positions[v as usize]);
            a.dist2(b)
        };
        assert!(edges.iter().all(|e| length2(e) <= (1.5 * side).powi(2)));
        // A disk: one vertex more than edges less triangles.
        assert_eq!(positions.len() + triangles.len(), edges.len() + n as usize + 1);
    }
}
