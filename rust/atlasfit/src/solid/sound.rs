//! Whether a surface bounds a solid as it is.
//!
//! In: triangles in a tree. Out: whether they are closed, two-manifold, consistently oriented with the solid
//! behind them, and meet nowhere but at shared vertices and edges.

use super::mesh::Faces;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use crate::spatial::edges::Edges;
use crate::spatial::sets::Sets;
use crate::spatial::triangle::crossing;
use crate::spatial::winding::Winding;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Triangles looked at between two checks.
const CHECK: usize = 512;
/// So far in front of a triangle, in its perimeters, it is asked what lies there.
const IN_FRONT: f64 = 1e-3;
/// Two triangles at an edge whose normals' cosine is below this lie on each other. Source: chosen, close to -1.
const FOLDED: f64 = -0.999_999;

/// Whether the triangles bound a solid. Every vertex is taken to have one fan.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn is_solid(faces: &Faces<'_>, winding: &Winding<'_>, ctx: &Context<'_>) -> Result<bool> {
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
    Ok(first_meeting(faces, ctx)?.is_none())
}

/// Two triangles that meet elsewhere than at shared vertices and edges, if there are any.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn first_meeting(faces: &Faces<'_>, ctx: &Context<'_>) -> Result<Option<[u32; 2]>> {
    let chunks: Vec<usize> = (0..faces.corners.len()).step_by(CHECK).collect();
    let found = chunks
        .par_iter()
        .map(|&from| {
            ctx.check()?;
            let all = from..(from + CHECK).min(faces.corners.len());
            Ok(all.map(|t| t as u32).find_map(|t| meets_one(faces, t).map(|u| [t, u])))
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.into_iter().flatten().next())
}

/// A triangle with a higher number that `t` meets.
fn meets_one(faces: &Faces<'_>, t: u32) -> Option<u32> {
    let own = Aabb::of(&faces.corners[t as usize]);
    let end = faces.tree.meeting(&own, |u| {
        if u > t && meet(faces, t, u) { ControlFlow::Break(u) } else { ControlFlow::Continue(()) }
    });
    end.break_value()
}

/// Whether two triangles meet elsewhere than at what they share.
fn meet(faces: &Faces<'_>, t: u32, u: u32) -> bool {
    let (a, b) = (faces.triangles[t as usize], faces.triangles[u as usize]);
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
        !b.contains(&a[k])
            && !b.contains(&a[j])
            && crossing(at[k], at[j], &faces.corners[u as usize]).is_some()
    })
}
