//! One sheet of a patch while it is being fitted: its solve, and how far points lie from it.
//!
//! In: points in the patch's domain, their weights, the scan's noise. Out: the sheet's coefficients,
//! smoothness and noise.

use super::constants::FIT;
use crate::atlas::mask::Mask;
use crate::atlas::monge::BaseCoordinates;
use crate::atlas::{Monge, Patch, Smoothness};
use crate::numeric::spline::{self, Slope};
use crate::prior::basis::{self, BASIS};
use crate::prior::constants::PRIOR;
use crate::prior::evidence::Work;
use crate::prior::gp;
use crate::prior::normal_equations::{NormalEquations, Observation};
use crate::prior::posterior::Posterior;
use crate::prior::smoothing::Smoothing;

/// A point in a patch's domain: u and v in its unit disk, height over its base plane.
pub(super) type DomainPoint = [f64; 3];

/// Working memory of one worker.
#[derive(Default)]
pub(crate) struct Tools {
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
    /// None before the first solve.
    pub smoothness: Option<Smoothness>,
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
        Self { map, sigma, support: 0.0, smoothness: None }
    }

    /// The sheet of a chart that was fitted before, and the noise expected.
    pub(super) fn of_chart(map: Monge, sigma: f64) -> Self {
        Self { map, sigma, support: 0.0, smoothness: None }
    }

    /// Noise that is not told from none.
    fn floor(&self) -> f64 {
        1e-6 * self.map.radii[0].min(self.map.radii[1])
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
    let expected = observe(sheet, points, weights, feet, sigma, tools);
    let fit = gp::fit(&BASIS, &tools.equations, expected, sheet.smoothness, &mut tools.work)?;
    sheet.smoothness = Some(fit.smoothness);
    *sheet.map.coeffs = basis::spline_coefficients(&BASIS, &fit.weights);
    sheet.sigma = (fit.sigma / FIT.truncated).max(sheet.floor());
    sheet.support = tools.equations.count;
    sheet.map.coeffs.iter().all(|c| c.is_finite()).then_some(())
}

/// From one smoothness to another.
pub(super) struct Shift {
    /// What the data support best.
    pub usual: Smoothness,
    /// What the user asks for.
    pub wanted: Smoothness,
}

/// From what the sheet's own data say to the smoothness that the user asks for.
pub(super) fn shift(
    sheet: &Sheet,
    points: &[DomainPoint],
    weights: &[f64],
    smoothing: Smoothing,
    tools: &mut Tools,
) -> Option<Shift> {
    let expected = observe(sheet, points, weights, FootPoints::Nearest, sheet.sigma, tools);
    let found = gp::fit(&BASIS, &tools.equations, expected, None, &mut tools.work)?;
    let (usual, power) = (found.smoothness, 4.0 * PRIOR.order);
    let log_kappa = smoothing.log_kappa(usual.log_kappa, found.sigma / FIT.truncated, power);
    Some(Shift { usual, wanted: Smoothness { log_kappa, ..usual } })
}

/// What another smoothness changes.
pub(super) struct Change {
    /// To be added to the spline's coefficients.
    pub coeffs: [f32; spline::COEFFS],
    /// The noise, as the points then show it.
    pub sigma: f64,
}

/// How a solve with the wanted smoothness differs from one with the usual, the points' feet being on the
/// sheet as it is.
pub(super) fn change(
    sheet: &Sheet,
    points: &[DomainPoint],
    weights: &[f64],
    to: &Shift,
    tools: &mut Tools,
) -> Option<Change> {
    let expected = observe(sheet, points, weights, FootPoints::Nearest, sheet.sigma, tools);
    let mut at = |smoothness| gp::fit_at(&BASIS, &tools.equations, expected, smoothness, &mut tools.work);
    let (usual, wanted) = (at(to.usual)?, at(to.wanted)?);
    let weights: Vec<f64> = wanted.weights.iter().zip(&usual.weights).map(|(w, u)| w - u).collect();
    let coeffs = basis::spline_coefficients(&BASIS, &weights);
    coeffs.iter().all(|c| c.is_finite()).then(|| Change { coeffs, sigma: wanted.sigma / FIT.truncated })
}

/// The posterior of the weights of the eigenfunctions, the points' feet being on the sheet as it is.
pub(super) fn posterior(
    sheet: &Sheet,
    points: &[DomainPoint],
    weights: &[f64],
    smoothness: Smoothness,
    tools: &mut Tools,
) -> Option<Posterior> {
    observe(sheet, points, weights, FootPoints::Nearest, sheet.sigma, tools);
    gp::posterior(&BASIS, &tools.equations, smoothness)
}

/// Makes the normal equations of a solve. Returns the noise that is expected, and how many points that is
/// worth.
fn observe(
    sheet: &Sheet,
    points: &[DomainPoint],
    weights: &[f64],
    feet: FootPoints,
    sigma: f64,
    tools: &mut Tools,
) -> (f64, f64) {
    let chart = &sheet.map;
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
    tools.equations.observe(&BASIS, &tools.observations);
    (FIT.truncated * sigma.max(sheet.floor()), FIT.noise_strength)
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
