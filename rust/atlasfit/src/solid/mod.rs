//! A solid from an open surface, for printing: closed, two-manifold, consistently oriented, without
//! self-intersections.
//!
//! In: an oriented surface. Out: the surface of a solid that follows it, and which vertices were invented.
//! [`field`] says what is inside, [`grow`] visits the lattice about the solid's surface, [`contour`] makes
//! triangles of it. A surface that is a solid's already stays as it is ([`sound`]).

mod carry;
mod constants;
mod contour;
mod field;
mod grow;
mod lattice;
mod mesh;
pub(crate) mod sound;
#[cfg(test)]
mod tests;

use crate::contour::surface::Surface;
use crate::contour::untangle::untangle;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::faces::Faces;
use crate::spatial::winding::Winding;
use constants::SOLID;
use field::Field;

/// The surface of a solid.
pub(crate) struct Solid {
    /// Closed, facing outward.
    pub(crate) surface: Surface,
    /// For each vertex, whether it was invented.
    pub(crate) extrapolated: Vec<bool>,
    /// Thickness of what encloses nothing; 0 where the surface was a solid's already.
    pub(crate) thickness: f64,
    /// Whether some part of it had to be made thick.
    pub(crate) plates: bool,
}

/// Makes the surface of a solid from a surface that was contoured with voxels of side `voxel`.
///
/// # Errors
/// Cancelled or out of time; too little memory.
pub(crate) fn close(surface: Surface, voxel: f64, ctx: &Context<'_>) -> Result<Solid> {
    let faces = Faces::new(&surface.positions, &surface.triangles, ctx)?;
    let winding = Winding::new(&faces.tree, &faces.corners, ctx)?;
    if sound::encloses(&faces, &winding, ctx)? {
        let mut surface = surface.clone();
        if untangle(&mut surface, ctx)? == 0 {
            let extrapolated = vec![false; surface.positions.len()];
            return Ok(Solid { surface, extrapolated, thickness: 0.0, plates: false });
        }
    }
    let reach = surface.positions.iter().flat_map(|p| p.0).fold(0.0, |m: f64, x| m.max(x.abs()));
    let side = (SOLID.step * voxel).max(4.0 * reach / f64::from(SOLID.range));
    let thickness = SOLID.thickness.max(SOLID.least_thickness * side);
    let field = Field::new(&faces, winding, side, thickness, ctx)?;
    let lower = (0..faces.positions.len()).filter(|&v| field.level(v) < SOLID.level - SOLID.told).count();
    let plates = lower as f64 > SOLID.told_share * faces.positions.len() as f64;
    let grown = grow::grow(&field, &faces, ctx)?;
    drop(field);
    let contour = contour::contour(&grown, &faces, ctx)?;
    drop(grown);
    let (closed, extrapolated) = carry::carry(&contour, &faces, &surface, ctx)?;
    Ok(Solid { surface: closed, extrapolated, thickness, plates })
}
