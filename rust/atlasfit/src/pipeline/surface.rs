//! The surface of an oriented atlas.
//!
//! In: the atlas and its points. Out: one triangle mesh in the normalised frame, charts and points turned to
//! the side that it faces.

use super::constants::PIPELINE;
use super::options::DenoiseOptions;
use super::prepare::{Frame, InputMap, Scan};
use super::sheets::OrientedAtlas;
use super::warnings;
use crate::atlas::{Chart, ProjectedPoint, Vote};
use crate::blend::{blocks, field, fill, sites};
use crate::contour::holes::{self, Filled};
use crate::contour::{cavities, clean, components, quads, smooth, surface::Surface};
use crate::error::{Error, Result};
use crate::numeric::vec3::Vec3;
use crate::orient;
use crate::run::{Context, Stage};
use crate::solid::{self, Solid};
use crate::spatial::constants::SPATIAL;
use crate::spatial::spacing::Sampling;

/// What was built. Lengths are in the normalised frame.
pub(super) struct Built {
    /// The surface.
    pub surface: Surface,
    /// For each of its vertices, whether it was invented to close the surface; only of a solid.
    pub extrapolated: Option<Vec<bool>>,
    /// The charts, facing as the surface does.
    pub charts: Vec<Chart>,
    /// The scan's points on the charts, facing as the surface does.
    pub projected: Vec<ProjectedPoint>,
    /// Median spacing of the scan's points.
    pub median_spacing: f64,
    /// Side of the voxels.
    pub voxel: f64,
    /// Holes that were filled.
    pub filled_holes: usize,
    /// Whether some part of the surface is one-sided.
    pub one_sided: bool,
    /// The frame in the user's.
    pub frame: Frame,
    /// Where the user's points went.
    pub input: InputMap,
}

/// Builds the surface.
pub(super) fn build(
    scan: Scan,
    atlas: OrientedAtlas,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<Built> {
    let Scan { points, tree, sampling, frame, mut input, .. } = scan;
    let OrientedAtlas { fitted, members, relations, conflicts, mut votes, mut projected } = atlas;
    let median = sampling.median;
    ctx.stage(Stage::Project, 2);
    let voxel = voxel(&sampling) / options.detail;
    // What lies so far away that its voxels have no name is set aside.
    for p in projected.iter_mut().filter(|p| !blocks::within_range(p.position, voxel)) {
        p.chart = u32::MAX;
    }
    ctx.advance(1);
    if votes.is_empty() {
        let part = orient::connected(fitted.len(), &relations);
        let origin = frame.origin.map(|x| -x / frame.scale);
        if let Some(v) = orient::find_scanner(&projected, &sampling.spacing, &part, origin, ctx)? {
            votes = votes_toward(v, &projected, fitted.len());
        }
    }
    let sites = sites::of_points(&points, &projected, &fitted, &members, &sampling, ctx)?;
    ctx.advance(1);

    // Contouring needs the most memory: what is done with goes first.
    drop(tree);
    drop(members);
    let speck =
        (PIPELINE.speck * (PIPELINE.voxel * median / voxel).powi(2)).max(PIPELINE.least_speck) as usize;
    let mut charts: Vec<Chart> = fitted.into_iter().map(|f| f.chart).collect();
    let mut grid = field::sample(&charts, sites, &relations, &conflicts, voxel, ctx)?;
    fill::fill(&mut grid, ctx)?;
    let contour = quads::contour(grid, ctx)?;
    let mut surface = clean::clean(contour, !conflicts.is_empty(), speck, &votes, ctx)?;
    let own = points_of_charts(&projected, charts.len());
    components::remove_unsupported(&mut surface, &own, PIPELINE.unsupported, ctx)?;
    let longest = (PIPELINE.gap * median).max(options.fill_holes / frame.scale);
    let Filled { holes: filled_holes, touched, left } =
        holes::fill(&mut surface, longest, PIPELINE.slit * median, ctx)?;
    smooth::smooth(&mut surface, touched, ctx)?;
    if votes.is_empty() {
        cavities::turn_cavities(&mut surface, ctx)?;
    }
    if surface.triangles.is_empty() {
        return Err(Error::degenerate(
            "the charts make no connected surface",
            "Give a denser scan, set the noise by hand, or lower the detail",
        ));
    }
    input.warnings.extend(warnings::holes_left(options.fill_holes, &left, frame.scale));
    input.warnings.extend(warnings::many_faces(surface.triangles.len(), points.len()));
    ctx.check()?;
    let side = agreement(&surface, &charts, ctx)?;
    let turned = orient::face(&mut charts, &relations, &side);
    for p in &mut projected {
        if turned.get(p.chart as usize).is_some_and(|t| *t) {
            p.normal = -p.normal;
        }
    }
    let one_sided = !conflicts.is_empty();
    let mut extrapolated = None;
    if options.watertight {
        let solid: Solid = solid::close(surface, voxel, ctx)?;
        input.warnings.extend(warnings::plates(&solid, one_sided, frame.scale));
        (surface, extrapolated) = (solid.surface, Some(solid.extrapolated));
    }
    Ok(Built {
        surface,
        extrapolated,
        charts,
        projected,
        median_spacing: median,
        voxel,
        filled_holes,
        one_sided,
        frame,
        input,
    })
}

/// Area of the surface, about: the squares that the points stand for.
pub(super) fn area(sampling: &Sampling) -> f64 {
    let widest = PIPELINE.alone * SPATIAL.widest * sampling.median;
    sampling.spacing.iter().map(|&s| f64::from(s).min(widest).powi(2)).sum()
}

/// How the points, as they face now, vote on each chart's side when a scanner at `v` saw them.
fn votes_toward(v: Vec3, projected: &[ProjectedPoint], charts: usize) -> Vec<Vote> {
    let mut votes = vec![Vote::default(); charts];
    for p in projected {
        if let Some(vote) = votes.get_mut(p.chart as usize) {
            vote.add((v - p.position).normalized().dot(p.normal));
        }
    }
    votes
}

/// Side of the voxels for a detail of 1.
pub(super) fn voxel(sampling: &Sampling) -> f64 {
    let spread = (area(sampling) / sampling.spacing.len() as f64).sqrt();
    (PIPELINE.voxel * sampling.median).max(PIPELINE.voxel_spread * spread)
}

/// How many points each chart weighs most at.
fn points_of_charts(projected: &[ProjectedPoint], charts: usize) -> Vec<u32> {
    let mut own = vec![0u32; charts];
    for p in projected {
        if let Some(n) = own.get_mut(p.chart as usize) {
            *n += 1;
        }
    }
    own
}

/// For each chart how much of the surface agrees with its normal, less how much does not: the surface knows
/// which side is out.
fn agreement(surface: &Surface, charts: &[Chart], ctx: &Context<'_>) -> Result<Vec<f64>> {
    let mut side = vec![0.0; charts.len()];
    let vertices = surface.positions.iter().zip(&surface.normals).zip(&surface.chart);
    for (i, ((&p, &n), &c)) in vertices.enumerate() {
        ctx.check_at(i)?;
        if let Some(chart) = charts.get(c as usize) {
            side[c as usize] += chart.sign * n.dot(chart.normal_over(p));
        }
    }
    Ok(side)
}
