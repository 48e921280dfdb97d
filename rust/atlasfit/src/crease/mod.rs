//! Creases: edges of the scanned part that the charts, smooth as they are, round off.
//!
//! In: the surface, the scan's points and where the charts put them. Out: the same with vertices and edges of
//! the mesh on each crease that the points ask for, and points and surface beside it on the two sides.
//!
//! About places where the surface bends, two explanations of the same points are compared by their evidence:
//! one smooth piece, or two that meet along a line ([`evidence`]). Where more than two sides are near, as at
//! the rim of a plate or in a corner, each two of them that meet are looked at alone ([`sides`]). Lines that
//! go on from each other are a crease ([`chains`]), and the mesh is cut along it ([`sharpen`]). Cutting a
//! mesh where its two sides meet is Attene, Falcidieno, Rossignac and Spagnuolo (2003); here the points say
//! where and whether.

mod bends;
mod cap;
mod chains;
pub(crate) mod constants;
mod corner;
mod evidence;
mod mend;
mod model;
mod moments;
mod normals;
mod piece;
mod pull;
mod sharpen;
mod sides;
mod unfold;
mod window;

use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::lists::Lists;
use chains::Creases;
use constants::CREASE;

/// The creases of a surface, to ask again when its triangles are others.
pub(crate) struct Creased(Creases);

impl Creased {
    /// A unit normal per corner of each triangle: at a crease, that of the triangle's side. None where no
    /// vertex has more than one.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn corner_normals(
        &self,
        s: &Surface,
        ctx: &Context<'_>,
    ) -> Result<Option<Vec<[[f32; 3]; 3]>>> {
        normals::of_corners(s, &self.0, ctx)
    }
}

/// Finds the creases, and puts the surface and the points on them. None where there is no crease.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn sharpen(
    s: &mut Surface,
    projected: &mut [ProjectedPoint],
    known: &KnownScan<'_>,
    ctx: &Context<'_>,
) -> Result<Option<Creased>> {
    let edges = Edges::new(&s.triangles, ctx)?;
    let bent = bends::find(s, &edges, ctx)?;
    if bent.is_empty() {
        return Ok(None);
    }
    let neighbours = Lists::of_neighbours(s.positions.len(), &edges, ctx)?;
    let Some(windows) = window::Windows::new(s, &neighbours, projected, known, ctx)? else {
        return Ok(None);
    };
    let chosen = bends::spread(&bent, CREASE.apart, s, &windows, ctx)?;
    let seeds: Vec<u32> = chosen.into_iter().map(|k| bent[k as usize]).collect();
    let pieces = evidence::pieces(s, &windows, &seeds, ctx)?;
    let Some(creases) = chains::chains(pieces, ctx)? else { return Ok(None) };
    let corners = corner::find(&creases, &windows, ctx)?;
    drop(windows);
    sharpen::surface(s, &creases, &edges, &neighbours, ctx)?;
    cap::surface(s, &corners, ctx)?;
    cap::surface(s, &mend::places(s, &creases, ctx)?, ctx)?;
    sharpen::points(projected, &creases, ctx)?;
    cap::points(projected, &corners, ctx)?;
    Ok(Some(Creased(corner::extended(creases, &corners, ctx)?)))
}
