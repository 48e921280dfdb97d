//! What a tile of a scan must know of the whole, so that it is computed as the whole would be.
//!
//! In: windows of the scan with all points in them, and positions spread over all of it. Out: frame, spacing,
//! noise, side of the voxels: a [`Survey`].

use super::checks;
use super::fit_atlas;
use super::options::{self, DenoiseOptions};
use super::prepare;
use super::voxels;
pub use super::whole::Survey;
use crate::error::Result;
use crate::numeric::vec3;
use crate::partition::PatchSize;
use crate::run::{Context, Run};

/// Looks at a sample of a scan of `points` points. `windows` holds all points of some parts of it, or the
/// whole; `spread` any sample of the whole, for its extent.
///
/// # Errors
/// As [`super::denoise`].
pub fn survey(
    windows: &[[f64; 3]],
    spread: &[[f64; 3]],
    points: usize,
    options: &DenoiseOptions,
    run: &mut Run<'_>,
) -> Result<Survey> {
    options::validate(options)?;
    run.execute(|ctx| surveyed(windows, spread, points, options, ctx))
}

fn surveyed(
    windows: &[[f64; 3]],
    spread: &[[f64; 3]],
    points: usize,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<Survey> {
    let whole = prepare::distinct(vec3::of(spread), ctx)?;
    checks::any(&whole.points, spread.len(), whole.not_finite)?;
    let frame = prepare::frame(&whole.points, spread.len() - whole.not_finite, ctx)?;
    drop(whole);
    let known = Survey {
        origin: frame.origin.0,
        scale: frame.scale,
        spacing: 0.0,
        lonely: f64::INFINITY,
        tube_noise: 0.0,
        noise: 0.0,
        voxel: 0.0,
        points,
    };
    let distinct = prepare::distinct(vec3::of(windows), ctx)?;
    let sampled = prepare::sampled_in(distinct, options.noise, Some(frame), None, ctx)?;
    let lonely = sampled.lonely;
    let mut scan = prepare::with_noise(sampled, options.noise, None, ctx)?;
    scan.whole = points;
    let size = PatchSize::default();
    let tubes = fit_atlas::find_tubes(&mut scan, size, ctx)?;
    let tube_noise = scan.noise.sigma;
    fit_atlas::learn_noise(&mut scan, size, &tubes, ctx)?;
    let (spacing, noise) = (scan.sampling.median, scan.noise.sigma);
    let voxel = voxels::even(&scan.sampling, scan.noise.for_charts());
    Ok(Survey { spacing, lonely, tube_noise, noise, voxel, ..known })
}
