//! The main job: a noisy scan in; denoised points, one stitched surface and chart UVs out.
//!
//! Flow: clean and normalise → neighbours, spacing, noise, outliers → (network prior) → patches → charts → projected points → orientation →
//! surface → UVs → back to the user's frame. Every stage is a function of its own module; this file only joins them.

use crate::analyse::{self, Analysis};
use crate::atlas::Chart;
use crate::error::{Error, Result};
use crate::fit::{self, Fitted};
use crate::geometry::neighbours::{Neighbour, Neighbours};
use crate::geometry::vec3::{Vec3, dist2, sub};
use crate::geometry::{Attribute, PointCloud, TriMesh};
use crate::measure;
use crate::orient;
use crate::partition::{self, PATCH_SIZE, grow};
use crate::prior;
use crate::prior::explicit::{self, NetworkOptions};
use crate::prior::level_set::{self, LevelSetOptions};
use crate::project::{self, Projected};
use crate::run::{Context, Run, Stage};
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
/// Parts of the surface with fewer triangles, those of about fifty points, are specks.
const SPECK: usize = 180;
/// The least number of distinct points that make a surface.
const MIN_POINTS: usize = 12;
/// UV charts of the denoised surface may stretch this much at the 95th percentile.
const UV_STRETCH: f64 = 1.25;
/// Times the noise may be corrected by the fit.
const NOISE_ROUNDS: usize = 3;
/// The noise is settled when the charts see at least this share of it.
const NOISE_SETTLED: f64 = 0.85;
/// The share of the charts that see the noise truly even where others hold two sheets unseen, and how far below the median that quantile lies where
/// all see it truly.
const SEEN: (f64, f64) = (0.3, 1.05);
/// Points whose neighbours are this many times farther than their neighbours' neighbours are stray.
const STRAY: f64 = 4.0;

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
    match &o.prior {
        Prior::Gp => Ok(()),
        Prior::Network(how) => how.validate(),
        Prior::LevelSet(how) => how.validate(),
    }
}

/// Distinct finite points in the normalised frame.
struct Prepared {
    points: Vec<Vec3>,
    /// For each input point its prepared point; `u32::MAX` where it is not finite.
    of_input: Vec<u32>,
    origin: Vec3,
    scale: f64,
    not_finite: usize,
    duplicates: usize,
}

fn prepare(cloud: &PointCloud) -> Result<Prepared> {
    let n = cloud.len();
    if n == 0 {
        return Err(Error::empty(
            "the scan has no points",
            "Give a file with at least a few hundred points on a surface",
        ));
    }
    let finite = |p: &Vec3| p.iter().all(|x| x.is_finite());
    let count = cloud.positions.iter().filter(|p| finite(p)).count();
    if count == 0 {
        return Err(Error::empty(
            format!("none of the {n} points has finite coordinates"),
            "Check the file's columns and units",
        ));
    }
    // Box and centre from quantiles: one stray point far away must not squeeze the rest into rounding noise.
    let quantile = |axis: usize| {
        let mut v: Vec<f64> = cloud.positions.iter().filter(|p| finite(p)).map(|p| p[axis]).collect();
        let lo = (count as f64 * 0.005) as usize;
        let low = *v.select_nth_unstable_by(lo, f64::total_cmp).1;
        let high = *v.select_nth_unstable_by(count - 1 - lo, f64::total_cmp).1;
        (low, high)
    };
    let range = [quantile(0), quantile(1), quantile(2)];
    let origin = range.map(|(a, b)| a + (b - a) * 0.5);
    let scale = range.iter().map(|(a, b)| b - a).fold(0.0, f64::max);
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(Error::Degenerate {
            what: format!("all {count} points lie in one place"),
            advice: "Give points that lie on a surface".into(),
        });
    }
    let normalised: Vec<Vec3> = cloud.positions.iter().map(|p| sub(*p, origin).map(|x| x / scale)).collect();
    let (points, of_input) = distinct(&normalised);
    let finite_now = of_input.iter().filter(|&&i| i != u32::MAX).count();
    Ok(Prepared {
        duplicates: finite_now - points.len(),
        not_finite: n - finite_now,
        points,
        of_input,
        origin,
        scale,
    })
}

/// Points with equal positions become one; points that are not finite are left out. Gives the distinct points in the order of their first
/// appearance, and for each given point its distinct one (`u32::MAX` where it is left out).
fn distinct(given: &[Vec3]) -> (Vec<Vec3>, Vec<u32>) {
    let n = given.len();
    // Sorting by bits is exact and fast.
    let mut order: Vec<u32> =
        (0..n as u32).filter(|&i| given[i as usize].iter().all(|x| x.is_finite())).collect();
    let bits = |i: u32| given[i as usize].map(|x| (x + 0.0).to_bits());
    order.par_sort_unstable_by_key(|&i| (bits(i), i));
    let mut first = vec![u32::MAX; n];
    for group in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        for &i in group {
            first[i as usize] = group[0];
        }
    }
    let mut place = vec![u32::MAX; n];
    let mut points = Vec::new();
    for i in 0..n {
        let f = first[i];
        if f == i as u32 {
            place[i] = points.len() as u32;
            points.push(given[i]);
        } else if f != u32::MAX {
            // The first of equal points has the least index, so it has its place already.
            place[i] = place[f as usize];
        }
    }
    (points, place)
}

/// Fails on points that span no surface: too few, or all on a line.
fn check_surface(points: &[Vec3]) -> Result<()> {
    let degenerate = |what: String| {
        Err(Error::Degenerate {
            what,
            advice: "Give points that lie on a surface, a few hundred at least".into(),
        })
    };
    if points.len() < MIN_POINTS {
        return degenerate(format!("only {} distinct points", points.len()));
    }
    let n = points.len() as f64;
    let mean = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let mut m = [0.0; 6];
    for p in points {
        let d = sub(*p, mean);
        for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            m[k] += d[i] * d[j] / n;
        }
    }
    let (values, _) = crate::geometry::dense::eigen3(m);
    if values[1] <= 1e-14 * values[2] {
        return degenerate("the points lie on a line".into());
    }
    Ok(())
}

/// Points that are much lonelier than the points around them.
fn stray(points: &[Vec3], tree: &Neighbours, spacing: &[f32], ctx: &Context<'_>) -> Result<Vec<bool>> {
    // Strays near each other vouch for each other: they are measured against the sparsest tenth of the scan too.
    let mut all = spacing.to_vec();
    let at = all.len() * 9 / 10;
    let lonely = project::WIDEST * f64::from(*all.select_nth_unstable_by(at, f32::total_cmp).1);
    points
        .par_chunks(1024)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            let mut found = Vec::new();
            Ok(chunk
                .iter()
                .enumerate()
                .map(|(k, p)| {
                    let own = f64::from(spacing[c * 1024 + k]);
                    tree.nearest(*p, 9, &mut found);
                    let mut around: Vec<f64> =
                        found.iter().skip(1).map(|f| f64::from(spacing[f.index as usize])).collect();
                    own > lonely || own > STRAY * analyse::median(&mut around)
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()
        .map(|v| v.concat())
}

fn denoise_in(cloud: &PointCloud, options: &DenoiseOptions, ctx: &Context<'_>) -> Result<Denoised> {
    let prepared = prepare(cloud)?;
    // Points, tree, neighbours, memberships and charts, and the contour's blocks: measured at about 900 bytes a point.
    ctx.reserve(900 * prepared.points.len() as u64)?;
    let mut report = Report {
        points: cloud.len(),
        not_finite: prepared.not_finite,
        duplicates: prepared.duplicates,
        ..Report::default()
    };

    ctx.stage(Stage::Analyse, 2 * prepared.points.len());
    // Stray points are taken out once; the rest is then a scan of its own.
    let tree = Neighbours::build(&prepared.points)?;
    let spacing = analyse::spacing(&prepared.points, &tree, ctx)?;
    let lonely = stray(&prepared.points, &tree, &spacing, ctx)?;
    drop(tree);
    let mut of_prepared = vec![u32::MAX; prepared.points.len()];
    let mut points = Vec::with_capacity(prepared.points.len());
    let mut kept_spacing = Vec::with_capacity(prepared.points.len());
    for (i, p) in prepared.points.iter().enumerate() {
        if !lonely[i] {
            of_prepared[i] = points.len() as u32;
            points.push(*p);
            kept_spacing.push(spacing[i]);
        }
    }
    check_surface(&points)?;
    let mut tree = Neighbours::build(&points)?;
    let noise = match options.noise {
        Some(noise) => noise / prepared.scale,
        None => {
            let median = analyse::median(&mut kept_spacing.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
            let first = analyse::noise(&points, &tree, ctx)?;
            partition::check_noise(&points, &tree, &kept_spacing, median, first, ctx)?
        }
    };
    let mut sigma = noise;
    let mut spacing = kept_spacing;
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
            if dist2(*c, *p) > limit {
                *c = *p;
            }
        }
        // Points beyond a chart's border meet at the border.
        let place;
        (points, place) = distinct(&clean);
        for p in &mut of_prepared {
            *p = place.get(*p as usize).copied().unwrap_or(u32::MAX);
        }
        check_surface(&points)?;
        ctx.stage(Stage::Analyse, points.len());
        tree = Neighbours::build(&points)?;
        spacing = analyse::spacing(&points, &tree, ctx)?;
        sigma = analyse::noise(&points, &tree, ctx)?;
    }
    let median_spacing = analyse::median(&mut spacing.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
    // Scans without any noise: rounding of the coordinates is the least there is.
    let least = 1e-7 * median_spacing.max(1e-9);
    let (noise, sigma) = (noise.max(least), sigma.max(least));
    let analysis = Analysis { spacing, median_spacing, sigma };

    let size = match options.charts {
        None => PATCH_SIZE,
        Some(charts) => PATCH_SIZE.for_count(charts, points.len()),
    };
    let mut analysis = analysis;
    let mut fitted = Vec::new();
    for _ in 0..NOISE_ROUNDS {
        let patches = partition::partition(&points, &tree, &analysis, size, ctx)?;
        fitted = fit::fit(&points, &patches, analysis.sigma, ctx)?;
        // The charts know the noise better than the first estimate, which two sheets close together or strong curvature can
        // mislead upwards. Patches are then cut anew.
        let mut sigmas: Vec<f64> = fitted.iter().map(|f| f.chart.sigma).collect();
        let at = (SEEN.0 * sigmas.len() as f64) as usize;
        let seen = match sigmas.is_empty() {
            true => break,
            false => SEEN.1 * *sigmas.select_nth_unstable_by(at, f64::total_cmp).1,
        };
        if options.noise.is_some() || seen >= NOISE_SETTLED * analysis.sigma || seen <= least {
            break;
        }
        analysis.sigma = seen;
    }
    if fitted.is_empty() {
        return Err(Error::Degenerate {
            what: "no part of the points looks like a surface".into(),
            advice: "Give a denser scan, or set the noise by hand".into(),
        });
    }

    ctx.stage(Stage::Project, 3);
    let members = project::membership(points.len(), &fitted);
    let relations = orient::relations(&points, &fitted, &members);
    ctx.check()?;
    let (signs, conflicts) = orient::orient(fitted.len(), &relations);
    for (f, sign) in fitted.iter_mut().zip(&signs) {
        f.chart.sign = *sign;
    }
    ctx.advance(1);
    let projected = project::project_members(&points, &fitted, &members, ctx)?;
    ctx.advance(1);
    let anchors = project::anchors(&points, &projected, &fitted, &members, &analysis.spacing, median_spacing);
    ctx.advance(1);

    // Contouring needs the most memory: what is done with goes first.
    drop(tree);
    drop(members);
    let voxel = VOXEL * median_spacing / options.detail;
    let charts: Vec<Chart> = fitted.into_iter().map(|f: Fitted| f.chart).collect();
    let contour = field::contour(&charts, &anchors, &relations, &conflicts, voxel, ctx)?;
    let mut surface = clean::triangulate(contour, !conflicts.is_empty(), SPECK);
    let longest = (GAP * median_spacing).max(options.fill_holes / prepared.scale);
    report.filled_holes = holes::fill(&mut surface, longest, ctx)?;
    if surface.triangles.is_empty() {
        return Err(Error::Degenerate {
            what: "the charts make no connected surface".into(),
            advice: "Give a denser scan, set the noise by hand, or lower the detail".into(),
        });
    }

    // Attributes from the nearest denoised points.
    let sources: Vec<u32> = {
        let mut first = vec![u32::MAX; points.len()];
        for (input, &p) in prepared.of_input.iter().enumerate().rev() {
            if p != u32::MAX && of_prepared[p as usize] != u32::MAX {
                first[of_prepared[p as usize] as usize] = input as u32;
            }
        }
        first
    };
    let mut mesh = TriMesh::new(surface.positions.clone(), surface.triangles);
    mesh.normals = Some(surface.normals.iter().map(|n| n.map(|x| x as f32)).collect());
    transfer(cloud, &projected, &sources, &mut mesh, ctx)?;

    if options.uv {
        let how = UnwrapOptions {
            max_stretch: UV_STRETCH,
            page_size: options.texture_size,
            ..UnwrapOptions::default()
        };
        let layout = unwrap::unwrap(&mesh, &how, ctx)?;
        report.uv_charts = layout.charts;
        mesh.corner_uv = Some(layout.corner_uv);
        mesh.face_chart = Some(layout.face_chart);
    }
    let topology = measure::topology(&mesh, ctx)?;
    let back = |p: Vec3| [0, 1, 2].map(|k| p[k] * prepared.scale + prepared.origin[k]);
    for p in &mut mesh.positions {
        *p = back(*p);
    }

    // Denoised points in input order.
    let mut out = cloud.clone();
    let mut normals = vec![[0f32; 3]; cloud.len()];
    let mut source: Vec<u32> = (0..cloud.len() as u32).collect();
    let mut orphan = vec![false; cloud.len()];
    for (i, &p) in prepared.of_input.iter().enumerate() {
        let Some(&k) = of_prepared.get(p as usize) else { continue };
        match projected.get(k as usize) {
            Some(q) if q.chart != u32::MAX => {
                out.positions[i] = back(q.position);
                normals[i] = q.normal.map(|x| x as f32);
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
        out = pick(&out, &source);
    }

    report.spacing = median_spacing * prepared.scale;
    // What the networks left is theirs, not the scan's.
    let scan_noise = if options.prior == Prior::Gp { analysis.sigma } else { noise };
    report.noise = scan_noise * prepared.scale;
    report.charts = charts.len();
    report.one_sided = !conflicts.is_empty();
    report.voxel = voxel * prepared.scale;
    report.parts = topology.parts;
    report.boundary_loops = topology.boundary_loops;
    report.boundary_edges = topology.boundary_edges;
    report.seconds = ctx.stage_seconds();
    Ok(Denoised {
        points: out,
        point_source: source,
        surface: mesh,
        charts,
        origin: prepared.origin,
        scale: prepared.scale,
        report,
    })
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
    let tree = Neighbours::build(&at)?;
    let weights: Vec<[(u32, f32); TRANSFER_K]> = mesh
        .positions
        .par_chunks(1024)
        .map(|chunk| {
            ctx.check()?;
            let mut found: Vec<Neighbour> = Vec::new();
            Ok(chunk
                .iter()
                .map(|p| {
                    tree.nearest(*p, TRANSFER_K, &mut found);
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
