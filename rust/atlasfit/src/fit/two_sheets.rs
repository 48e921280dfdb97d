//! Two sheets in one patch, such as the sides of a thin wall.
//!
//! In: one fitted chart and its points. Out: two sheets, where the points ask for them.

use super::constants::FIT;
use super::sheet::{DomainPoint, FootPoints, Sheet, Tools, residuals, solve};
use crate::atlas::{Monge, Patch};
use crate::numeric::robust::{TUKEY, tukey};

/// Looks for two sheets in the points about one fitted chart: two Gaussians against one along the normal,
/// then expectation maximisation with a chart each.
pub(super) fn two_sheets(
    chart: &Monge,
    points: &[DomainPoint],
    patch: &Patch,
    sigma: f64,
    tools: &mut Tools,
) -> Option<[Sheet; 2]> {
    let e: Vec<f64> = residuals(chart, points).collect();
    let mixture = two_gaussians(&e)?;
    // Each sheet gets a chart of its own; points are shared by how well either explains them.
    let noise = mixture.variance.sqrt().min(sigma * 1.5);
    let second = mixture.second;
    let first = second.iter().map(|r| 1.0 - r).collect();
    let mut pair = [(Sheet::empty(patch, noise), first), (Sheet::empty(patch, noise), second)];
    for round in 0..FIT.rounds + 1 {
        if round > 0 {
            share(&mut pair, points);
        }
        for (sheet, weights) in &mut pair {
            solve(sheet, points, weights, FootPoints::of_round(round), noise, tools)?;
        }
    }
    let least = FIT.support * e.len() as f64;
    pair.iter().all(|p| p.0.support >= least).then(|| pair.map(|p| p.0))
}

/// Shares the points between two sheets: how likely each is of either, times its robust weight there.
fn share([a, b]: &mut [(Sheet, Vec<f64>); 2], points: &[DomainPoint]) {
    let s = a.0.sigma.max(b.0.sigma);
    let limit = TUKEY * s;
    let ea: Vec<f64> = residuals(&a.0.map, points).collect();
    let eb: Vec<f64> = residuals(&b.0.map, points).collect();
    for k in 0..points.len() {
        let p = [ea[k], eb[k]].map(|x| (-x * x / (2.0 * s * s)).exp().max(1e-30));
        let r = p[1] / (p[0] + p[1]);
        a.1[k] = (1.0 - r) * tukey(ea[k], limit);
        b.1[k] = r * tukey(eb[k], limit);
    }
}

/// Two Gaussians of one variance.
struct Mixture {
    variance: f64,
    /// For each value how likely it is of the second.
    second: Vec<f64>,
}

/// Fits two Gaussians of one variance to values by expectation maximisation; nothing where one explains them
/// as well.
fn two_gaussians(e: &[f64]) -> Option<Mixture> {
    let n = e.len() as f64;
    if e.len() < FIT.least_points {
        return None;
    }
    let mean = e.iter().sum::<f64>() / n;
    let variance = e.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    let spread = variance.sqrt();
    if spread <= 0.0 {
        return None;
    }
    let (mut m, mut s2, mut share) = ([mean - spread, mean + spread], variance * 0.3, 0.5f64);
    let mut second: Vec<f64> = vec![0.0; e.len()];
    let mut gain = 0.0;
    for _ in 0..FIT.mixture_rounds {
        let (mut like, mut total, mut sum, mut square) = (0.0, 0.0, [0.0; 2], 0.0);
        let (prior, half) = ([(1.0 - share).ln(), share.ln()], 0.5 / s2);
        for (e, r) in e.chunks(FIT.logs).zip(second.chunks_mut(FIT.logs)) {
            // ln(a + b) is ln(max) + ln(1 + min / max), and one logarithm does for the product of many of the
            // latter.
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
        for (x, r) in e.iter().zip(&second) {
            square += (1.0 - r) * (x - m[0]).powi(2) + r * (x - m[1]).powi(2);
        }
        s2 = (square / n).max(1e-6 * variance);
        if (gain - previous).abs() < FIT.converged {
            break;
        }
    }
    let apart = (m[1] - m[0]) / s2.sqrt();
    let two = apart >= FIT.apart && share.min(1.0 - share) >= FIT.share && gain >= FIT.evidence;
    two.then_some(Mixture { variance: s2, second })
}
