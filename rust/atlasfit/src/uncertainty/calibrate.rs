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
    /// Whether it can be believed.
    pub(super) fn is_known(&self) -> bool {
        self.error < UNCERTAINTY.doubtful && self.factor + UNCERTAINTY.dependent * self.error > 1.0
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
