//! Statistics of a set of distances.
//!
//! In: distances. Out: root of the mean square, mean, quantiles, largest.

use rayon::prelude::*;

/// Statistics of a set of distances, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Distances {
    /// Root of the mean square.
    pub rms: f64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// 95% are below.
    pub p95: f64,
    /// 99% are below.
    pub p99: f64,
    /// The largest.
    pub max: f64,
}

impl Distances {
    /// The statistics of some distances; zeros where there are none. Quantiles are interpolated linearly.
    ///
    /// ```
    /// let d = atlasfit::measure::Distances::of(vec![3.0, 1.0, 2.0]);
    /// assert_eq!((d.mean, d.median, d.max), (2.0, 2.0, 3.0));
    /// ```
    #[must_use]
    pub fn of(mut distances: Vec<f64>) -> Self {
        if distances.is_empty() {
            return Self::default();
        }
        let n = distances.len() as f64;
        // Summed in the order given, so that the result does not depend on the sort.
        let (sum, squares) = distances.iter().fold((0.0, 0.0), |(s, q), d| (s + d, q + d * d));
        distances.par_sort_unstable_by(f64::total_cmp);
        Self {
            rms: (squares / n).sqrt(),
            mean: sum / n,
            median: quantile(&distances, 0.5),
            p95: quantile(&distances, 0.95),
            p99: quantile(&distances, 0.99),
            max: distances[distances.len() - 1],
        }
    }
}

/// A quantile of sorted values, interpolated linearly.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let (i, t) = (at.floor() as usize, at.fract());
    sorted[i] + t * (sorted[(i + 1).min(sorted.len() - 1)] - sorted[i])
}
