//! Surface and points put on the creases.
//!
//! In: a surface or points, creases. Out: the mesh cut along them, its vertices and the points on the sides
//! that meet there; farther off all stays as it was.

use super::chains::Creases;
use super::constants::CREASE;
use super::pull::{Pull, Pulls, pull};
use super::unfold::{Rings, is_folded, unfold};
use crate::atlas::ProjectedPoint;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::lists::Lists;
use rayon::prelude::*;

/// Moves the points beside creases onto the sides that meet there.
pub(super) fn points(projected: &mut [ProjectedPoint], creases: &Creases, ctx: &Context<'_>) -> Result<()> {
    let places = projected.par_iter().map(|p| (p.position, p.normal));
    for (i, pull) in Pulls::new(creases, places, ctx)?.iter() {
        let p = &mut projected[i];
        if p.chart == u32::MAX {
            continue;
        }
        (p.position, p.normal) = pull.moved(p.position, p.normal);
    }
    Ok(())
}

/// Cuts the surface along creases and moves its vertices onto the sides.
pub(super) fn surface(
    s: &mut Surface,
    creases: &Creases,
    edges: &Edges,
    neighbours: &Lists,
    ctx: &Context<'_>,
) -> Result<()> {
    let places = s.positions.par_iter().zip(&s.normals).map(|(p, n)| (*p, *n));
    let mut pulls = Pulls::new(creases, places, ctx)?;
    unfold(s, creases, &mut pulls, &Rings { edges, neighbours }, ctx)?;
    snap(s, &mut pulls, edges, ctx)?;
    for (i, (v, pull)) in pulls.iter().enumerate() {
        ctx.check_at(i)?;
        (s.positions[v], s.normals[v]) = pull.moved(s.positions[v], s.normals[v]);
    }
    cut(s, creases, &pulls, edges, ctx)
}

/// Where an edge crosses a crease, as a share of the way from its first end.
fn crossing(pulls: &Pulls, [a, b]: [u32; 2]) -> Option<f64> {
    let (a, b) = (pulls.of(a)?, pulls.of(b)?);
    let believed = a.weight.min(b.weight) > 0.5;
    let crosses = a.chain == b.chain && believed && a.across * b.across < 0.0;
    crosses.then(|| a.across / (a.across - b.across))
}

/// Says of vertices next to a crease that they are on it.
fn snap(s: &Surface, pulls: &mut Pulls, edges: &Edges, ctx: &Context<'_>) -> Result<()> {
    // The share of the way from a vertex to the crease along an edge, the vertex and the edge's other end.
    let mut near: Vec<(f64, [u32; 2])> = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        for ends in [[a, b], [b, a]] {
            near.extend(
                crossing(pulls, ends).filter(|&share| share < CREASE.snap).map(|share| (share, ends)),
            );
        }
    }
    sort_by(&mut near, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)), ctx)?;
    let around = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    for (i, (_, ends)) in near.into_iter().enumerate() {
        ctx.check_at(i)?;
        // An end that is on the crease by now is the edge's crossing.
        let Some(before) = crossing(pulls, ends).and_then(|_| pulls.of(ends[0])).copied() else { continue };
        pulls.set(ends[0], Some(Pull { across: 0.0, ..before }));
        // Two neighbours on the crease are an edge of it; a third beside both would flatten a triangle.
        let on = |w: &&u32| pulls.of(**w).is_some_and(Pull::is_on_line);
        let spoiled = around
            .of(ends[0])
            .iter()
            .map(|&f| &s.triangles[f as usize])
            .any(|t| t.iter().filter(on).count() > 2 || is_folded(s, pulls, t));
        if spoiled {
            pulls.set(ends[0], Some(before));
        }
    }
    Ok(())
}

/// Cuts the triangles that creases cross.
fn cut(s: &mut Surface, creases: &Creases, pulls: &Pulls, edges: &Edges, ctx: &Context<'_>) -> Result<()> {
    let mut middle = ctx.filled([u32::MAX; 3], s.triangles.len())?;
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        let Some(share) = crossing(pulls, [a, b]) else { continue };
        let [p, q] = [a, b].map(|v| s.positions[v as usize]);
        let at = p + (q - p) * share;
        let normal = (s.normals[a as usize] + s.normals[b as usize]).normalized();
        let chain = pulls.of(a).map(|p| p.chain);
        let Some(pull) = pull(creases, at, normal, chain) else { continue };
        let new = s.positions.len() as u32;
        s.positions.push(at + (pull.on_line - at) * pull.weight);
        s.normals.push(pull.ridge);
        s.chart.push(s.chart[if share < 0.5 { a } else { b } as usize]);
        for half in edge {
            middle[half.face()][half.side()] = new;
        }
    }
    for (f, middle) in middle.into_iter().enumerate() {
        ctx.check_at(f)?;
        split(s, f, middle);
    }
    Ok(())
}

/// Cuts a triangle at the new vertices of its sides, of which the k-th runs from corner k to the next. No
/// line crosses all three.
fn split(s: &mut Surface, f: usize, middle: [u32; 3]) {
    let t = s.triangles[f];
    let new = |k: usize| Some(middle[k % 3]).filter(|&m| m != u32::MAX);
    for k in 0..3 {
        let [a, b, c] = [0, 1, 2].map(|i| t[(k + i) % 3]);
        match [new(k), new(k + 1), new(k + 2)] {
            [Some(m), None, None] => {
                s.triangles[f] = [a, m, c];
                s.triangles.push([m, b, c]);
            }
            // The corner between both is alone on its side of the line.
            [Some(m), Some(n), None] => {
                s.triangles[f] = [m, b, n];
                let at = |v: u32| s.positions[v as usize];
                if at(a).dist2(at(n)) < at(m).dist2(at(c)) {
                    s.triangles.extend([[a, m, n], [a, n, c]]);
                } else {
                    s.triangles.extend([[a, m, c], [m, n, c]]);
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::chains::tests::{creases, piece};
    use super::*;
    use crate::numeric::{Rng, Vec3};
    use crate::run::Run;
    use crate::spatial::triangle::area_vector;

    /// Steps of the grid.
    const STEP: f64 = 0.6;

    /// A roof whose ridge is cut off, as a mesh of uneven triangles.
    fn blunt(seed: u64) -> Surface {
        let mut rng = Rng::new(seed);
        let n = 17u32;
        let mut at = |i: u32| {
            let [x, y] = [i % n, i / n].map(|k| STEP * (f64::from(k) - 8.0 + 0.5 * (rng.uniform() - 0.5)));
            Vec3([x, y, -(x * x + 0.5).sqrt()])
        };
        let positions: Vec<Vec3> = (0..n * n).map(&mut at).collect();
        let normals = positions.iter().map(|p| Vec3([-p[0] / p[2], 0.0, 1.0]).normalized()).collect();
        let corners = (0..(n - 1) * (n - 1)).map(|i| i / (n - 1) * n + i % (n - 1));
        let triangles = corners.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
        Surface { chart: vec![0; positions.len()], positions, normals, triangles }
    }

    #[test]
    fn the_mesh_is_cut_along_a_ridge_without_folds_or_gaps() {
        let pieces = (-2..=2).map(|k| piece([0.0, f64::from(k), 0.0], 1, 2.0)).collect();
        let ridge = creases(pieces).expect("a crease");
        for seed in 0..20 {
            let mut s = blunt(seed);
            let sharpened = Run::default().execute(|ctx| {
                let edges = Edges::new(&s.triangles, ctx)?;
                let before = edges.iter().filter(|e| e.len() == 1).count();
                let neighbours = Lists::of_neighbours(s.positions.len(), &edges, ctx)?;
                surface(&mut s, &ridge, &edges, &neighbours, ctx)?;
                let after = Edges::new(&s.triangles, ctx)?;
                Ok((before, after.iter().filter(|e| e.len() == 1).count(), after.iter().all(|e| e.len() < 3)))
            });
            let (before, after, manifold) = sharpened.expect("nothing stops it");
            assert!(before == after && manifold, "seed {seed}: {before} {after}");
            for t in &s.triangles {
                let corners = t.map(|v| s.positions[v as usize]);
                let middle = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
                if middle[1].abs() > 2.0 {
                    continue;
                }
                // All triangles face up, and none lies across the ridge.
                assert!(area_vector(corners)[2] > 0.0, "seed {seed}: {corners:?}");
                let [low, high] = corners.iter().fold([0.0f64; 2], |m, c| [m[0].min(c[0]), m[1].max(c[0])]);
                assert!(low > -0.01 || high < 0.01, "seed {seed}: {corners:?}");
            }
        }
    }
}
