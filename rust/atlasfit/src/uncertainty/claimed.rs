//! The points that lie on charts, to be searched by their places there.
//!
//! In: the points as the charts put them. Out: a search tree, and whose places it holds.

use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbours;

/// The points on charts.
pub(super) struct Claimed {
    /// Their places.
    pub tree: Neighbours,
    /// Their indices.
    pub index: Vec<u32>,
}

/// The points on charts.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn claimed(projected: &[ProjectedPoint], ctx: &Context<'_>) -> Result<Claimed> {
    let index: Vec<u32> =
        (0..projected.len() as u32).filter(|&i| projected[i as usize].chart != u32::MAX).collect();
    let places: Vec<Vec3> = index.iter().map(|&i| projected[i as usize].position).collect();
    Ok(Claimed { tree: Neighbours::build(&places, ctx)?, index })
}
