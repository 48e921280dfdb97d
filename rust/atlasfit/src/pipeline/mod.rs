//! The main job: a noisy scan in; denoised points, one surface and chart UVs out.
//!
//! Each step is a file: `sweeps` (moved together, if asked for) → [`prepare`] (distinct points, rows
//! averaged, spacing, noise) → [`guide`] (optional: a first surface to project onto) → `facing` (which way it
//! is known to face) → `fit_atlas` (tubes, patches, charts) → `sheets` (which points lie on which sheet) →
//! `strength` (charts smoother or rougher, if asked for) → `uncertainty` (how sure the points are, if asked
//! for) → `surface` (charts blended, contoured, cleaned; or `points_only`) → `attributes` (colours and the
//! like, UVs) → `finish` (back to the user's frame, outliers of a mesh after their neighbours: `follow`,
//! report).

mod attributes;
#[cfg(feature = "benchmarks")]
#[doc(hidden)]
pub mod benchmarks;
mod checks;
pub(crate) mod constants;
mod copies;
mod distinct;
mod facing;
mod finish;
mod fit_atlas;
mod follow;
pub mod guide;
mod lighten;
mod lonely;
mod memory;
mod options;
mod parts;
mod points_only;
pub mod prepare;
mod report;
mod rows;
mod sheets;
mod strength;
mod surface;
pub mod survey;
mod sweeps;
pub mod tile;
mod voxels;
mod warnings;
mod whole;

pub use crate::geometry::names::{EXTRAPOLATED, NOISE, OUTLIER_PROBABILITY, UNCERTAINTY};
pub use finish::uv_options;
pub use guide::Guide;
pub use memory::memory_needed;
pub use options::{DenoiseOptions, Outliers};
pub use report::{Denoised, Report};

use crate::error::Result;
use crate::geometry::PointCloud;
use crate::geometry::mesh::check_indices;
use crate::numeric::vec3::{self, Vec3};
use crate::run::{Context, Run, Stage};
use crate::uncertainty;

/// Denoises a scan.
///
/// ```
/// use atlasfit::geometry::PointCloud;
/// use atlasfit::{DenoiseOptions, Run, denoise};
/// // A sphere of radius 1 with noise of 0.02.
/// let mut rng = atlasfit::numeric::Rng::new(1);
/// let points = (0..2000).map(|_| {
///     let p = atlasfit::Vec3::from_fn(|_| rng.normal()).normalized();
///     (p * (1.0 + 0.02 * rng.normal())).0
/// });
/// let scan = PointCloud::from_positions(points.collect());
/// let result = denoise(&scan, &DenoiseOptions::default(), &mut Run::default())?;
/// assert_eq!((result.points.len(), result.report.parts), (2000, 1));
/// # Ok::<(), atlasfit::Error>(())
/// ```
///
/// # Errors
/// [`crate::Error::EmptyInput`] without a finite point, [`crate::Error::Degenerate`] where the points are no
/// surface (too few, all in one place or on a line), [`crate::Error::InvalidArgument`] for options out of
/// range, and those of a cancelled or limited run.
pub fn denoise(cloud: &PointCloud, options: &DenoiseOptions, run: &mut Run<'_>) -> Result<Denoised> {
    denoise_guided(cloud, options, None, run)
}

/// [`denoise`] with a guide, such as the paper's networks: the scan is projected onto the guide's surface
/// first.
///
/// # Errors
/// As [`denoise`], and those of the guide.
///
/// ```
/// use atlasfit::{DenoiseOptions, Run, geometry::PointCloud, pipeline::denoise_guided};
/// let ball = (0..500).map(|i| {
///     let (z, turn) = (1.0 - (f64::from(i) + 0.5) / 250.0, 2.4 * f64::from(i));
///     [(1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z]
/// });
/// let scan = PointCloud::from_positions(ball.collect());
/// let options = DenoiseOptions::default().with_uv(false);
/// let result = denoise_guided(&scan, &options, None, &mut Run::default())?;
/// assert_eq!(result.points.len(), 500);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn denoise_guided(
    cloud: &PointCloud,
    options: &DenoiseOptions,
    guide: Option<&dyn Guide>,
    run: &mut Run<'_>,
) -> Result<Denoised> {
    denoise_vertices(cloud, &[], options, guide, run)
}

/// [`denoise_guided`] for the vertices of a mesh, which keeps its faces: outliers that are kept follow the
/// surface between their neighbours, so that no spike stays. Each goes to the mean of its neighbours in the
/// mesh; where these are outliers too, all of them go to where a membrane between the vertices on the surface
/// has them. Outliers that no such vertex holds stay where they are; [`Report::followed_outliers`] says how
/// many do not. `point_chart` names them all as before.
///
/// ```
/// use atlasfit::{DenoiseOptions, Run, geometry::PointCloud, pipeline::denoise_vertices};
/// // A bumpy sheet of 40 x 40 vertices with steps of 1, and a spike.
/// let mut rng = atlasfit::numeric::Rng::new(1);
/// let at = |i: u32| [f64::from(i % 40), f64::from(i / 40), 0.05 * rng.normal()];
/// let mut mesh = PointCloud::from_positions((0..1600).map(at).collect());
/// mesh.positions[820][2] = 12.0;
/// let corners = (0..39 * 39).map(|i| i / 39 * 40 + i % 39);
/// let triangles: Vec<_> = corners.flat_map(|a| [[a, a + 1, a + 41], [a, a + 41, a + 40]]).collect();
/// let options = DenoiseOptions::default().with_uv(false);
/// let result = denoise_vertices(&mesh, &triangles, &options, None, &mut Run::default())?;
/// assert_eq!((result.report.outliers, result.report.followed_outliers), (1, 1));
/// assert!(result.points.positions[820][2] < 0.5);
/// # Ok::<(), atlasfit::Error>(())
/// ```
///
/// # Errors
/// As [`denoise_guided`], and [`crate::Error::IndexOutOfRange`] for a triangle that names no point.
pub fn denoise_vertices(
    cloud: &PointCloud,
    triangles: &[[u32; 3]],
    options: &DenoiseOptions,
    guide: Option<&dyn Guide>,
    run: &mut Run<'_>,
) -> Result<Denoised> {
    options::validate(options)?;
    options::check_columns(cloud)?;
    check_indices(triangles, cloud.len(), "points")?;
    if let Some(guide) = guide {
        guide.validate()?;
    }
    let mut denoised = run.execute(|ctx| denoise_in(cloud, triangles, options, guide, ctx))?;
    denoised.report.warnings.extend(run.threads_warning());
    Ok(denoised)
}

/// Unit normals of a scan's points as [`denoise`] finds and turns them: outward where there is an outside.
/// Those of outliers are 0. For guides that must know a side, and to register sweeps.
///
/// # Errors
/// As [`denoise`].
pub fn oriented_normals(points: &[Vec3], ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let cloud = PointCloud::from_positions(vec3::plain(points.to_vec()));
    let options = DenoiseOptions::default().with_surface(false);
    let normals = denoise_in(&cloud, &[], &options, None, ctx)?.points.normals;
    Ok(normals.into_iter().flatten().map(|n| Vec3(n.map(f64::from))).collect())
}

/// The stages to come and their shares of the time, for the overall progress. In per cent, measured with
/// `atlasfit denoise` on four real scans (12,000 to 88,000 points); a guide's network takes
/// nearly all of the time (`--prior mlp`, 5,000 points).
fn plan(guided: bool, options: &DenoiseOptions) -> Vec<(Stage, f64)> {
    let mut plan = vec![(Stage::Analyse, 8.0)];
    if options.sweeps.is_some() {
        plan.insert(0, (Stage::Prepare, 20.0));
    }
    if guided {
        plan.extend([(Stage::Fit, 900.0), (Stage::Project, 3.0), (Stage::Analyse, 3.0)]);
    }
    plan.extend([(Stage::Partition, 8.0), (Stage::Fit, 32.0), (Stage::Project, 0.5)]);
    if options.surface {
        plan.push((Stage::Surface, 44.0));
    }
    if options.lays_out_uv() {
        plan.extend([(Stage::Segment, 1.5), (Stage::Parametrize, 4.0), (Stage::Pack, 2.0)]);
    }
    plan
}

fn denoise_in(
    cloud: &PointCloud,
    triangles: &[[u32; 3]],
    options: &DenoiseOptions,
    guide: Option<&dyn Guide>,
    ctx: &Context<'_>,
) -> Result<Denoised> {
    ctx.plan(&plan(guide.is_some(), options));
    // What the scan holds beside its positions is held all the time, all of it twice where sweeps are moved.
    let copy = if options.sweeps.is_some() { cloud.bytes() } else { 0 };
    let columns = cloud.bytes() - 24 * cloud.len() as u64 + size_of_val(triangles) as u64 + copy;
    memory::reserve(cloud.len(), columns, options, ctx)?;
    let normals = |points: &[Vec3]| oriented_normals(points, ctx);
    let (moved, registration) = sweeps::registered(cloud, options, &normals, ctx)?.unzip();
    let cloud = moved.as_ref().unwrap_or(cloud);
    let distinct = prepare::distinct(vec3::of(&cloud.positions), ctx)?;
    let sampled = prepare::sampled(distinct, options.noise, None, ctx)?;
    memory::reserve_sampled(&sampled, None, columns, options, ctx)?;
    let scan = prepare::with_noise(sampled, options.noise, None, ctx)?;
    let told = scan.input.warnings.clone();
    let given = finish::Given { cloud, triangles };
    let mut denoised =
        charted(given, scan, options, guide, ctx).map_err(|error| warnings::explained(error, &told))?;
    denoised.report.warnings.extend(warnings::not_registered(registration.as_ref()));
    denoised.report.registration = registration;
    Ok(denoised)
}

/// The stages once the scan is prepared.
fn charted(
    given: finish::Given<'_>,
    mut scan: prepare::Scan,
    options: &DenoiseOptions,
    guide: Option<&dyn Guide>,
    ctx: &Context<'_>,
) -> Result<Denoised> {
    let cloud = given.cloud;
    let scan_noise = scan.noise;
    if let Some(guide) = guide {
        scan = guide::follow(guide, scan, ctx)?;
    }
    let known = facing::given(cloud, options, &scan, ctx)?;
    let first = fit_atlas::fit_atlas(&mut scan, options.charts, ctx)?;
    let mut atlas = sheets::separate(&scan, first, known.as_ref(), ctx)?;
    scan.input.warnings.extend(atlas.warning.take());
    strength::apply(&scan, &mut atlas, options, guide.is_some(), ctx)?;
    let noise = finish::reported_noise(scan_noise, scan.noise, guide.is_some());
    let sure = match options.uncertainty {
        true => Some(uncertainty::of_points(&scan.points, &atlas.fitted, &atlas.projected, ctx)?),
        false => None,
    };
    let feet = rows::feet(cloud, &scan, &atlas, ctx)?;
    let build = if options.surface { surface::build } else { points_only::build };
    let mut built = build(scan, atlas, options, ctx)?;
    let mesh = attributes::mesh(cloud, &mut built, &feet, sure.as_ref(), ctx)?;
    finish::finish(given, built, mesh, finish::Told { noise, sure, feet }, options, ctx)
}

#[cfg(test)]
mod tests;
