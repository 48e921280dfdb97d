//! Fitting the charts: alternate foot points and one small solve per chart.
//!
//! In: points and patches. Out: charts. For fixed foot points the data term (distance along the normal, the part of the Chamfer distance
//! that a chart can change) and the prior are quadratic in the chart's coefficients, so each round is one solve (paper, equation 3,
//! with the prior in its Gaussian-process limit). Robust weights keep stray points and other sheets out.

use crate::atlas::Chart;
use crate::atlas::mask::Mask;
use crate::error::Result;
use crate::geometry::vec3::{Vec3, dot, sub};
use crate::partition::grow::{Patch, RIM, TUKEY, tukey};
use crate::prior::gp::{self, BASIS, MODES, Normal};
use crate::run::{Context, Stage};
use rayon::prelude::*;

/// Rounds of foot points and solves. The third changes positions by less than a tenth of the noise.
const ROUNDS: usize = 3;
/// The scan's noise level counts like this many points against a chart's own residuals: a chart of a hundred points may
/// deviate where the noise really varies, a chart of ten may not.
const NOISE_STRENGTH: f64 = 40.0;

/// A chart and the points it was fitted to.
pub struct Fitted {
    /// The chart.
    pub chart: Chart,
    /// Points that the chart explains: index, and the robust weight they had.
    pub members: Vec<(u32, f32)>,
}

/// Fits every patch.
///
/// # Errors
/// Cancelled or out of time.
pub fn fit(points: &[Vec3], patches: &[Patch], sigma: f64, ctx: &Context<'_>) -> Result<Vec<Fitted>> {
    ctx.stage(Stage::Fit, patches.len());
    let fitted = patches
        .par_chunks(8)
        .map(|chunk| {
            ctx.check()?;
            let (mut normal, mut work) = (Normal::new(), gp::Work::default());
            let out: Vec<_> = chunk.iter().filter_map(|p| fit_patch(points, p, sigma, &mut normal, &mut work)).collect();
            ctx.advance(chunk.len());
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(fitted.into_iter().flatten().collect())
}

fn fit_patch(points: &[Vec3], patch: &Patch, sigma: f64, normal: &mut Normal, work: &mut gp::Work) -> Option<Fitted> {
    let basis = &*BASIS;
    let local: Vec<[f64; 3]> = patch
        .members
        .iter()
        .map(|&m| {
            let d = sub(points[m as usize], patch.center);
            [
                dot(d, patch.axes[0]) / patch.radii[0],
                dot(d, patch.axes[1]) / patch.radii[1],
                dot(d, patch.axes[2]),
            ]
        })
        .collect();
    let q = &patch.quadric;
    let mut weights: Vec<f64> = local
        .iter()
        .map(|&[u, v, z]| {
            let e = z - (q[0] + q[1] * u + q[2] * v + q[3] * u * u + q[4] * u * v + q[5] * v * v);
            tukey(e, TUKEY * sigma.max(patch.residual) + 1e-12)
        })
        .collect();
    let mut chart = Chart {
        center: patch.center,
        axes: patch.axes,
        radii: patch.radii,
        coeffs: Box::new([0.0; gp::COEFFS]),
        mask: Mask::full(),
        sigma,
        sign: 1.0,
        support: 0.0,
    };
    let mut row = [0.0; MODES];
    let floor = 1e-6 * patch.radii[0].min(patch.radii[1]);
    let mut smoothness = None;
    for round in 0..ROUNDS {
        normal.clear();
        for (&[u, v, z], &w) in local.iter().zip(&weights) {
            if w <= 0.0 {
                continue;
            }
            let (fu, fv, target, cos2) = if round == 0 {
                (u, v, z, 1.0)
            } else {
                let (fu, fv) = chart.foot(crate::atlas::Local { u, v, z });
                let (_, hu, hv) = gp::value_gradient(&chart.coeffs, fu, fv);
                let (a, b) = (hu / chart.radii[0], hv / chart.radii[1]);
                (fu, fv, z - hu * (u - fu) - hv * (v - fv), 1.0 / (1.0 + a * a + b * b))
            };
            gp::mode_row(basis, fu, fv, &mut row);
            normal.add(&row, target, w * cos2, w);
        }
        let fit = gp::fit(basis, normal, sigma.max(floor), NOISE_STRENGTH, smoothness, work)?;
        smoothness = Some(fit.log_kappa);
        *chart.coeffs = gp::spline_coefficients(basis, &fit.modes);
        chart.sigma = fit.sigma;
        chart.support = normal.count;
        let limit = TUKEY * fit.sigma.max(floor);
        for (w, &[u, v, z]) in weights.iter_mut().zip(&local) {
            let (h, c, _) = chart.height_normal(u, v);
            *w = tukey((z - h) * c, limit);
        }
    }
    let inside: Vec<[f64; 2]> =
        local.iter().zip(&weights).filter(|(_, w)| **w > 0.0).map(|(l, _)| [l[0], l[1]]).collect();
    chart.mask = Mask::build(&inside, chart.radii, patch.spacing);
    let members = patch
        .members
        .iter()
        .zip(local.iter().zip(&weights))
        .filter(|(_, (l, w))| l[0] * l[0] + l[1] * l[1] < RIM * RIM && **w > 0.0)
        .map(|(&m, (_, &w))| (m, w as f32))
        .collect::<Vec<_>>();
    (chart.coeffs.iter().all(|c| c.is_finite()) && !members.is_empty()).then_some(Fitted { chart, members })
}
