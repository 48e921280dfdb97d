//! A triangle mesh with fewer triangles, as near to the first one as is asked for.
//!
//! In: a two-manifold mesh, with boundary or without. Out: one with larger triangles where the surface is
//! flat. Edges are collapsed, those that change the surface least first: each collapse is judged by the
//! planes of the triangles that it stands for (quadrics: Garland and Heckbert 1997), and every vertex of the
//! first mesh stays within the greatest error of the triangles it now belongs to (as Ciampalini et al. 1997).
//! Instead of a queue, sweeps over the mesh take all edges that cost little, then those that cost more: a
//! sweep takes edges only that share no triangle, so that their order hardly matters.

mod collapse;
pub(crate) mod constants;
mod quadric;
#[cfg(test)]
mod tests;

use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use collapse::Mesh;
pub(crate) use collapse::Simplified;
use constants::SIMPLIFY;

/// How far a mesh is to be simplified: until one of the two is reached.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Goal {
    /// Triangles that are few enough.
    pub faces: usize,
    /// Greatest distance of a vertex of the first mesh from the new one, in the mesh's unit.
    pub max_error: f64,
}

/// Simplifies a mesh each of whose vertices some triangle names.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn simplify(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    goal: &Goal,
    ctx: &Context<'_>,
) -> Result<Simplified> {
    let mut mesh = Mesh::new(positions, triangles, goal.max_error, ctx)?;
    let mut most = (SIMPLIFY.first * mesh.mean_edge()).min(goal.max_error);
    while mesh.triangles.len() > goal.faces {
        let before = mesh.triangles.len();
        mesh.sweep(most, before - goal.faces, ctx)?;
        if ((before - mesh.triangles.len()) as f64) < SIMPLIFY.few * before as f64 {
            if most >= goal.max_error {
                break;
            }
            most = (2.0 * most).min(goal.max_error);
        }
    }
    Ok(mesh.finished())
}
