//! What a tile of a scan must know of the whole, so that it is computed as the whole would be.
//!
//! In: windows of the scan with all points in them, and positions spread over all of it. Out: frame, spacing,
//! noise, side of the voxels: a [`Survey`].

use super::fit_atlas;
use super::options::{self, DenoiseOptions};
use super::prepare::{self, Frame};
use super::surface;
use crate::error::Result;
use crate::numeric::vec3::{self, Vec3};
use crate::partition::PatchSize;
use crate::run::{Context, Run};

/// What is known of a whole scan. Lengths are in the normalised frame, unless another unit is named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// Origin of the frame, in the user's.
    pub origin: [f64; 3],
    /// Length of the frame's unit, in the user's.
    pub scale: f64,
    /// Median spacing of the points.
    pub spacing: f64,
    /// A point farther than this from its neighbours is stray.
    pub lonely: f64,
    /// Standard deviation of the noise that tubes are looked for with.
    pub tube_noise: f64,
    /// Standard deviation of the noise that charts are fitted with.
    pub noise: f64,
    /// Side of a voxel at a detail of 1.
    pub voxel: f64,
    /// Points of the whole scan.
    pub points: usize,
}

impl Survey {
    pub(super) fn frame(&self) -> Frame {
        Frame { origin: Vec3(self.origin), scale: self.scale }
    }

    /// A place of the normalised frame in the user's.
    #[must_use]
    pub fn to_user(&self, p: [f64; 3]) -> [f64; 3] {
        self.frame().to_user(Vec3(p)).0
    }

    /// A place of the user's frame in the normalised one.
    #[must_use]
    pub fn to_frame(&self, p: [f64; 3]) -> [f64; 3] {
        (Vec3(p) - Vec3(self.origin)).map(|x| x / self.scale).0
    }

    /// How far decisions about the charts of a place reach, in the user's unit: a tile is computed with the
    /// points about it up to this distance. Seeds keep their distance from each other, patches take points
    /// up to their radius, charts near another sheet are cut again: this many radii leave a tile's own part
    /// alone. Source: measured, docs/scale.md.
    #[must_use]
    pub fn halo(&self) -> f64 {
        const RADII: f64 = 8.0;
        RADII * PatchSize::default().reach(self.spacing, self.noise) * self.scale
    }
}

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
    prepare::check_any(&whole.points, spread.len(), whole.not_finite)?;
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
    let voxel = surface::voxel(&scan.sampling);
    let size = PatchSize::default();
    let tubes = fit_atlas::find_tubes(&mut scan, size, ctx)?;
    let tube_noise = scan.noise.sigma;
    fit_atlas::learn_noise(&mut scan, size, &tubes, ctx)?;
    let (spacing, noise) = (scan.sampling.median, scan.noise.sigma);
    Ok(Survey { spacing, lonely, tube_noise, noise, voxel, ..known })
}
