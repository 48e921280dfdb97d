//! The main job: a noisy scan in; denoised points, one stitched surface and chart UVs out.
//!
//! Flow: clean and normalise → neighbours, spacing, noise, outliers → (network prior) → patches → charts → orientation → projected points → (patches
//! near another sheet once more, from what the points now say) → surface → UVs → back to the user's frame. Every stage is a function of its own module; this file only joins them.

use crate::analyse::{self, Analysis};
use crate::atlas::Chart;
use crate::error::{Error, Result};
use crate::fit::{self, Fitted};
use crate::geometry::neighbours::{Neighbour, Neighbours};
use crate::geometry::vec3::{self, Vec3};
use crate::geometry::{Attribute, PointCloud, TriMesh};
use crate::measure;
use crate::orient::{self, Relation};
use crate::partition::{self, Cut, PATCH_SIZE, grow, tubes};
use crate::prior;
use crate::prior::explicit::{self, NetworkOptions};
use crate::prior::level_set::{self, LevelSetOptions};
use crate::project::{self, Membership, Projected};
use crate::run::{Context, Run, Stage};
use crate::scan::{self, Scan};
use crate::surface::{clean, field, holes};
use crate::unwrap::{self, UnwrapOptions};
use rayon::prelude::*;

/// Which prior the charts are fitted with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Prior {
    /// The Gaussian-process limit of the paper's networks.
    #[default]
    Gp,
    /// The paper's explicit networks, fully connected or convolutional. The scan is projected onto a few large network charts first; what is
    /// left of the noise is then taken for the scan's, and everything after that is the same as for the default.
    Network(NetworkOptions),
    /// The paper's level set of one network; the scan is projected onto it first, as with the explicit networks.
    LevelSet(LevelSetOptions),
}

/// What to do with points that no chart claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Outliers {
    /// They stay where they were among the denoised points.
    #[default]
    Keep,
    /// They are left out of the denoised points.
    Drop,
}

/// How to denoise. The defaults suit an ordinary scan.
#[derive(Debug, Clone, PartialEq)]
pub struct DenoiseOptions {
    /// Standard deviation of the noise in the scan's unit; `None` estimates it.
    pub noise: Option<f64>,
    /// Fineness of the surface: 1 = what the data supports, 0.5 = voxels twice as large. 0.1 to 10.
    pub detail: f64,
    /// Number of charts to aim for; `None` = as many as the shape needs.
    pub charts: Option<usize>,
    /// The prior.
    pub prior: Prior,
    /// Holes with a boundary shorter than this are filled, in the scan's unit; 0 fills only gaps of the sampling.
    pub fill_holes: f64,
    /// Side of the texture page in texels, for the padding between UV charts.
    pub texture_size: u32,
    /// What to do with outliers.
    pub outliers: Outliers,
    /// Whether to lay out UVs.
    pub uv: bool,
}

impl Default for DenoiseOptions {
    fn default() -> Self {
        Self {
            noise: None,
            detail: 1.0,
            charts: None,
            prior: Prior::Gp,
            fill_holes: 0.0,
            texture_size: 1024,
            outliers: Outliers::Keep,
            uv: true,
        }
    }
}

/// What was found and done.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// Points given.
    pub points: usize,
    /// Points with a coordinate that is not finite; they are left out.
    pub not_finite: usize,
    /// Points that repeat the position of an earlier one; they move with it.
    pub duplicates: usize,
    /// Points set aside because no chart claims them.
    pub outliers: usize,
    /// Median distance between neighbouring points, in the scan's unit.
    pub spacing: f64,
    /// Noise (standard deviation along the normal), in the scan's unit; estimated or as given.
    pub noise: f64,
    /// Charts fitted.
    pub charts: usize,
    /// Whether some part of the surface is one-sided.
    pub one_sided: bool,
    /// Side of the voxels that the surface was contoured with, in the scan's unit.
    pub voxel: f64,
    /// Connected parts of the surface.
    pub parts: usize,
    /// Holes that were filled.
    pub filled_holes: usize,
    /// Boundary loops of the surface.
    pub boundary_loops: usize,
    /// Edges on the boundary.
    pub boundary_edges: usize,
    /// UV charts.
    pub uv_charts: usize,
    /// What the user should know, in words.
    pub warnings: Vec<String>,
    /// Seconds per stage.
    pub seconds: Vec<(Stage, f64)>,
}

/// A denoised scan.
#[derive(Debug, Clone)]
pub struct Denoised {
    /// Denoised points with normals and the scan's own attributes, in input order (points that are not finite stay as they were; outliers
    /// too unless they are dropped).
    pub points: PointCloud,
    /// For each denoised point, the input point it came from.
    pub point_source: Vec<u32>,
    /// For each denoised point, the chart that weighs most there; `u32::MAX` for points on no chart: outliers, and those that are not finite.
    pub point_chart: Vec<u32>,
    /// The stitched surface, with normals, UVs and the scan's attributes.
    pub surface: TriMesh,
    /// The charts, in the normalised frame.
    pub charts: Vec<Chart>,
    /// Origin of the normalised frame in the scan's.
    pub origin: Vec3,
    /// Length of the normalised frame's unit in the scan's.
    pub scale: f64,
    /// What was found and done.
    pub report: Report,
}

/// Voxels are this share of the point spacing: finer ones follow the surface no better, coarser ones begin to cost completeness; triangles are then about
/// four times as many as the points.
const VOXEL: f64 = 0.75;
/// Holes with a boundary up to this many point spacings long are gaps of the sampling and always filled: random points leave gaps about four
/// spacings wide.
const GAP: f64 = 16.0;
/// Slits up to this many spacings wide are closed: at the rim of a thin part its two sides end within a patch of each other.
const SLIT: f64 = 3.0;
/// Parts of the surface with fewer triangles are specks: those of about fifty points, at voxels of the usual size.
const SPECK: f64 = 180.0;
/// Whatever the voxels, fewer triangles are a speck.
const LEAST_SPECK: f64 = 8.0;
/// Voxels are at least this share of the root mean square of the spacing: where clumps set the median, voxels of its size would be many times as many
/// as the points.
const VOXEL_SPREAD: f64 = 0.2;
/// Parts of the surface on which fewer points lie are specks: where noise is larger than the spacing, a few strays make one of any size.
const UNSUPPORTED: f64 = 12.0;
/// A point alone covers a disk as wide as this many spacings.
const ALONE: f64 = 4.2;
/// Memory for one point until the surface is contoured: points, tree, neighbours, memberships, charts (measured).
const BYTES_PER_POINT: u64 = 700;
/// Memory for one triangle while UVs are laid out (measured).
const BYTES_PER_TRIANGLE: u64 = 250;
/// UV charts of the denoised surface may stretch this much at the 95th percentile.
const UV_STRETCH: f64 = 1.25;
/// Charts are cut and fitted as if there were noise of at least this share of the point spacing: what is smaller than that between the points is not
/// known anyway, and patches that had to explain a clean scan's every crease to the last digit would shrink to nothing there.
const LEAST_NOISE: f64 = 0.05;
/// Times that patches near another sheet are cut anew, with what the fit before says of which point belongs to which. The second time brings a third of what
/// the first brings, a third one a third of that.
const SIDED_ROUNDS: usize = 2;

/// Denoises a scan.
///
/// # Errors
/// [`Error::EmptyInput`] without a finite point, [`Error::Degenerate`] where the points are no surface (too few, all in one place or
/// on a line), [`Error::InvalidArgument`] for options out of range, and those of a cancelled or limited run.
pub fn denoise(cloud: &PointCloud, options: &DenoiseOptions, run: &mut Run<'_>) -> Result<Denoised> {
    validate(options)?;
    check_columns(cloud)?;
    run.execute(|ctx| denoise_in(cloud, options, ctx))
}

/// Every column has an entry per point.
fn check_columns(cloud: &PointCloud) -> Result<()> {
    let n = cloud.len();
    let normals = cloud.normals.iter().map(|c| ("normals".to_string(), c.len(), n));
    let colors = cloud.colors.iter().map(|c| ("colors".to_string(), c.len(), n));
    let others =
        cloud.attributes.iter().map(|a| (format!("attribute \"{}\"", a.name), a.values.len(), n * a.width));
    match normals.chain(colors).chain(others).find(|(_, have, want)| have != want) {
        Some((name, have, want)) => Err(Error::invalid(
            format!("{name}: {have} values for {n} points"),
            format!("Give {want} values, or leave the column out"),
        )),
        None => Ok(()),
    }
}

fn validate(o: &DenoiseOptions) -> Result<()> {
    if let Some(noise) = o.noise
        && !(noise > 0.0 && noise.is_finite())
    {
        return Err(Error::invalid(
            format!("noise is {noise}"),
            "Give a positive length, or none to estimate it",
        ));
    }
    if !(0.1..=10.0).contains(&o.detail) {
        return Err(Error::invalid(
            format!("detail is {}", o.detail),
            "Give 0.1 to 10; 1 is what the data supports",
        ));
    }
    if o.charts == Some(0) {
        return Err(Error::invalid("charts is 0", "Give at least 1, or none to choose from the data"));
    }
    if !(o.fill_holes >= 0.0 && o.fill_holes.is_finite()) {
        return Err(Error::invalid(format!("fill_holes is {}", o.fill_holes), "Give a length, 0 or more"));
    }
    if !(16..=65536).contains(&o.texture_size) {
        return Err(Error::invalid(format!("texture_size is {}", o.texture_size), "Give 16 to 65536 texels"));
    }
    match &o.prior {
        Prior::Gp => Ok(()),
        Prior::Network(how) => how.validate(),
        Prior::LevelSet(how) => how.validate(),
    }
}

fn denoise_in(cloud: &PointCloud, options: &DenoiseOptions, ctx: &Context<'_>) -> Result<Denoised> {
    // Points, tree, neighbours, memberships and charts: measured.
    ctx.reserve(BYTES_PER_POINT * cloud.len() as u64)?;
    let scan = scan::analyse(scan::distinct(vec3::of(&cloud.positions), ctx)?, options.noise, ctx)?;
    let mut report = Report {
        points: cloud.len(),
        not_finite: scan.not_finite,
        duplicates: scan.duplicates,
        warnings: scan.warnings,
        ..Report::default()
    };
    let Scan {
        mut points,
        mut of_input,
        mut tree,
        mut spacing,
        mut median_spacing,
        noise,
        origin,
        scale,
        ..
    } = scan;
    let mut sigma = noise;
    let guide = match &options.prior {
        Prior::Gp => None,
        Prior::Network(how) => Some(explicit::fit(&points, how, ctx)?.surface()),
        Prior::LevelSet(how) => Some(level_set::fit(&points, noise, how, ctx)?),
    };
    if let Some(guide) = guide {
        drop(tree);
        ctx.stage(Stage::Project, points.len());
        let mut clean = prior::project(&guide, &points, ctx)?;
        // Where the networks have not followed the scan, it stays as it is: a limit as for any other chart and its points.
        let limit = (grow::TUKEY * noise).powi(2);
        for (c, p) in clean.iter_mut().zip(&points) {
            if (*c).dist2(*p) > limit {
                *c = *p;
            }
        }
        // Points beyond a chart's border meet at the border.
        let met = scan::distinct(&clean, ctx)?;
        points = met.points;
        for p in &mut of_input {
            *p = met.of_input.get(*p as usize).copied().unwrap_or(u32::MAX);
        }
        scan::check_surface(&points)?;
        ctx.stage(Stage::Analyse, points.len());
        tree = Neighbours::build(&points, ctx)?;
        spacing = analyse::spacing(&points, &tree, ctx)?;
        median_spacing = analyse::median_spacing(&spacing);
        sigma = analyse::noise(&points, &tree, ctx)?;
    }
    let least = LEAST_NOISE * median_spacing.max(1e-9);
    // Scans without any noise: rounding of the coordinates is the least there is.
    let noise = noise.max(1e-7 * median_spacing.max(1e-9));
    let mut analysis = Analysis { spacing, median_spacing, sigma: sigma.max(least) };

    let size = match options.charts {
        None => PATCH_SIZE,
        Some(charts) => PATCH_SIZE.for_count(charts, points.len()),
    };
    let tubes = tubes::find(&points, &tree, &analysis, options.noise.is_some(), ctx)?;
    if let Some(sigma) = tubes.sigma {
        analysis.sigma = sigma.max(least);
    }
    if options.noise.is_none() {
        fit::settle_noise(&points, &tree, &mut analysis, size, &tubes.covered, least, ctx)?;
    }
    let cut = Cut { points: &points, tree: &tree, analysis: &analysis, size };
    let patches = partition::partition(&cut, &tubes.covered, None, ctx)?;
    ctx.stage(Stage::Fit, patches.len());
    let mut fitted = fit::fit(&points, &patches, ctx)?;
    fitted.extend(tubes.fitted);
    if fitted.is_empty() {
        return Err(Error::degenerate(
            "no part of the points looks like a surface",
            "Give a denser scan, or set the noise by hand",
        ));
    }

    let mut seen = see(&points, &mut fitted, median_spacing, ctx)?;
    for _ in 0..SIDED_ROUNDS {
        let known = &seen.projected;
        let Some(covered) = partition::keep(&cut, &mut fitted, &tubes.covered, known, ctx)? else { break };
        let patches = partition::partition(&cut, &covered, Some(known), ctx)?;
        ctx.stage(Stage::Fit, patches.len());
        fitted.extend(fit::fit(&points, &patches, ctx)?);
        seen = see(&points, &mut fitted, median_spacing, ctx)?;
    }
    let Seen { members, relations, conflicts, mut projected } = seen;
    ctx.stage(Stage::Project, 2);
    let widest = ALONE * project::WIDEST * median_spacing;
    let spread = analysis.spacing.iter().map(|&s| f64::from(s).min(widest).powi(2));
    let spread = (spread.sum::<f64>() / points.len() as f64).sqrt();
    let voxel = (VOXEL * median_spacing).max(VOXEL_SPREAD * spread) / options.detail;
    // What lies so far away that its voxels have no name is set aside.
    for p in projected.iter_mut().filter(|p| !field::within_range(p.position, voxel)) {
        p.chart = u32::MAX;
    }
    ctx.advance(1);
    let anchors =
        project::anchors(&points, &projected, &fitted, &members, &analysis.spacing, median_spacing, ctx)?;
    ctx.advance(1);

    // Contouring needs the most memory: what is done with goes first.
    drop(tree);
    drop(members);
    let speck = (SPECK * (VOXEL * median_spacing / voxel).powi(2)).max(LEAST_SPECK) as usize;
    let mut charts: Vec<Chart> = fitted.into_iter().map(|f: Fitted| f.chart).collect();
    let contour = field::contour(&charts, anchors, &relations, &conflicts, voxel, ctx)?;
    let mut surface = clean::triangulate(contour, !conflicts.is_empty(), speck, ctx)?;
    let mut own = vec![0u32; charts.len()];
    for p in &projected {
        if let Some(n) = own.get_mut(p.chart as usize) {
            *n += 1;
        }
    }
    clean::remove_unsupported(&mut surface, &own, UNSUPPORTED, ctx)?;
    let longest = (GAP * median_spacing).max(options.fill_holes / scale);
    let (filled, touched) = holes::fill(&mut surface, longest, SLIT * median_spacing, ctx)?;
    report.filled_holes = filled;
    clean::smooth(&mut surface, touched, ctx)?;
    if surface.triangles.is_empty() {
        return Err(Error::degenerate(
            "the charts make no connected surface",
            "Give a denser scan, set the noise by hand, or lower the detail",
        ));
    }
    ctx.check()?;
    // The surface knows which side is out; the charts and the points follow it.
    let mut side = vec![0.0; charts.len()];
    for ((&p, &n), &c) in surface.positions.iter().zip(&surface.normals).zip(&surface.chart) {
        if let Some(chart) = charts.get(c as usize) {
            side[c as usize] += chart.sign * n.dot(chart.normal_over(p));
        }
    }
    let turned = orient::face(&mut charts, &relations, &side);
    for p in &mut projected {
        if turned.get(p.chart as usize).is_some_and(|t| *t) {
            p.normal = p.normal.map(|x| -x);
        }
    }

    ctx.check()?;
    // Attributes from the nearest denoised points.
    let sources: Vec<u32> = {
        let mut first = vec![u32::MAX; points.len()];
        for (input, &p) in of_input.iter().enumerate().rev() {
            if p != u32::MAX {
                first[p as usize] = input as u32;
            }
        }
        first
    };
    let mut mesh = TriMesh::new(vec3::plain(surface.positions), surface.triangles);
    mesh.normals = Some(surface.normals.iter().map(|n| n.to_f32()).collect());
    transfer(cloud, &projected, &sources, &mut mesh, ctx)?;

    if options.uv {
        let (own, faces) = (BYTES_PER_POINT / 3 * points.len() as u64, mesh.triangles.len() as u64);
        ctx.reserve(own + BYTES_PER_TRIANGLE * faces)?;
        let how = UnwrapOptions {
            max_stretch: UV_STRETCH,
            page_size: [options.texture_size; 2],
            ..UnwrapOptions::default()
        };
        let layout = unwrap::unwrap(&mesh, &how, ctx)?;
        report.uv_charts = layout.charts;
        mesh.corner_uv = Some(layout.corner_uv);
        mesh.face_chart = Some(layout.face_chart);
    }
    let topology = measure::topology(&mesh, ctx)?;
    let back = |p: Vec3| p * scale + origin;
    for p in &mut mesh.positions {
        *p = back(Vec3(*p)).0;
    }

    ctx.check()?;
    // Denoised points in input order.
    let mut out = cloud.clone();
    let mut normals = vec![[0f32; 3]; cloud.len()];
    let mut source: Vec<u32> = (0..cloud.len() as u32).collect();
    let mut orphan = vec![false; cloud.len()];
    let mut chart = vec![u32::MAX; cloud.len()];
    for (i, &p) in of_input.iter().enumerate() {
        if !cloud.positions[i].iter().all(|x| x.is_finite()) {
            continue;
        }
        match projected.get(p as usize) {
            Some(q) if q.chart != u32::MAX => {
                out.positions[i] = back(q.position).0;
                normals[i] = q.normal.to_f32();
                chart[i] = q.chart;
            }
            _ => {
                orphan[i] = true;
                report.outliers += 1;
                if let Some(n) = &cloud.normals {
                    normals[i] = n[i];
                }
            }
        }
    }
    out.normals = Some(normals);
    if options.outliers == Outliers::Drop {
        source.retain(|&i| !orphan[i as usize]);
        chart = source.iter().map(|&i| chart[i as usize]).collect();
        out = pick(&out, &source);
    }

    report.spacing = median_spacing * scale;
    // What the networks left is theirs, not the scan's.
    let scan_noise = match options.prior {
        Prior::Gp if analysis.sigma > least => analysis.sigma,
        Prior::Gp => noise.min(least),
        _ => noise,
    };
    report.noise = scan_noise * scale;
    report.charts = charts.len();
    report.one_sided = !conflicts.is_empty();
    report.voxel = voxel * scale;
    report.parts = topology.parts;
    report.boundary_loops = topology.boundary_loops;
    report.boundary_edges = topology.boundary_edges;
    report.seconds = ctx.stage_seconds();
    Ok(Denoised {
        points: out,
        point_source: source,
        point_chart: chart,
        surface: mesh,
        charts,
        origin,
        scale,
        report,
    })
}

/// What charts say of the points that they were fitted to.
struct Seen {
    members: Membership,
    relations: Vec<Relation>,
    conflicts: Vec<orient::Pair>,
    projected: Vec<Projected>,
}

/// Turns the charts so that they agree, and projects the points onto them.
fn see(points: &[Vec3], fitted: &mut [Fitted], spacing: f64, ctx: &Context<'_>) -> Result<Seen> {
    let members = project::membership(points.len(), fitted, ctx)?;
    let relations = orient::relations(points, fitted, &members, spacing, ctx)?;
    let walls = orient::walls(fitted, spacing, ctx)?;
    let (signs, conflicts) = orient::orient(fitted.len(), &relations, &walls, ctx)?;
    for (f, sign) in fitted.iter_mut().zip(&signs) {
        f.chart.sign = *sign;
    }
    let projected = project::project_members(points, fitted, &members, ctx)?;
    Ok(Seen { members, relations, conflicts, projected })
}

/// The points of `cloud` at `at`, with all their columns.
fn pick(cloud: &PointCloud, at: &[u32]) -> PointCloud {
    let take = |i: &u32| *i as usize;
    PointCloud {
        positions: at.iter().map(|i| cloud.positions[take(i)]).collect(),
        normals: cloud.normals.as_ref().map(|n| at.iter().map(|i| n[take(i)]).collect()),
        colors: cloud.colors.as_ref().map(|c| at.iter().map(|i| c[take(i)]).collect()),
        attributes: cloud
            .attributes
            .iter()
            .map(|a| Attribute {
                values: at
                    .iter()
                    .flat_map(|i| a.values[take(i) * a.width..(take(i) + 1) * a.width].iter().copied())
                    .collect(),
                ..a.clone()
            })
            .collect(),
    }
}

/// Points that an attribute of a vertex is averaged over.
const TRANSFER_K: usize = 4;

/// Carries colours and attributes from the denoised points to the mesh's vertices: averages over the nearest points by inverse squared
/// distance; whole numbers are labels and come from the nearest point alone.
fn transfer(
    cloud: &PointCloud,
    projected: &[Projected],
    sources: &[u32],
    mesh: &mut TriMesh,
    ctx: &Context<'_>,
) -> Result<()> {
    if cloud.colors.is_none() && cloud.attributes.is_empty() {
        return Ok(());
    }
    let (at, from): (Vec<Vec3>, Vec<u32>) = projected
        .iter()
        .zip(sources)
        .filter(|(p, _)| p.chart != u32::MAX)
        .map(|(p, &s)| (p.position, s))
        .unzip();
    let tree = Neighbours::build(&at, ctx)?;
    let weights: Vec<[(u32, f32); TRANSFER_K]> = mesh
        .positions
        .par_chunks(1024)
        .map(|chunk| {
            ctx.check()?;
            let mut found: Vec<Neighbour> = Vec::new();
            Ok(chunk
                .iter()
                .map(|p| {
                    tree.nearest(Vec3(*p), TRANSFER_K, &mut found);
                    let soft = found.first().map_or(0.0, |f| f.dist2) * 0.1 + 1e-18;
                    let total: f64 = found.iter().map(|f| 1.0 / (f.dist2 + soft)).sum();
                    let mut w = [(u32::MAX, 0f32); TRANSFER_K];
                    for (w, f) in w.iter_mut().zip(&found) {
                        *w = (from[f.index as usize], (1.0 / (f.dist2 + soft) / total) as f32);
                    }
                    w
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    debug_assert!(weights.iter().all(|w| w[0].0 != u32::MAX));
    let blend = |w: &[(u32, f32); TRANSFER_K], value: &dyn Fn(usize) -> f64| {
        w.iter().filter(|w| w.0 != u32::MAX).map(|&(i, w)| f64::from(w) * value(i as usize)).sum::<f64>()
    };
    if let Some(colors) = &cloud.colors {
        mesh.colors = Some(
            weights
                .iter()
                .map(|w| [0, 1, 2, 3].map(|k| blend(w, &|i| f64::from(colors[i][k])) as f32))
                .collect(),
        );
    }
    mesh.attributes = cloud
        .attributes
        .iter()
        .map(|a| Attribute {
            values: weights
                .iter()
                .flat_map(|w| {
                    (0..a.width).map(move |k| {
                        if a.kind.is_integer() {
                            a.values[w[0].0 as usize * a.width + k]
                        } else {
                            blend(w, &|i| a.values[i * a.width + k])
                        }
                    })
                })
                .collect(),
            ..a.clone()
        })
        .collect();
    Ok(())
}

#[cfg(test)]
mod tests;
