//! A triangle mesh with fewer triangles, as near to the first one as is asked for.
//!
//! In: a two-manifold mesh, with boundary or without; about each of its vertices, how far the surface may
//! move and how long edges may get. Out: one with larger triangles where the surface is flat. Edges are
//! collapsed, those that change the surface least first: each collapse is judged by the planes of the
//! triangles about it (quadrics: Garland and Heckbert 1997, without memory as Lindstrom and Turk 1998), and
//! every vertex of the first mesh stays within its error of the triangle it now belongs to (as Ciampalini et
//! al. 1997), and the middle of every edge too where the error is a promise. Then edges are flipped and
//! vertices moved along the surface, within the same bounds, so that triangles get near equal sides (Botsch
//! and Kobbelt 2004), and short edges of triangles that stay bad are collapsed.
//!
//! The mesh is cut into blocks of a grid. Those are worked on at the same time, each without the vertices
//! that it shares with others; then the grid is shifted by half a cell, and the seams are done. What is done
//! in a block depends on nothing else: the result is the same for any number of threads.
//!
//! A mesh with UVs is cut along its seams (`cut_seams`); both sides of a seam are collapsed together
//! (`seam`), and no triangle turns over in UV space (`uv`).

mod block;
mod collapse;
pub(crate) mod constants;
mod costs;
mod cut;
mod cut_seams;
mod data;
mod hand_over;
mod mend;
mod mesh;
mod points;
mod rank;
mod seam;
mod shape;
mod stars;
#[cfg(test)]
mod tests;
mod uv;

use crate::error::Result;
use crate::run::Context;
use constants::SIMPLIFY;
pub(crate) use data::{Dense, Goal, Role, Seams, Simplified, bound};
use data::{First, Level, Mesh, Points, Work};
pub use mesh::{SimplifiedMesh, SimplifyOptions, simplify_mesh};

/// Simplifies a mesh.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn simplify(dense: &Dense<'_>, goal: &Goal, ctx: &Context<'_>) -> Result<Simplified> {
    let points = Points::new(dense, goal, ctx)?;
    let first = First { dense, goal, points: &points };
    let mut mesh = Mesh::new(&first, ctx)?;
    let least = goal.error.iter().copied().fold(f32::INFINITY, f32::min);
    if mesh.triangles.len() > goal.faces && least > 0.0 {
        if goal.faces == 0 {
            as_far_as_allowed(&mut mesh, &first, ctx)?;
        } else {
            to_the_number(&mut mesh, &first, ctx)?;
        }
    }
    Ok(mesh.finished(dense.seams))
}

/// Collapses all that the bounds allow.
fn as_far_as_allowed(mesh: &mut Mesh, first: &First<'_>, ctx: &Context<'_>) -> Result<()> {
    let bounded = first.goal.longest.iter().any(|l| l.is_finite());
    let by_length = SIMPLIFY.lengths.map(|length| Level { error: 1.0, length });
    let by_error = SIMPLIFY.errors.map(|error| Level { error, length: 1.0 });
    let work =
        Work { levels: if bounded { &by_length } else { &by_error }, surplus: None, share: 1.0, shape: true };
    let enough = if bounded { SIMPLIFY.again } else { SIMPLIFY.few };
    let mut before = [usize::MAX; 2];
    for round in 0.. {
        before = [before[1], mesh.triangles.len()];
        if !bounded {
            // What could not go before may go among larger triangles.
            mesh.open.fill(true);
        }
        mesh.round(first, &work, round, ctx)?;
        // What is a seam in one round is within a block in the next: both have a say.
        let gone = before[0].saturating_sub(mesh.triangles.len()) as f64;
        if round > 0 && gone < enough * before[0] as f64 {
            break;
        }
    }
    Ok(())
}

/// Collapses what changes the surface least until so many triangles are left.
fn to_the_number(mesh: &mut Mesh, first: &First<'_>, ctx: &Context<'_>) -> Result<()> {
    let left = |mesh: &Mesh| mesh.triangles.len() as f64 / first.goal.faces as f64;
    // On a smooth surface the error of a mesh is in inverse proportion to its triangles: edges may cost as
    // many times more as there are to be fewer triangles after a round.
    let fewer = |mesh: &Mesh| left(mesh).sqrt().clamp(left(mesh).min(SIMPLIFY.last_step), SIMPLIFY.step);
    let pairs = 0.5 * mesh.triangles.len() as f64 * (1.0 - 1.0 / fewer(mesh));
    let cheap = (SIMPLIFY.edges * pairs) as usize;
    let mut error = mesh.costs(first, ctx)?.of_rank(cheap).unwrap_or(1.0).max(SIMPLIFY.least);
    // An edge is judged by planes; vertices may move a little farther than these.
    let within = |error: f64| (2.0 * error).min(1.0);
    let mut round = 0;
    while mesh.triangles.len() > first.goal.faces {
        let before = mesh.triangles.len();
        let surplus = before - first.goal.faces;
        let levels = [Level { error, length: 1.0 }];
        let work = Work { levels: &levels, surplus: Some(surplus), share: within(error), shape: false };
        mesh.open.fill(true);
        let costs = mesh.round(first, &work, round, ctx)?;
        round += 1;
        let gone = before - mesh.triangles.len();
        let stuck = (gone as f64) < SIMPLIFY.stuck * surplus as f64;
        if stuck && error >= 1.0 {
            break;
        }
        // Each edge has two triangles. So many edges cost less than this before.
        let rank = 0.5 * surplus.saturating_sub(gone) as f64;
        let next = costs.of_rank(rank as usize).unwrap_or(1.0);
        let more = fewer(mesh).max(if stuck { SIMPLIFY.growth } else { 1.0 });
        error = (more * error).max(next).min(1.0);
    }
    mesh.open.fill(true);
    // Two rounds belong together: one on a grid, one on the same grid shifted.
    round += round % 2;
    for _ in 0..2 {
        let work = Work { levels: &[], surplus: None, share: within(error), shape: true };
        mesh.round(first, &work, round, ctx)?;
        round += 1;
    }
    Ok(())
}
