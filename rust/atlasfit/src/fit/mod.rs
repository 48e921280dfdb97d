//! Fitting the charts: alternate foot points and one small solve per chart.
//!
//! In: points and patches. Out: charts. For fixed foot points the data term (distance along the normal, the part of the Chamfer distance
//! that a chart can change) and the prior are quadratic in the chart's coefficients, so each round is one solve (paper, equation 3,
//! with the prior in its Gaussian-process limit). Robust weights keep stray points and other sheets out.

use crate::atlas::mask::Mask;
use crate::atlas::monge::Local;
use crate::atlas::{Chart, Map, Monge};
use crate::atlas::{FittedChart, Patch};
use crate::error::Result;
use crate::numeric::robust::{TUKEY, tukey};
use crate::numeric::spline;
use crate::numeric::vec3::Vec3;
use crate::partition::grow::RIM;
use crate::prior::basis;
use crate::prior::basis::BASIS;
use crate::prior::evidence::Work;
use crate::prior::gp::{self};
use crate::prior::normal_equations::NormalEquations;
use crate::prior::normal_equations::Observation;
use crate::run::Context;
use rayon::prelude::*;

/// Rounds of foot points and solves. The third changes positions by less than a tenth of the noise.
const ROUNDS: usize = 3;
/// The scan's noise level counts like this many points against a chart's own residuals: a chart of a hundred points may
/// deviate where the noise really varies, a chart of ten may not.
const NOISE_STRENGTH: f64 = 40.0;

/// What the robust weights leave of the noise: the standard deviation of a Gaussian of which each part counts as much as Tukey's biweight, with
/// its end at [`TUKEY`] standard deviations, lets it (the root of E[w e^2] / E[w]).
const TRUNCATED: f64 = 0.878;
/// Points that one chart is fitted to at the most; of more, an even share takes part.
const MAX_DATA: usize = 4096;

/// Fits every patch, a step of the running stage each. A patch that turns out to hold two sheets gives two charts.
///
/// # Errors
/// Cancelled or out of time.
pub fn fit(points: &[Vec3], patches: &[Patch], ctx: &Context<'_>) -> Result<Vec<FittedChart>> {
    let fitted = patches
        .par_chunks(8)
        .map(|chunk| {
            let mut tools = Tools::default();
            let mut out = Vec::new();
            for p in chunk {
                ctx.check()?;
                fit_patch(points, p, &mut tools, &mut out);
            }
            ctx.advance(chunk.len());
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(fitted.into_iter().flatten().collect())
}

/// Working memory of one worker.
#[derive(Default)]
struct Tools {
    normal: NormalEquations,
    seen: Vec<Observation>,
    work: Work,
}

/// A sheet while it is being fitted.
#[derive(Clone)]
struct Sheet {
    map: Monge,
    sigma: f64,
    support: f64,
}

fn empty_sheet(patch: &Patch, sigma: f64) -> Sheet {
    Sheet {
        map: Monge {
            center: patch.center,
            axes: patch.axes,
            radii: patch.radii,
            coeffs: Box::new([0.0; spline::COEFFS]),
            mask: Mask::full(),
        },
        sigma,
        support: 0.0,
    }
}

fn fit_patch(points: &[Vec3], patch: &Patch, tools: &mut Tools, out: &mut Vec<FittedChart>) {
    let sigma = patch.sigma;
    let local: Vec<[f64; 3]> = patch
        .members
        .iter()
        .map(|&m| {
            let d = points[m as usize] - patch.center;
            [
                d.dot(patch.axes[0]) / patch.radii[0],
                d.dot(patch.axes[1]) / patch.radii[1],
                d.dot(patch.axes[2]),
            ]
        })
        .collect();
    // A few thousand points tell as much as a clump of a hundred thousand.
    let full = local;
    let step = full.len().div_ceil(MAX_DATA).max(1);
    let local: Vec<[f64; 3]> = full.iter().step_by(step).copied().collect();
    let q = &patch.quadric;
    let mut weights: Vec<f64> = local
        .iter()
        .map(|&[u, v, z]| {
            let e = z - (q[0] + q[1] * u + q[2] * v + q[3] * u * u + q[4] * u * v + q[5] * v * v);
            tukey(e, TUKEY * sigma + 1e-12)
        })
        .collect();
    let mut sheet = empty_sheet(patch, sigma);
    let mut smoothness = None;
    for round in 0..ROUNDS {
        if round > 0 {
            let limit = TUKEY * sheet.sigma;
            for (w, e) in weights.iter_mut().zip(residuals(&sheet.map, &local)) {
                *w = tukey(e, limit);
            }
        }
        if solve(&mut sheet, &local, &weights, round == 0, sigma, &mut smoothness, tools).is_none() {
            return;
        }
    }
    let sheets = match two_sheets(&sheet.map, &local, patch, sigma, tools) {
        Some(pair) => pair.into(),
        None => vec![sheet],
    };
    let errors: Vec<Vec<f64>> = sheets.iter().map(|s| residuals(&s.map, &full).collect()).collect();
    for (k, sheet) in sheets.into_iter().enumerate() {
        // A point belongs to the sheet that explains it better.
        let limit = TUKEY * sheet.sigma;
        let weights: Vec<f64> = (0..full.len())
            .map(|i| {
                let e = errors[k][i];
                if errors.iter().all(|other| e.abs() <= other[i].abs()) { tukey(e, limit) } else { 0.0 }
            })
            .collect();
        finish(sheet, &full, &weights, patch, out);
    }
}

/// One solve for the chart's coefficients with given weights; foot points from the chart as it is, or on the first round the points' own
/// coordinates. Sets the chart's noise and support.
fn solve(
    sheet: &mut Sheet,
    local: &[[f64; 3]],
    weights: &[f64],
    first: bool,
    sigma: f64,
    smoothness: &mut Option<f64>,
    tools: &mut Tools,
) -> Option<()> {
    let basis = &*BASIS;
    let chart = &mut sheet.map;
    let floor = 1e-6 * chart.radii[0].min(chart.radii[1]);
    tools.normal.clear();
    tools.seen.clear();
    for (&[u, v, z], &w) in local.iter().zip(weights) {
        if w <= 1e-3 {
            continue;
        }
        let (fu, fv, target, cos2) = if first {
            (u, v, z, 1.0)
        } else {
            let (fu, fv) = chart.foot(Local { u, v, z });
            let (_, hu, hv) = spline::value_gradient(&chart.coeffs, fu, fv);
            let (a, b) = (hu / chart.radii[0], hv / chart.radii[1]);
            (fu, fv, z - hu * (u - fu) - hv * (v - fv), 1.0 / (1.0 + a * a + b * b))
        };
        tools.seen.push(Observation { at: [fu, fv], height: target, weight: w * cos2, count: w });
    }
    tools.normal.observe(basis, &tools.seen);
    let expected = (TRUNCATED * sigma.max(floor), NOISE_STRENGTH);
    let fit = gp::fit(basis, &tools.normal, expected, *smoothness, &mut tools.work)?;
    *smoothness = Some(fit.log_kappa);
    *chart.coeffs = basis::spline_coefficients(basis, &fit.weights);
    sheet.sigma = (fit.sigma / TRUNCATED).max(floor);
    sheet.support = tools.normal.count;
    sheet.map.coeffs.iter().all(|c| c.is_finite()).then_some(())
}

/// Signed distances of the points to the chart, along its normal.
fn residuals<'a>(chart: &'a Monge, local: &'a [[f64; 3]]) -> impl Iterator<Item = f64> + 'a {
    local.iter().map(|&[u, v, z]| {
        let (h, c, _) = chart.height_normal(u, v);
        (z - h) * c
    })
}

fn finish(mut sheet: Sheet, local: &[[f64; 3]], weights: &[f64], patch: &Patch, out: &mut Vec<FittedChart>) {
    let inside: Vec<[f64; 2]> =
        local.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(l, _)| [l[0], l[1]]).collect();
    sheet.map.mask = Mask::build(&inside, sheet.map.radii, patch.spacing);
    sharpen(&mut sheet.map, sheet.sigma);
    let members = patch
        .members
        .iter()
        .zip(local.iter().zip(weights))
        .filter(|(_, (l, w))| l[0] * l[0] + l[1] * l[1] < RIM * RIM && **w > 0.0)
        .map(|(&m, (_, &w))| (m, w as f32))
        .collect::<Vec<_>>();
    if !members.is_empty() {
        let Sheet { map, sigma, support } = sheet;
        out.push(FittedChart { chart: Chart { map: Map::Monge(map), sigma, sign: 1.0, support }, members });
    }
}

/// Sheets closer than this many standard deviations of the noise cannot be told apart (two equal Gaussians have two modes beyond 2).
const SHEETS_APART: f64 = 2.3;
/// Each of two sheets must hold this share of the points.
const SHEET_SHARE: f64 = 0.2;
/// Twice the gain in log likelihood that two sheets must bring, beyond what three more parameters bring by chance in a patch of a few hundred
/// points (3 ln n is 18).
const SHEET_EVIDENCE: f64 = 24.0;
/// Terms up to 2 of which the product does not overflow.
const LOGS: usize = 512;
/// Fewer points do not tell two sheets from one rough one.
const SHEET_POINTS: usize = 40;

/// Share of the bias that is taken out. The prior flattens bends the other way; with the whole correction convex shapes come out too small, with
/// three eighths of it neither way (measured against clean surfaces at four noise levels).
const SHARPEN: f64 = 0.37;

/// Takes out the bias that noise gives to a curved surface. Points scattered about a surface by isotropic noise lie on average outside
/// its bends: a circle of radius r seems to have radius r + sigma^2 / 2r, a graph h seems to be h - sigma^2 / 2 times its Laplacian (to first order).
fn sharpen(chart: &mut Monge, sigma: f64) {
    let step = 2.0 / spline::INTERVALS as f64;
    let [a, b] = chart.radii.map(|r| SHARPEN * 0.5 * (sigma / (r * step)).powi(2));
    let old = chart.coeffs.clone();
    let n = spline::SIDE;
    for i in 1..n - 1 {
        for j in 1..n - 1 {
            let at = |i: usize, j: usize| f64::from(old[i * n + j]);
            let (uu, vv) =
                (at(i - 1, j) - 2.0 * at(i, j) + at(i + 1, j), at(i, j - 1) - 2.0 * at(i, j) + at(i, j + 1));
            chart.coeffs[i * n + j] = (at(i, j) + a * uu + b * vv) as f32;
        }
    }
}

/// Looks for two sheets, such as the sides of a thin wall, in the points about one fitted chart: two Gaussians against one along the normal, then
/// expectation maximisation with a chart each.
fn two_sheets(
    chart: &Monge,
    local: &[[f64; 3]],
    patch: &Patch,
    sigma: f64,
    tools: &mut Tools,
) -> Option<[Sheet; 2]> {
    let e: Vec<f64> = residuals(chart, local).collect();
    let n = e.len() as f64;
    if e.len() < SHEET_POINTS {
        return None;
    }
    let mean = e.iter().sum::<f64>() / n;
    let variance = e.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    let spread = variance.sqrt();
    if spread <= 0.0 {
        return None;
    }
    let (mut m, mut s2, mut share) = ([mean - spread, mean + spread], variance * 0.3, 0.5f64);
    let mut r: Vec<f64> = vec![0.0; e.len()];
    let mut gain = 0.0;
    for _ in 0..40 {
        let (mut like, mut total, mut sum, mut square) = (0.0, 0.0, [0.0; 2], 0.0);
        let (prior, half) = ([(1.0 - share).ln(), share.ln()], 0.5 / s2);
        for (e, r) in e.chunks(LOGS).zip(r.chunks_mut(LOGS)) {
            // ln(a + b) is ln(max) + ln(1 + min / max), and one logarithm does for the product of many of the latter.
            let mut product = 1.0;
            for (x, r) in e.iter().zip(r) {
                let d = [x - m[0], x - m[1]];
                let l = [prior[0] - d[0] * d[0] * half, prior[1] - d[1] * d[1] * half];
                let least = (-(l[1] - l[0]).abs()).exp();
                let ours = 1.0 / (1.0 + least);
                *r = if l[1] > l[0] { ours } else { least * ours };
                product *= 1.0 + least;
                like += l[0].max(l[1]);
                total += *r;
                sum[0] += (1.0 - *r) * x;
                sum[1] += *r * x;
            }
            like += f64::ln(product);
        }
        let previous = gain;
        // Against the single Gaussian's n/2 (1 + ln variance), constants left out.
        gain = 2.0 * like - n * s2.ln() + n * (1.0 + variance.ln());
        share = (total / n).clamp(1e-6, 1.0 - 1e-6);
        m = [sum[0] / (n - total).max(1e-9), sum[1] / total.max(1e-9)];
        for (x, r) in e.iter().zip(&r) {
            square += (1.0 - r) * (x - m[0]).powi(2) + r * (x - m[1]).powi(2);
        }
        s2 = (square / n).max(1e-6 * variance);
        if (gain - previous).abs() < 1e-3 {
            break;
        }
    }
    let apart = (m[1] - m[0]) / s2.sqrt();
    if apart < SHEETS_APART || share.min(1.0 - share) < SHEET_SHARE || gain < SHEET_EVIDENCE {
        return None;
    }
    // Each sheet gets a chart of its own; points are shared by how well either explains them.
    let noise = s2.sqrt().min(sigma * 1.5);
    let mut pair =
        [(empty_sheet(patch, noise), vec![0.0; e.len()]), (empty_sheet(patch, noise), vec![0.0; e.len()])];
    let mut smoothness = [None, None];
    for (k, r) in r.iter().enumerate() {
        pair[0].1[k] = 1.0 - r;
        pair[1].1[k] = *r;
    }
    for round in 0..ROUNDS + 1 {
        if round > 0 {
            let s = pair[0].0.sigma.max(pair[1].0.sigma);
            let limit = TUKEY * s;
            let [a, b] = &mut pair;
            let ea: Vec<f64> = residuals(&a.0.map, local).collect();
            let eb: Vec<f64> = residuals(&b.0.map, local).collect();
            for k in 0..e.len() {
                let p = [ea[k], eb[k]].map(|x| (-x * x / (2.0 * s * s)).exp().max(1e-30));
                let r = p[1] / (p[0] + p[1]);
                a.1[k] = (1.0 - r) * tukey(ea[k], limit);
                b.1[k] = r * tukey(eb[k], limit);
            }
        }
        for (k, (chart, weights)) in pair.iter_mut().enumerate() {
            solve(chart, local, weights, round == 0, noise, &mut smoothness[k], tools)?;
        }
    }
    pair.iter().all(|p| p.0.support >= 0.1 * n).then(|| pair.map(|p| p.0))
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!((TRUNCATED - f64::sqrt(square / weight)).abs() < 5e-4, "{}", f64::sqrt(square / weight));
    }
}
