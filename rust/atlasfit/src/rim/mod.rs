//! Rims: the boundary of the surface put where the data end.
//!
//! In: the surface, whose boundary follows the charts' masks and so the voxels and a few points each; the
//! scan's points where the charts put them. Out: the same surface with each boundary on a smooth curve along
//! the end of its points.
//!
//! Where the data end is decided along a whole boundary at once ([`offsets`]): the points beside it are a
//! Poisson process that ends on a curve, blurred by the noise; the curve is as smooth as their evidence says.
//! Where the surface falls short the mesh follows ([`carry`]); what lies beyond is cut off ([`clip`]).
//! Holes about which points thin out are filled ([`unseen`]).

mod carry;
mod clip;
pub(crate) mod constants;
mod curve;
mod marks;
mod offsets;
pub(crate) mod unseen;

use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;
use crate::contour::{bowties, compact, loops};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use curve::Curve;
use rayon::prelude::*;

/// Moves the boundaries of the surface to where the data end.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn settle(
    s: &mut Surface,
    projected: &[ProjectedPoint],
    scan: &KnownScan<'_>,
    ctx: &Context<'_>,
) -> Result<()> {
    let rings = loops::of(s, ctx)?;
    if rings.is_empty() {
        return Ok(());
    }
    let inward = inward(s, ctx)?;
    let spacing = marks::spacing(s, &rings, projected, scan, ctx)?;
    let mut curves: Vec<Curve> = (rings.iter().zip(&spacing))
        .map(|(ring, spacing)| Curve::new(ring, &s.positions, &inward, spacing))
        .collect();
    curves.par_iter_mut().for_each(Curve::smooth);
    let marks = marks::of_points(&curves, projected, scan, ctx)?;
    (curves.par_iter_mut().zip(&marks)).try_for_each(|(curve, marks)| {
        curve.settle(&offsets::fit(marks, &curve.bends(), ctx)?);
        Ok(())
    })?;
    let mut targets: Vec<(u32, Vec3)> = Vec::new();
    for (ring, curve) in rings.iter().zip(&curves) {
        let at: Vec<Vec3> = ring.iter().map(|&v| s.positions[v as usize]).collect();
        let to = curve.farther_out(&at);
        targets.extend(ring.iter().zip(to).filter_map(|(&v, to)| Some((v, to?))));
    }
    carry::follow(s, &targets, scan.charts, ctx)?;
    clip::clip(s, &rings, &curves, ctx)?;
    bowties::split(s, ctx)?;
    compact::compact(s, ctx)
}

/// Which way the triangles about each vertex lie, summed.
fn inward(s: &Surface, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let mut sum = ctx.filled(Vec3::ZERO, s.positions.len())?;
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let corners = t.map(|v| s.positions[v as usize]);
        let whole = corners[0] + corners[1] + corners[2];
        for (&v, p) in t.iter().zip(corners) {
            sum[v as usize] += whole - p * 3.0;
        }
    }
    Ok(sum)
}
