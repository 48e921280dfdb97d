//! Smoothness and noise of a fit, chosen by restricted marginal likelihood (Wahba 1985; Rasmussen and
//! Williams 2006, chapter 5).
//!
//! In: the normal equations of a penalised least squares fit, the observations as one more column. Out: the
//! solution at the smoothness and the noise that the data support best. Eliminating the unknowns leaves the
//! penalised sum of squares in that column's own entry, so that one factorisation is all that a value of the
//! smoothness costs.

use super::constants::PRIOR;
use crate::numeric::dense::{LANES, eliminate};

/// A penalised least squares fit.
pub struct Problem {
    /// Unknowns; the column after them holds the observations.
    pub unknowns: usize,
    /// Combinations of the unknowns that the penalty leaves free.
    pub free: usize,
    /// The effective number of observations.
    pub count: f64,
    /// Noise expected beforehand, standard deviation, and how many observations that is worth.
    pub expected: (f64, f64),
    /// Values that may be chosen: logarithm of kappa, the ratio of noise variance to prior variance.
    pub range: (f64, f64),
}

/// The most likely fit.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The unknowns.
    pub weights: Vec<f64>,
    /// Standard deviation of the noise.
    pub sigma: f64,
    /// Logarithm of kappa.
    pub log_kappa: f64,
    /// Twice the negative log likelihood, up to what is the same for each smoothness.
    pub score: f64,
}

/// Working memory: the best system so far and the one that is tried.
pub type Work = [Vec<f64>; 2];

impl Problem {
    /// Columns of the system: unknowns, observations, and what fills the last vector.
    #[must_use]
    pub const fn width(unknowns: usize) -> usize {
        (unknowns + 1).next_multiple_of(LANES)
    }

    /// Climbs to the most likely smoothness from `start`, and goes to the peak of the parabola through the
    /// best and the two values beside it. `system` writes the upper triangle of the system for a kappa, its
    /// observations without penalty.
    ///
    /// The likelihood has one peak (of 20,000 charts of five scans, in all but one), so uphill from a likely
    /// place is enough.
    pub fn solve(
        &self,
        start: f64,
        work: &mut Work,
        mut system: impl FnMut(f64, &mut [f64]),
    ) -> Option<Solution> {
        let (n, m) = (self.unknowns, Self::width(self.unknowns));
        let [best, trial] = work;
        best.resize(m * m, 0.0);
        trial.resize(m * m, 0.0);
        let mut sigma2 = 0.0;
        // The score of a value. Its system is kept where it is less than that of the best so far.
        let mut score_at = |log_kappa: f64, least: f64| {
            system(log_kappa.exp(), trial);
            if !eliminate(trial, m, n) {
                return f64::INFINITY;
            }
            let (score, variance) = self.score(trial, log_kappa);
            if score < least {
                sigma2 = variance;
                std::mem::swap(best, trial);
            }
            if score.is_nan() { f64::INFINITY } else { score }
        };
        let (mut log_kappa, mut score) = (start, score_at(start, f64::INFINITY));
        // The scores a step above and below the best.
        let mut beside = [f64::INFINITY; 2];
        for (side, step) in [PRIOR.step, -PRIOR.step].into_iter().enumerate() {
            while (self.range.0..=self.range.1).contains(&(log_kappa + step)) {
                let next = score_at(log_kappa + step, score);
                if next >= score {
                    beside[side] = next;
                    break;
                }
                beside[1 - side] = score;
                (log_kappa, score) = (log_kappa + step, next);
            }
            if log_kappa != start {
                break;
            }
        }
        let [above, below] = beside;
        let bend = above + below - 2.0 * score;
        if bend.is_finite() && bend > 0.0 {
            let peak = log_kappa + 0.5 * PRIOR.step * (below - above) / bend;
            let there = score_at(peak, score);
            if there < score {
                (log_kappa, score) = (peak, there);
            }
        }
        let weights = back_substitute(best, m, n);
        score.is_finite().then(|| Solution { weights, sigma: sigma2.sqrt(), log_kappa, score })
    }

    /// The fit at a given smoothness, whatever the data say of it. `system` as in [`Problem::solve`].
    pub fn at(
        &self,
        log_kappa: f64,
        work: &mut Work,
        system: impl FnOnce(f64, &mut [f64]),
    ) -> Option<Solution> {
        let (n, m) = (self.unknowns, Self::width(self.unknowns));
        let [trial, _] = work;
        trial.resize(m * m, 0.0);
        system(log_kappa.exp(), trial);
        if !eliminate(trial, m, n) {
            return None;
        }
        let (score, sigma2) = self.score(trial, log_kappa);
        Some(Solution { weights: back_substitute(trial, m, n), sigma: sigma2.sqrt(), log_kappa, score })
    }

    /// Twice the negative log likelihood, and the noise's variance, of an eliminated system.
    fn score(&self, eliminated: &[f64], log_kappa: f64) -> (f64, f64) {
        let (n, m) = (self.unknowns, Self::width(self.unknowns));
        let (sigma0, strength) = self.expected;
        let dof = (self.count - self.free as f64).max(1.0) + strength;
        let sigma2 = (eliminated[n * m + n].max(0.0) + strength * sigma0 * sigma0) / dof;
        // Products of a few pivots are far from overflow.
        let pivots: Vec<f64> = eliminated.iter().step_by(m + 1).take(n).copied().collect();
        let log_det = 2.0 * pivots.chunks(5).map(|p| p.iter().product::<f64>().ln()).sum::<f64>();
        (dof * sigma2.max(1e-300).ln() + log_det - (n - self.free) as f64 * log_kappa, sigma2)
    }
}

/// Solves U x = y, where `y` is the column after the `n` of U.
fn back_substitute(u: &[f64], width: usize, n: usize) -> Vec<f64> {
    let mut x = vec![0.0; n];
    for (i, row) in u.chunks_exact(width).enumerate().take(n).rev() {
        let mut sums = [0.0; LANES];
        for (k, (a, x)) in row[i + 1..n].iter().zip(&x[i + 1..]).enumerate() {
            sums[k % LANES] += a * x;
        }
        x[i] = (row[n] - sums.iter().sum::<f64>()) / row[i];
    }
    x
}
