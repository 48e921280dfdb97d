//! The noise as a sample of fitted charts sees it.
//!
//! In: what patches are cut from, the noise so far. Out: the noise, lowered where charts clearly see less of
//! it.

use super::constants::NOISE;
use super::{NoiseModel, NoiseSource};
use crate::atlas::FittedChart;
use crate::error::Result;
use crate::fit::fit;
use crate::partition::{self, Cut};
use crate::run::Context;

/// Lowers the scan's noise to what a sample of charts sees of it, not below its floor: they know it better
/// than the first estimate, which two sheets close together or strong curvature can mislead upwards. `done`
/// are the points that have their charts already.
///
/// # Errors
/// Cancelled or out of time.
pub fn from_charts(
    cut: &Cut<'_>,
    mut noise: NoiseModel,
    done: &[bool],
    ctx: &Context<'_>,
) -> Result<NoiseModel> {
    for _ in 0..NOISE.rounds {
        let sigma = noise.for_charts();
        if sigma <= noise.floor {
            break;
        }
        let sample = partition::sample(&Cut { sigma, ..*cut }, done, ctx)?;
        // In units of the usual noise. Where there is more of it, charts do not say what is usual.
        let relative = |f: &FittedChart| cut.relative_noise(f.members.first().map_or(0, |m| m.0 as usize));
        let fitted = fit(cut.points, &sample, ctx)?;
        let usual = fitted.iter().filter(|f| relative(f) <= 1.0);
        let mut sigmas: Vec<f64> = usual.map(|f| f.chart.sigma / relative(f)).collect();
        if sigmas.is_empty() {
            break;
        }
        let at = (NOISE.quantile * sigmas.len() as f64) as usize;
        let by_charts = *sigmas.select_nth_unstable_by(at, f64::total_cmp).1;
        if by_charts >= NOISE.confirmed * sigma {
            break;
        }
        noise = NoiseModel { sigma: by_charts.max(noise.floor), source: NoiseSource::Charts, ..noise };
    }
    Ok(noise)
}
