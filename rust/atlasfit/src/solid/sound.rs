//! Whether a surface bounds a solid as it is.
//!
//! In: triangles in a tree. Out: whether they are closed, two-manifold, consistently oriented with the solid
//! behind them, and which meet elsewhere than at shared vertices and edges. A few that do are moved apart.

use crate::error::Result;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::faces::Faces;
use crate::spatial::sets::Sets;
use crate::spatial::winding::Winding;

/// So far in front of a triangle, in its perimeters, it is asked what lies there.
const IN_FRONT: f64 = 1e-3;

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
