//! The surface's end: where the data end, not where the field does.
//!
//! In: triangles, and how much data each vertex has (its blended mask). Out: the triangles and vertices of a
//! boundary that follows the data.

use super::adjacency::{self, FaceAdjacency};
use super::constants::CONTOUR;
use super::surface::{Surface, corners, remove_marked};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::triangle::area_vector;

/// Takes away what lies beyond the end of the data. The field reaches a few voxels farther everywhere; where
/// that closed a gap the triangles there have no boundary edge and stay, elsewhere they are peeled off from
/// the boundary inwards, up to those that the end of the data crosses.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn peel(triangles: &mut Vec<[u32; 3]>, support: &[f32], ctx: &Context<'_>) -> Result<()> {
    let beyond = |t: &[u32; 3]| {
        let s = t.map(|v| support[v as usize]);
        s.contains(&CONTOUR.off_band) || s.iter().all(|s| *s < CONTOUR.end_of_data)
    };
    let beyond: Vec<bool> = triangles.iter().map(beyond).collect();
    let mut gone = vec![false; triangles.len()];
    let adjacency = adjacency::of(triangles, ctx)?;
    let at_boundary = |&t: &u32| beyond[t as usize] && adjacency[t as usize].at_boundary();
    let mut front: Vec<u32> = (0..triangles.len() as u32).filter(at_boundary).collect();
    while !front.is_empty() {
        ctx.check()?;
        let mut next = Vec::new();
        for &t in &front {
            gone[t as usize] = true;
        }
        for &t in &front {
            let open = |u: &u32| beyond[*u as usize] && !gone[*u as usize];
            next.extend(adjacency[t as usize].neighbours().map(|(u, _)| u).filter(open));
        }
        next.sort_unstable();
        next.dedup();
        front = next;
    }
    remove_marked(triangles, &gone);
    Ok(())
}

/// Moves the vertices of open boundaries that lie beyond the end of the data onto it, along the triangles'
/// edges: the boundary follows the data instead of the voxels.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn trim(
    positions: &mut [Vec3],
    triangles: &[[u32; 3]],
    support: &[f32],
    ctx: &Context<'_>,
) -> Result<()> {
    let steps = steps_to_end(positions, triangles, support, ctx)?;
    let mut old: Vec<Option<Vec3>> = vec![None; positions.len()];
    for ((p, old), step) in positions.iter_mut().zip(&mut old).zip(steps) {
        if step.count > 0 {
            *old = Some(*p);
            *p += step.sum * (1.0 / f64::from(step.count));
        }
    }
    undo_turned(positions, triangles, old, ctx)
}

/// The ways from a vertex to where the end of the data crosses its edges.
#[derive(Clone, Copy)]
struct Steps {
    sum: Vec3,
    count: u32,
}

/// For each vertex at the boundary that lies beyond the end of the data, the ways from it to that end.
fn steps_to_end(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    support: &[f32],
    ctx: &Context<'_>,
) -> Result<Vec<Steps>> {
    let edges = Edges::new(triangles, ctx)?;
    let mut boundary = vec![false; positions.len()];
    for edge in edges.iter().filter(|edge| edge.len() == 1) {
        for v in edge[0].ends() {
            boundary[v as usize] = true;
        }
    }
    let mut steps = vec![Steps { sum: Vec3::ZERO, count: 0 }; positions.len()];
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends().map(|v| v as usize);
        for (out, inside) in [(a, b), (b, a)] {
            let (low, high) = (support[out], support[inside]);
            if boundary[out] && low < CONTOUR.end_of_data && high >= CONTOUR.end_of_data {
                let t = f64::from((CONTOUR.end_of_data - low) / (high - low)).min(CONTOUR.farthest);
                steps[out].sum += (positions[inside] - positions[out]) * t;
                steps[out].count += 1;
            }
        }
    }
    Ok(steps)
}

/// Moves vertices back to where they were (`old`, of those that were moved) until no triangle has turned
/// over.
fn undo_turned(
    positions: &mut [Vec3],
    triangles: &[[u32; 3]],
    mut old: Vec<Option<Vec3>>,
    ctx: &Context<'_>,
) -> Result<()> {
    let near: Vec<&[u32; 3]> =
        triangles.iter().filter(|t| t.iter().any(|&v| old[v as usize].is_some())).collect();
    let before = |t: &&[u32; 3]| area_vector(t.map(|v| old[v as usize].unwrap_or(positions[v as usize])));
    let was: Vec<Vec3> = near.iter().map(before).collect();
    loop {
        ctx.check()?;
        let mut back = Vec::new();
        for (t, was) in near.iter().zip(&was) {
            if area_vector(corners(positions, t)).dot(*was) <= 0.0 {
                back.extend(t.iter().filter_map(|&v| old[v as usize].take().map(|p| (v, p))));
            }
        }
        if back.is_empty() {
            return Ok(());
        }
        for (v, p) in back {
            positions[v as usize] = p;
        }
    }
}

/// Takes away triangles that hang on one neighbour only and stand off it as a spike does, or have turned over
/// onto it.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn drop_flaps(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let normal = |t: &[u32; 3]| area_vector(corners(&s.positions, t)).normalized();
    let flap = |(t, adjacency): (&[u32; 3], &FaceAdjacency)| {
        let mut neighbours = adjacency.neighbours();
        let (Some((u, opposed)), None) = (neighbours.next(), neighbours.next()) else { return false };
        let facing = normal(t).dot(normal(&s.triangles[u as usize]));
        (if opposed { -facing } else { facing }) < CONTOUR.spike
    };
    let flaps: Vec<bool> = s.triangles.iter().zip(&adjacency::of(&s.triangles, ctx)?).map(flap).collect();
    remove_marked(&mut s.triangles, &flaps);
    Ok(())
}
