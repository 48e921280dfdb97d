//! How much the charts' posterior variances must be widened, by the scan's own residuals.
//!
//! In: residuals of the points, and how their places follow each other's noise. Out: a factor.
//!
//! Let b be the error of a point's place and e = b + noise its residual, up to sign. Noise of different
//! points is independent, so of two points beside each other the mean of b1 b2 is that of e1 e2 plus how
//! much each place follows the other point's noise, which the solve knows (the covariance penalty of Efron
//! 2004; for one point it is Mallows' Cp). Nothing of the truth is needed, and no model of the surface.
//! What the charts disagree by is taken off; the rest, over what the posterior says of the same pairs, is
//! the factor.

use super::constants::UNCERTAINTY;
use super::gather::{Beside, Blended};
use crate::error::Result;
use crate::run::Context;

/// What the residuals say of the posterior variances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Factor {
    /// Times so much they are right.
    pub factor: f64,
    /// Its standard error.
    pub error: f64,
}

impl Factor {
    /// Whether it can be believed: places beside each other err alike, so with independent noise it is not
    /// below zero.
    pub(super) fn is_known(&self) -> bool {
        self.error < UNCERTAINTY.doubtful && !self.is_below(0.0)
    }

    /// Whether chance does not put it below one. A surface that is smoother than its charts' prior does, as it
    /// is surer than they say, and so do views that do not fit each other.
    pub(super) fn is_small(&self) -> bool {
        self.is_below(1.0)
    }

    fn is_below(&self, bound: f64) -> bool {
        self.factor + UNCERTAINTY.dependent * self.error <= bound
    }
}

/// The factor that the points' residuals ask for; nothing where none can be compared.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn factor(
    said: &[Blended],
    residual: &[f64],
    beside: &[Beside],
    ctx: &Context<'_>,
) -> Result<Option<Factor>> {
    // Weighted least squares of one number; the error by what the points themselves scatter (White 1980).
    let (mut xx, mut xy) = (0.0, 0.0);
    let mut terms = Vec::with_capacity(said.len());
    for (i, (s, near)) in said.iter().zip(beside).enumerate() {
        ctx.check_at(i)?;
        let near = near.iter().filter(|j| **j != u32::MAX).map(|&j| residual[j as usize]);
        let (count, sum) = near.fold((0.0, 0.0), |(n, sum), r| (n + 1.0, sum + r));
        if count == 0.0 || s.covariance <= 0.0 {
            continue;
        }
        let weight = (s.noise + s.apart()).powi(-2);
        let x = s.covariance;
        let y = residual[i] * sum / count + 2.0 * s.covariance - s.apart();
        if !(weight * x * x).is_finite() || !(weight * x * y).is_finite() {
            continue;
        }
        xx += weight * x * x;
        xy += weight * x * y;
        terms.push([weight * x, x, y]);
    }
    if xx <= 0.0 {
        return Ok(None);
    }
    let factor = xy / xx;
    let scatter: f64 = terms.iter().map(|[wx, x, y]| (wx * (y - factor * x)).powi(2)).sum();
    // Each pair is looked at from both of its ends.
    Ok(Some(Factor { factor, error: (2.0 * scatter).sqrt() / xx }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use crate::run::Run;

    /// Points on a line whose places are half the mean of the noise of those within so many.
    const WITHIN: usize = 4;
    const COUNT: usize = 20_000;

    /// The factor of a line at zero, found at `place(i) + bias(i)`; the variance of the noise is one.
    fn told(noise: &[f64], bias: impl Fn(usize) -> f64) -> Factor {
        let within = WITHIN..noise.len() - WITHIN;
        let share = 0.5 / (2 * WITHIN + 1) as f64;
        let place = |i: usize| share * noise[i - WITHIN..=i + WITHIN].iter().sum::<f64>() + bias(i);
        let residual: Vec<f64> = within.clone().map(|i| noise[i] - place(i)).collect();
        let n = residual.len() as u32;
        let beside: Vec<Beside> =
            (0..n).map(|i| [if i == 0 { 1 } else { i - 1 }, u32::MAX, u32::MAX, u32::MAX]).collect();
        let mut said = Blended::default();
        (said.covariance, said.noise) = (share, 1.0);
        let said = vec![said; residual.len()];
        let found = Run::default().execute(|ctx| factor(&said, &residual, &beside, ctx));
        found.expect("not cancelled").expect("points beside")
    }

    fn independent() -> Vec<f64> {
        let mut rng = Rng::new(3);
        (0..COUNT).map(|_| rng.normal()).collect()
    }

    #[test]
    fn a_surface_that_is_smoother_than_its_charts_prior_is_surer_than_they_say() {
        // Places a step from each other share 8 points of 9, each with half of its noise.
        let f = told(&independent(), |_| 0.0);
        assert!((f.factor - 0.5 * 8.0 / 9.0).abs() < 3.0 * f.error, "{f:?}");
        assert!(f.is_known() && f.is_small(), "{f:?}");
    }

    #[test]
    fn a_bias_that_places_beside_each_other_share_widens() {
        let f = told(&independent(), |i| 0.3 * (i as f64 / 50.0).sin());
        let share = 0.5 / (2 * WITHIN + 1) as f64;
        assert!((f.factor - (0.5 * 8.0 / 9.0 + 0.045 / share)).abs() < 3.0 * f.error, "{f:?}");
        assert!(f.is_known() && !f.is_small(), "{f:?}");
    }

    #[test]
    fn noise_that_is_not_independent_is_known() {
        // What each point has too much, the one before it has too little.
        let n = independent();
        let f = told(&n.windows(2).map(|w| (w[1] - w[0]) / 2f64.sqrt()).collect::<Vec<_>>(), |_| 0.0);
        assert!(!f.is_known(), "{f:?}");
    }
}
