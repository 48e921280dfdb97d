//! The noise as a sample of fitted charts sees it.
//!
//! In: what patches are cut from, the noise so far. Out: the noise, lowered where charts clearly see less of
//! it.

use super::{NoiseModel, NoiseSource};
use crate::error::Result;
use crate::fit::fit;
use crate::partition::{self, Cut};
use crate::run::Context;

/// Times the noise may be corrected by charts.
const ROUNDS: usize = 3;
/// The noise stands when the charts see at least this share of it: where it varies over the scan, the calmer
/// charts always see less.
const CONFIRMED: f64 = 0.9;
/// The quantile of the charts' own noise that is taken: it sees the noise truly even where other charts hold
/// two sheets unseen.
const QUANTILE: f64 = 0.3;

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
    for _ in 0..ROUNDS {
        let sigma = noise.for_charts();
        if sigma <= noise.floor {
            break;
        }
        let sample = partition::sample(&Cut { sigma, ..*cut }, done, ctx)?;
        let mut sigmas: Vec<f64> = fit(cut.points, &sample, ctx)?.iter().map(|f| f.chart.sigma).collect();
        if sigmas.is_empty() {
            break;
        }
        let at = (QUANTILE * sigmas.len() as f64) as usize;
        let by_charts = *sigmas.select_nth_unstable_by(at, f64::total_cmp).1;
        if by_charts >= CONFIRMED * sigma {
            break;
        }
        noise = NoiseModel { sigma: by_charts.max(noise.floor), source: NoiseSource::Charts, ..noise };
    }
    Ok(noise)
}
