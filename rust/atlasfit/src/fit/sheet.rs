//! One sheet of a patch while it is being fitted: its solve, and how far points lie from it.
//!
//! In: points in the patch's domain, their weights, the scan's noise. Out: the sheet's coefficients,
//! smoothness and noise.

use super::constants::FIT;
use crate::atlas::mask::Mask;
use crate::atlas::monge::BaseCoordinates;
use crate::atlas::{Monge, Patch};
use crate::numeric::spline::{self, Slope};
use crate::prior::basis::{self, BASIS};
use crate::prior::evidence::Work;
use crate::prior::gp;
use crate::prior::normal_equations::{NormalEquations, Observation};

/// A point in a patch's domain: u and v in its unit disk, height over its base plane.
pub(super) type DomainPoint = [f64; 3];

/// Working memory of one worker.
#[derive(Default)]
pub(super) struct Tools {
    equations: NormalEquations,
    observations: Vec<Observation>,
    work: Work,
}

/// A sheet.
#[derive(Clone)]
pub(super) struct Sheet {
    /// Its map; the mask is not made yet.
    pub map: Monge,
    /// Its noise.
    pub sigma: f64,
    /// Sum of its points' weights.
    pub support: f64,
    /// Its smoothness, the natural logarithm of kappa; none before the first solve.
    log_kappa: Option<f64>,
}

impl Sheet {
    /// The base plane of a patch.
    pub(super) fn empty(patch: &Patch, sigma: f64) -> Self {
        let map = Monge {
            center: patch.center,
            axes: patch.axes,
            radii: patch.radii,
            coeffs: Box::new([0.0; spline::COEFFS]),
            mask: Mask::full(),
        };
        Self { map, sigma, support: 0.0, log_kappa: None }
    }
}

/// Which foot points a solve takes.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum FootPoints {
    /// The points' own domain coordinates.
    Below,
    /// The nearest points of the sheet as it is.
    Nearest,
}

impl FootPoints {
    /// Those of a round of solves: before the first one there is no sheet to be near.
    pub(super) fn of_round(round: usize) -> Self {
        if round == 0 { Self::Below } else { Self::Nearest }
    }
}

/// One solve for the sheet's coefficients with given weights. Sets its noise, support and smoothness too.
/// `sigma` is the noise expected beforehand.
pub(super) fn solve(
    sheet: &mut Sheet,
    points: &[DomainPoint],
    weights: &[f64],
    feet: FootPoints,
    sigma: f64,
    tools: &mut Tools,
) -> Option<()> {
    let basis = &*BASIS;
    let chart = &mut sheet.map;
    let floor = 1e-6 * chart.radii[0].min(chart.radii[1]);
    tools.equations.clear();
    tools.observations.clear();
    for (&[u, v, z], &w) in points.iter().zip(weights) {
        if w <= 1e-3 {
            continue;
        }
        let (fu, fv, height, cos2) = if feet == FootPoints::Below {
            (u, v, z, 1.0)
        } else {
            let (fu, fv) = chart.foot(BaseCoordinates { u, v, z });
            let Slope { du: hu, dv: hv, .. } = spline::value_gradient(&chart.coeffs, fu, fv);
            let (a, b) = (hu / chart.radii[0], hv / chart.radii[1]);
            (fu, fv, z - hu * (u - fu) - hv * (v - fv), 1.0 / (1.0 + a * a + b * b))
        };
        tools.observations.push(Observation { at: [fu, fv], height, weight: w * cos2, count: w });
    }
    tools.equations.observe(basis, &tools.observations);
    let expected = (FIT.truncated * sigma.max(floor), FIT.noise_strength);
    let fit = gp::fit(basis, &tools.equations, expected, sheet.log_kappa, &mut tools.work)?;
    sheet.log_kappa = Some(fit.log_kappa);
    *chart.coeffs = basis::spline_coefficients(basis, &fit.weights);
    sheet.sigma = (fit.sigma / FIT.truncated).max(floor);
    sheet.support = tools.equations.count;
    sheet.map.coeffs.iter().all(|c| c.is_finite()).then_some(())
}

/// Signed distances of the points to the chart, along its normal.
pub(super) fn residuals<'a>(chart: &'a Monge, points: &'a [DomainPoint]) -> impl Iterator<Item = f64> + 'a {
    points.iter().map(|&[u, v, z]| {
        let at = chart.height_normal(u, v);
        (z - at.height) * at.cos
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::robust::{TUKEY, tukey};

    #[test]
    fn the_share_of_the_noise_that_robust_weights_leave_is_the_integrals() {
        // Midpoint rule over the weights' support, in standard deviations.
        let (mut weight, mut square) = (0.0, 0.0);
        for k in 0..10_000 {
            let e = TUKEY * (f64::from(k) + 0.5) / 10_000.0;
            let w = tukey(e, TUKEY) * (-0.5 * e * e).exp();
            weight += w;
            square += w * e * e;
        }
        assert!((FIT.truncated - f64::sqrt(square / weight)).abs() < 5e-4, "{}", f64::sqrt(square / weight));
    }
}
