//! The noise as a sample of fitted charts sees it.
//!
//! In: what patches are cut from, the noise so far. Out: the noise, lowered where charts clearly see less of
//! it; how much of theirs those of noisier places see.

use super::constants::NOISE;
use super::{NoiseModel, NoiseSource};
use crate::atlas::FittedChart;
use crate::error::Result;
use crate::fit::fit;
use crate::partition::{self, Cut};
use crate::run::Context;

/// What charts see of the noise.
pub(crate) struct Learned {
    /// The noise.
    pub noise: NoiseModel,
    /// What charts of noisier places see, as a share of what these were thought to have.
    pub noisier: f64,
}

/// Lowers the scan's noise to what a sample of charts sees of it, not below its floor: they know it better
/// than the first estimate, which two sheets close together or strong curvature can mislead upwards. `done`
/// are the points that have their charts already.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn from_charts(
    cut: &Cut<'_>,
    mut noise: NoiseModel,
    done: &[bool],
    ctx: &Context<'_>,
) -> Result<Learned> {
    let mut noisier = None;
    for _ in 0..NOISE.rounds {
        let sigma = noise.for_charts();
        if sigma <= noise.floor {
            break;
        }
        let sample = partition::sample(&Cut { sigma, ..*cut }, done, ctx)?;
        // In units of the usual noise. Where there is more of it, charts do not say what is usual.
        let relative = |f: &FittedChart| cut.relative_noise(f.members.first().map_or(0, |m| m.0 as usize));
        let fitted = fit(cut.points, &sample, ctx)?;
        let (usual, noisy): (Vec<&FittedChart>, _) = fitted.iter().partition(|f| relative(f) <= 1.0);
        let by =
            |charts: &[&FittedChart]| quantile(charts.iter().map(|f| f.chart.sigma / relative(f)).collect());
        noisier = noisier.or_else(|| Some(by(&noisy)? / sigma));
        let Some(by_charts) = by(&usual).filter(|by| *by < NOISE.confirmed * sigma) else { break };
        noise = NoiseModel { sigma: by_charts.max(noise.floor), source: NoiseSource::Charts, ..noise };
    }
    Ok(Learned { noise, noisier: noisier.unwrap_or(1.0) })
}

/// What is taken of what charts see.
fn quantile(mut sigmas: Vec<f64>) -> Option<f64> {
    let at = (NOISE.quantile * sigmas.len() as f64) as usize;
    (!sigmas.is_empty()).then(|| *sigmas.select_nth_unstable_by(at, f64::total_cmp).1)
}
