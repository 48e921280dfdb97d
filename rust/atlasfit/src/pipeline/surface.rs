//! The surface of an oriented atlas.
//!
//! In: the atlas and its points. Out: one triangle mesh in the normalised frame, charts and points turned to
//! the side that it faces.

use super::constants::PIPELINE;
use super::lighten::{self, Known};
use super::options::DenoiseOptions;
use super::parts::{self, LeftOut};
use super::prepare::{Frame, InputMap, Scan};
use super::sheets::OrientedAtlas;
use super::{voxels, warnings};
use crate::atlas::projected::chart_means;
use crate::atlas::{BlendSite, Chart, KnownScan, Pair, ProjectedPoint, Relation};
use crate::blend::blocks::{self, Grid};
use crate::blend::levels::Voxels;
use crate::blend::{agree, field, fill, sites};
use crate::contour::holes::{self, Filled, Left, Limits};
use crate::contour::{Facing, cavities, clean, components, fragments, quads, smooth, surface::Surface};
use crate::crease;
use crate::error::{Error, Result};
use crate::handles;
use crate::noise::NoiseModel;
use crate::numeric::vec3::Vec3;
use crate::orient;
use crate::rim::{self, unseen::Scale};
use crate::run::{Context, Stage};
use crate::simplify::Goal;
use crate::solid::{self, Solid};
use crate::spatial::spacing::Sampling;

/// What was built. Lengths are in the normalised frame.
pub(super) struct Built {
    /// The surface.
    pub surface: Surface,
    /// Unit normals per corner of its triangles, where it has creases.
    pub corner_normals: Option<Vec<[[f32; 3]; 3]>>,
    /// For each of its vertices, whether it was invented to close the surface; only of a solid.
    pub extrapolated: Option<Vec<bool>>,
    /// The charts, facing as the surface does.
    pub charts: Vec<Chart>,
    /// The scan's points on the charts, facing as the surface does.
    pub projected: Vec<ProjectedPoint>,
    /// Spacing of the scan's points.
    pub sampling: Sampling,
    /// Side of the finest voxels.
    pub voxel: f64,
    /// Parts of the surface that were left out, and the points on them.
    pub left_out: LeftOut,
    /// Holes that were filled.
    pub filled_holes: usize,
    /// Whether some part of the surface is one-sided.
    pub one_sided: bool,
    /// How far the surface may be simplified yet; only of a tile.
    pub goal: Option<Goal>,
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
    let Scan { points, tree, sampling, frame, noise, relative_noise, mut input, told, rows, .. } = scan;
    let OrientedAtlas { fitted, members, relations, opposing, mut conflicts, votes, mut projected, .. } =
        atlas;
    let median = sampling.median;
    ctx.stage(Stage::Project, 2);
    let sigma = noise.for_charts();
    let voxels = voxels::of(&sampling, sigma, options.detail, told.as_ref());
    let voxel = voxels.finest;
    // What lies so far away that its voxels have no name is set aside.
    for p in projected.iter_mut().filter(|p| !blocks::within_range(p.position, voxel)) {
        p.chart = u32::MAX;
    }
    ctx.advance(1);
    let spread = sites::Spread { sampling: &sampling, sigma, names: &rows };
    let sites = sites::of_points(&points, &projected, &fitted, &members, spread, ctx)?;
    ctx.advance(1);

    // Contouring needs the most memory: what is done with goes first.
    drop(tree);
    drop((rows, members));
    let mut charts: Vec<Chart> = fitted.into_iter().map(|f| f.chart).collect();
    let contour = quads::contour(distance(&charts, sites, &relations, &conflicts, voxels, ctx)?, ctx)?;
    let facing = Facing { one_sided: !conflicts.is_empty(), votes: &votes, opposing: &opposing };
    let mut surface = clean::clean(contour, &charts, &facing, speck(median, voxel), ctx)?;
    let mut left_out = leave_out(&mut surface, &mut conflicts, &projected, charts.len(), options, ctx)?;
    let asked = options.fill_holes / frame.scale;
    let (mut filled_holes, left) = close_gaps(&mut surface, &charts, &projected, &sampling, asked, ctx)?;
    if votes.is_empty() {
        cavities::turn_closed(&mut surface, ctx)?;
    }
    not_empty(&surface)?;
    input.warnings.extend(warnings::holes_left(options.fill_holes, &left, frame.scale));
    face_surface(&mut charts, &mut projected, &relations, &surface, ctx)?;
    let known = known(&points, &sampling, noise, &relative_noise, &charts, frame);
    rim::settle(&mut surface, &projected, &known.scan, ctx)?;
    // Without what holds no data, what held together by it is apart.
    left_out.add(leave_out(&mut surface, &mut conflicts, &projected, charts.len(), options, ctx)?);
    not_empty(&surface)?;
    if told.is_none() {
        filled_holes += mend_whole(&mut surface, &projected, &known, voxel, ctx)?;
    }
    let creases = crease::sharpen(&mut surface, &mut projected, &known.scan, ctx)?;
    let mut goal = None;
    if told.is_some() {
        goal = Some(lighten::goal(&surface, &projected, options, &known, ctx)?);
    } else {
        input.warnings.extend(lighten::lighten(&mut surface, &projected, options, &known, ctx)?);
    }
    input.warnings.extend(warnings::many_faces(surface.triangles.len(), points.len()));
    let one_sided = !conflicts.is_empty();
    let mut extrapolated = None;
    if options.watertight {
        let solid: Solid = solid::close(surface, voxel, ctx)?;
        input.warnings.extend(warnings::plates(&solid, one_sided, frame.scale));
        (surface, extrapolated) = (solid.surface, Some(solid.extrapolated));
    }
    let corner_normals = creases.map(|c| c.corner_normals(&surface, ctx)).transpose()?.flatten();
    Ok(Built {
        surface,
        corner_normals,
        extrapolated,
        charts,
        projected,
        sampling,
        voxel,
        left_out,
        filled_holes,
        one_sided,
        goal,
        frame,
        input,
    })
}

/// The signed distance that is contoured: what the charts say, gaps filled, the same for voxels of all
/// sizes.
pub(super) fn distance<'c>(
    charts: &'c [Chart],
    sites: Vec<BlendSite>,
    relations: &[Relation],
    conflicts: &[Pair],
    voxels: Voxels,
    ctx: &Context<'_>,
) -> Result<Grid<'c>> {
    let mut grid = field::sample(charts, sites, relations, conflicts, voxels, ctx)?;
    fill::fill(&mut grid, ctx)?;
    agree::agree(&mut grid, ctx)?;
    Ok(grid)
}

/// Closes gaps of the sampling, and holes with a boundary up to `asked` long. Returns how many, and what
/// stays open.
fn close_gaps(
    surface: &mut Surface,
    charts: &[Chart],
    projected: &[ProjectedPoint],
    sampling: &Sampling,
    asked: f64,
    ctx: &Context<'_>,
) -> Result<(usize, Left)> {
    let gap = PIPELINE.gap * sampling.median;
    let sparse = &sparsity(projected, sampling, charts.len());
    let slit = PIPELINE.slit * sampling.median;
    let limits = Limits { longest: gap.max(asked), plain: gap, sparse, slit };
    let Filled { holes, touched, left } = holes::fill(surface, limits, ctx)?;
    smooth::smooth(surface, charts, touched, ctx)?;
    Ok((holes, left))
}

/// How many times the median spacing the points of each chart lie apart in the mean, at least one.
fn sparsity(projected: &[ProjectedPoint], sampling: &Sampling, charts: usize) -> Vec<f64> {
    let spacing = chart_means(projected, charts, |i| sampling.carried(i));
    spacing.into_iter().map(|s| s.map_or(1.0, |s| (s / sampling.median).max(1.0))).collect()
}

/// What is known of the surface's place.
fn known<'a>(
    points: &'a [Vec3],
    sampling: &'a Sampling,
    noise: NoiseModel,
    relative_noise: &'a [f32],
    charts: &'a [Chart],
    frame: Frame,
) -> Known<'a> {
    let (spacing, for_charts) = (sampling.spacing.as_slice(), noise.for_charts());
    Known {
        scan: KnownScan { points, spacing, noise: for_charts, relative_noise, charts },
        median_spacing: sampling.median,
        noise: noise.sigma,
        scale: frame.scale,
    }
}

/// Takes parts that hardly any point carries out of the surface, and those that are not wanted.
fn leave_out(
    surface: &mut Surface,
    conflicts: &mut Vec<(u32, u32)>,
    projected: &[ProjectedPoint],
    charts: usize,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<LeftOut> {
    let own = points_of_charts(projected, charts);
    components::remove_unsupported(surface, &own, PIPELINE.unsupported, ctx)?;
    let left_out = parts::leave_out(surface, projected, charts, options, ctx)?;
    if left_out.parts > 0 {
        let on = parts::touched(&surface.chart, charts);
        conflicts.retain(|&(a, b)| on[a as usize] && on[b as usize]);
    }
    Ok(left_out)
}

/// Mends what only a whole scan tells, no tile: takes out fragments of sweeps, fills holes that nobody looked
/// into, cuts handles. Returns how many holes were filled.
fn mend_whole(
    surface: &mut Surface,
    projected: &[ProjectedPoint],
    known: &Known<'_>,
    voxel: f64,
    ctx: &Context<'_>,
) -> Result<usize> {
    let median = known.median_spacing;
    fragments::remove(surface, projected, median, ctx)?;
    let scale = Scale { gap: PIPELINE.gap, unit: median.max(voxel) };
    let filled = rim::unseen::fill(surface, projected, scale, ctx)?;
    handles::cut(surface, projected, &known.scan, ctx)?;
    Ok(filled)
}

/// Fails where there is no surface.
fn not_empty(surface: &Surface) -> Result<()> {
    if surface.triangles.is_empty() {
        return Err(Error::degenerate(
            "the charts make no connected surface",
            "Give a denser scan, set the noise by hand, or lower the detail",
        ));
    }
    Ok(())
}

/// Triangles of the largest speck.
fn speck(median: f64, voxel: f64) -> usize {
    (PIPELINE.speck * (PIPELINE.voxel * median / voxel).powi(2)).max(PIPELINE.least_speck) as usize
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

/// Turns charts and points to the side that the surface faces.
fn face_surface(
    charts: &mut [Chart],
    projected: &mut [ProjectedPoint],
    relations: &[Relation],
    surface: &Surface,
    ctx: &Context<'_>,
) -> Result<()> {
    let side = agreement(surface, charts, ctx)?;
    let turned = orient::face(charts, relations, &side);
    for p in projected {
        if turned.get(p.chart as usize).is_some_and(|t| *t) {
            p.normal = -p.normal;
        }
    }
    Ok(())
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
