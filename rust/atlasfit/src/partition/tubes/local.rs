//! Noise that differs from tube to tube.
//!
//! In: fitted tubes, the noise of all. Out: the noise about each place, as a multiple of that. Each tube
//! knows its own noise well, and noise changes slowly: what a tube's neighbours do not see is no noise.

use super::constants::TUBES;
use super::radius::FittedTube;
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::run::Context;
use crate::spatial::Neighbours;

/// The noise about each tube.
pub(super) struct LocalNoise {
    /// The tubes' middles.
    centers: Neighbours,
    /// Multiples of the usual noise, one for each tube.
    relative: Vec<f64>,
}

impl LocalNoise {
    /// The noise at a place, as a multiple of the usual.
    pub fn relative(&self, place: Vec3) -> f64 {
        self.relative[self.centers.nearest_one(place).index as usize]
    }

    /// The same at each of the points.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn at(&self, points: &[Vec3], ctx: &Context<'_>) -> Result<Vec<f32>> {
        let tubes = self.centers.nearest_of(points, ctx)?;
        Ok(tubes.iter().map(|&t| self.relative[t as usize] as f32).collect())
    }
}

/// The noise about each tube; nothing where the `usual` noise explains all.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn local_noise(
    fits: &[Option<FittedTube>],
    usual: f64,
    ctx: &Context<'_>,
) -> Result<Option<LocalNoise>> {
    let (places, sigmas): (Vec<Vec3>, Vec<f64>) =
        fits.iter().flatten().map(|f| (f.center, f.fitted.chart.sigma)).unzip();
    if places.is_empty() {
        return Ok(None);
    }
    let centers = Neighbours::build(&places, ctx)?;
    let mut near = Vec::new();
    let about = |(k, &place): (usize, &Vec3)| {
        ctx.check_at(k)?;
        centers.nearest(place, TUBES.together, &mut near);
        Ok(median(&mut near.iter().map(|f| sigmas[f.index as usize]).collect::<Vec<_>>()) / usual)
    };
    let relative: Vec<f64> = places.iter().enumerate().map(about).collect::<Result<_>>()?;
    let explained = 1.0 / PARTITION.explained..=PARTITION.explained;
    let differs = !relative.iter().all(|r| explained.contains(r));
    Ok(differs.then_some(LocalNoise { centers, relative }))
}
