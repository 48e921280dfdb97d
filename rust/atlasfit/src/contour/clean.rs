//! From contoured quads to a clean triangle mesh.
//!
//! In: quads. Out: triangles with every edge in at most two of them and one fan about every vertex,
//! consistently oriented where that is possible, that end where the data end, without specks. The steps are
//! in files of their own; their order is here.

use super::surface::{Contour, ContourVertices, Surface};
use super::{Facing, boundary, bowties, compact, components, smooth, triangulate};
use crate::atlas::Chart;
use crate::error::{Error, Result};
use crate::run::Context;

/// Most quads: half-edges are numbered in 32 bits, and each quad becomes two triangles.
const MOST_QUADS: usize = u32::MAX as usize / 6;

/// Splits the quads, drops what is not manifold, trims at the end of the data, orients, removes specks
/// smaller than `min_triangles`, smooths what no data and none of the `charts` carry.
///
/// # Errors
/// Cancelled or out of time; [`Error::InvalidArgument`] above [`MOST_QUADS`].
pub(crate) fn clean(
    contour: Contour,
    charts: &[Chart],
    facing: &Facing<'_>,
    min_triangles: usize,
    ctx: &Context<'_>,
) -> Result<Surface> {
    let Contour { vertices, quads } = contour;
    if quads.len() > MOST_QUADS {
        return Err(Error::invalid(format!("the surface has {} quads", quads.len()), "Lower the detail"));
    }
    let ContourVertices { mut positions, normals, chart, filled, support } = vertices;
    let mut triangles = triangulate::split(&positions, &quads, ctx)?;
    drop(quads);
    triangulate::drop_non_manifold(&mut triangles, facing.one_sided, ctx)?;
    boundary::peel(&mut triangles, &support, ctx)?;
    boundary::trim(&mut positions, &triangles, &support, ctx)?;
    let mut surface = Surface { positions, normals, chart, triangles };
    components::orient(&mut surface, charts, facing, min_triangles, ctx)?;
    smooth::smooth(&mut surface, charts, filled, ctx)?;
    boundary::drop_flaps(&mut surface, ctx)?;
    bowties::split(&mut surface, ctx)?;
    compact::compact(&mut surface, ctx)?;
    Ok(surface)
}
