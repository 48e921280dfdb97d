//! The main job: a noisy scan in; denoised points, one surface and chart UVs out.
//!
//! Each step is a file: [`prepare`] (distinct points, spacing, noise) → [`guide`] (optional: a first surface
//! to project onto) → `facing` (which
//! way it is known to face) → `fit_atlas` (tubes, patches, charts) → `sheets` (which points lie on which sheet) →
//! `surface` (charts blended, contoured, cleaned) → `attributes` (colours and the like, UVs) → `finish` (back
//! to the user's frame, report).

mod attributes;
mod facing;
mod finish;
mod fit_atlas;
pub mod guide;
mod options;
pub mod prepare;
mod report;
mod sheets;
mod surface;

pub use guide::Guide;
pub use options::{DenoiseOptions, Outliers};
pub use report::{Denoised, Report};

use crate::error::Result;
use crate::geometry::PointCloud;
use crate::numeric::vec3;
use crate::run::{Context, Run};

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
pub fn denoise_guided(
    cloud: &PointCloud,
    options: &DenoiseOptions,
    guide: Option<&dyn Guide>,
    run: &mut Run<'_>,
) -> Result<Denoised> {
    options::validate(options)?;
    options::check_columns(cloud)?;
    if let Some(guide) = guide {
        guide.validate()?;
    }
    run.execute(|ctx| denoise_in(cloud, options, guide, ctx))
}

fn denoise_in(
    cloud: &PointCloud,
    options: &DenoiseOptions,
    guide: Option<&dyn Guide>,
    ctx: &Context<'_>,
) -> Result<Denoised> {
    ctx.reserve(prepare::BYTES_PER_POINT * cloud.len() as u64)?;
    let distinct = prepare::distinct(vec3::of(&cloud.positions), ctx)?;
    let mut scan = prepare::prepare(distinct, options.noise, ctx)?;
    let scan_noise = scan.noise;
    if let Some(guide) = guide {
        scan = guide::follow(guide, scan, ctx)?;
    }
    let toward = facing::given(cloud, options, &scan, ctx)?;
    let first = fit_atlas::fit_atlas(&mut scan, options.charts, ctx)?;
    let atlas = sheets::separate(&scan, first, toward.as_deref(), ctx)?;
    let noise = finish::reported_noise(scan_noise, scan.noise, guide.is_some());
    let mut built = surface::build(scan, atlas, options, ctx)?;
    let mesh = attributes::mesh(cloud, &mut built, ctx)?;
    finish::finish(cloud, built, mesh, noise, options, ctx)
}

#[cfg(test)]
mod tests;
