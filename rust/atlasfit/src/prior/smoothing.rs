//! How much smoother, or rougher, a fit is made than the data say.
//!
//! In: the smoothness and the noise that the data support best, what the user asks for. Out: the smoothness
//! that is taken.

use super::constants::PRIOR;

/// What the user asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Smoothing {
    /// The length below which detail is smoothed away, as a multiple of what the data ask for. 0 or more.
    pub strength: f64,
    /// The noise, standard deviation, where it is known and not to be read off each fit's own residuals.
    pub noise: Option<f64>,
}

impl Smoothing {
    /// Whether what the data say stands.
    pub(crate) fn is_usual(&self) -> bool {
        self.strength == 1.0 && self.noise.is_none()
    }

    /// The logarithm of kappa that is taken where the data support `found` best, with a noise of `sigma`. The
    /// prior's precision grows with this `power` of the frequency.
    ///
    /// Kappa is the noise's variance over the prior's. Known noise replaces the fit's own in it; the prior,
    /// which says how rough the surface is, stays. The frequency at which data and prior weigh the same goes
    /// with the -1 / `power`-th power of kappa.
    pub(crate) fn log_kappa(&self, found: f64, sigma: f64, power: f64) -> f64 {
        let known = self.noise.map_or(0.0, |noise| 2.0 * (noise / sigma.max(1e-300)).ln());
        let shift = known + power * self.strength.clamp(PRIOR.strengths.0, PRIOR.strengths.1).ln();
        // What the data say is never cut off.
        let (roughest, smoothest) = PRIOR.log_kappa;
        (found + shift).clamp(found.min(roughest), found.max(smoothest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_read_off_a_fit_changes_nothing_and_twice_that_is_four_times_the_variance() {
        let at = |noise| Smoothing { strength: 1.0, noise: Some(noise) }.log_kappa(-2.0, 0.1, 5.0);
        assert_eq!(at(0.1), -2.0);
        assert!(
            (at(0.2) - (-2.0 + 4f64.ln())).abs() < 1e-12 && (at(0.05) - (-2.0 - 4f64.ln())).abs() < 1e-12
        );
    }

    #[test]
    fn strength_is_monotone_and_ends_at_a_plane_and_at_interpolation() {
        let at = |strength| Smoothing { strength, noise: None }.log_kappa(-2.0, 0.1, 5.0);
        let all = [0.0, 1e-300, 0.1, 0.5, 1.0, 2.0, 10.0, 1e300].map(at);
        assert!(all.windows(2).all(|w| w[0] <= w[1]) && all.iter().all(|k| k.is_finite()), "{all:?}");
        assert_eq!(at(1.0), -2.0);
        assert!(at(0.0) >= PRIOR.log_kappa.0 && at(1e300) <= PRIOR.log_kappa.1);
    }
}
