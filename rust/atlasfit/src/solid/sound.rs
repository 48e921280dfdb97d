//! Whether a surface bounds a solid as it is.
//!
//! In: triangles in a tree. Out: whether they are closed, two-manifold, consistently oriented with the solid
//! behind them, and which meet elsewhere than at shared vertices and edges. A few that do are moved apart.

use super::constants::SOLID;
use super::mesh::Faces;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use crate::spatial::edges::Edges;
use crate::spatial::sets::Sets;
use crate::spatial::triangle::segment_meets;
use crate::spatial::winding::Winding;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Triangles looked at between two checks.
const CHECK: usize = 512;
/// So far in front of a triangle, in its perimeters, it is asked what lies there.
const IN_FRONT: f64 = 1e-3;
/// Two triangles at an edge whose normals' cosine is below this lie on each other. Source: chosen, close to
/// -1.
const FOLDED: f64 = -0.999_999;

/// Whether the triangles are closed, with the solid behind them, whether or not they meet. Every vertex is
/// taken to have one fan.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn encloses(faces: &Faces<'_>, winding: &Winding<'_>, ctx: &Context<'_>) -> Result<bool> {
    let mut sets = Sets::new(faces.positions.len());
    for (i, edge) in Edges::new(faces.triangles, ctx)?.iter().enumerate() {
        ctx.check_at(i)?;
        match edge {
            [x, y] if !x.runs_as(*y, faces.triangles) => {}
            _ => return Ok(false),
        }
        let [a, b] = edge[0].ends();
        sets.join(a, b);
    }
    // Nothing may lie in front of any part but the outside.
    let mut seen = vec![false; faces.positions.len()];
    for (i, (t, c)) in faces.triangles.iter().zip(&faces.corners).enumerate() {
        ctx.check_at(i)?;
        let part = sets.find(t[0]) as usize;
        let around = (c[0] - c[1]).norm() + (c[1] - c[2]).norm() + (c[2] - c[0]).norm();
        if seen[part] || faces.normal(i as u32).norm() == 0.0 {
            continue;
        }
        seen[part] = true;
        let middle = (c[0] + c[1] + c[2]) * (1.0 / 3.0);
        if winding.at(middle + faces.normal(i as u32) * (IN_FRONT * around)).abs() > 0.5 {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Those of the triangles `of` that meet others elsewhere than at shared vertices and edges.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn meeting(faces: &Faces<'_>, of: &[u32], ctx: &Context<'_>) -> Result<Vec<u32>> {
    let found = of
        .par_chunks(CHECK)
        .map(|chunk| {
            ctx.check()?;
            Ok(chunk.iter().copied().filter(|&t| meets_any(faces, t)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.concat())
}

/// Moves the few vertices of a closed surface that has triangles which meet, and those next to them, to the
/// means of their neighbours, in wider and wider rings, until none meet. The positions, or nothing where
/// that does not help.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn untangle(surface: &Surface, ctx: &Context<'_>) -> Result<Option<Vec<Vec3>>> {
    let triangles = &surface.triangles;
    let mut moved =
        Surface { positions: surface.positions.clone(), triangles: triangles.clone(), ..Surface::default() };
    // Vertices that have moved: only their triangles can have come to meet others.
    let mut free = vec![true; moved.positions.len()];
    for round in 0..SOLID.untangle {
        let asked: Vec<u32> = (0..triangles.len())
            .filter(|&t| triangles[t].iter().any(|&v| free[v as usize]))
            .map(|t| t as u32)
            .collect();
        let met = meeting(&Faces::new(&moved, ctx)?, &asked, ctx)?;
        if met.is_empty() {
            return Ok(Some(moved.positions));
        }
        if met.len() as f64 > SOLID.tangled * triangles.len() as f64 {
            return Ok(None);
        }
        free = around(&met, surface, round + 1, ctx)?;
        for _ in 0..SOLID.relaxed {
            relax(&mut moved, &free, ctx)?;
        }
    }
    Ok(None)
}

/// The vertices of triangles, and some rings of vertices about them.
fn around(of: &[u32], s: &Surface, rings: usize, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let mut all = vec![false; s.positions.len()];
    of.iter().flat_map(|&t| s.triangles[t as usize]).for_each(|v| all[v as usize] = true);
    for _ in 0..rings {
        let core = all.clone();
        for (i, t) in s.triangles.iter().enumerate() {
            ctx.check_at(i)?;
            if t.iter().any(|&v| core[v as usize]) {
                t.iter().for_each(|&v| all[v as usize] = true);
            }
        }
    }
    Ok(all)
}

/// Moves the free vertices halfway to the means of their neighbours.
fn relax(s: &mut Surface, free: &[bool], ctx: &Context<'_>) -> Result<()> {
    let mut sums: BTreeMap<u32, (Vec3, f64)> = BTreeMap::new();
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        for k in (0..3).filter(|&k| free[t[k] as usize]) {
            let (sum, count) = sums.entry(t[k]).or_default();
            *sum += s.positions[t[(k + 1) % 3] as usize] + s.positions[t[(k + 2) % 3] as usize];
            *count += 2.0;
        }
    }
    for (v, (sum, count)) in sums {
        let p = &mut s.positions[v as usize];
        *p = *p * 0.5 + sum * (0.5 / count);
    }
    Ok(())
}

/// Whether a triangle meets any other.
fn meets_any(faces: &Faces<'_>, t: u32) -> bool {
    let own = Aabb::of(&faces.corners[t as usize]);
    let end = faces.tree.meeting(&own, |u| {
        if u != t && meet(faces, t, u) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    end.is_break()
}

/// Whether two triangles meet elsewhere than at what they share.
fn meet(faces: &Faces<'_>, t: u32, u: u32) -> bool {
    let (a, b) = (faces.triangles[t as usize], faces.triangles[u as usize]);
    if !Aabb::of(&faces.corners[t as usize]).meets(&Aabb::of(&faces.corners[u as usize])) {
        return false;
    }
    let shared = a.iter().filter(|v| b.contains(v)).count();
    match shared {
        // Only the sides opposite to the shared vertex, or all sides.
        0 | 1 => crosses(faces, t, u) || crosses(faces, u, t),
        2 => faces.normal(t).dot(faces.normal(u)) < FOLDED,
        _ => true,
    }
}

/// Whether a side of `t` that shares no vertex with `u` crosses it.
fn crosses(faces: &Faces<'_>, t: u32, u: u32) -> bool {
    let (a, b) = (faces.triangles[t as usize], faces.triangles[u as usize]);
    let at = faces.corners[t as usize];
    (0..3).any(|k| {
        let j = (k + 1) % 3;
        !b.contains(&a[k]) && !b.contains(&a[j]) && segment_meets(at[k], at[j], &faces.corners[u as usize])
    })
}
