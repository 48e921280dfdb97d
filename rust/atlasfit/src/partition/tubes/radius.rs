//! The radius of a tube, as a smooth function along its axis and around it.
//!
//! In: a candidate. Out: a fitted chart with its members, or nothing where the points turn out to be no tube.

use super::constants::TUBES;
use super::extent::{gap, lopsided, mask};
use super::grow::Candidate;
use super::rice::rice_radius;
use crate::atlas::tube::{HARMONICS, harmonics};
use crate::atlas::{Chart, FittedChart, Map, Tube};
use crate::error::Result;
use crate::numeric::robust::{TUKEY, tukey};
use crate::numeric::special::mean_cosine;
use crate::numeric::spline::{GAUSS, INTERVALS, SIDE, locate, spline, spline_d1, spline_d2};
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::prior::evidence::{Problem, Work};
use crate::prior::smoothing::Smoothing;
use crate::run::Context;
use crate::spatial::Neighbours;
use rayon::prelude::*;
use std::sync::LazyLock;

/// A fitted tube.
pub(super) struct FittedTube {
    pub fitted: FittedChart,
    /// Points that need no other chart.
    pub covered: Vec<u32>,
    /// Noise over radius.
    pub ratio: f64,
}

/// Fits all radii; nothing where the points turn out to be no tube.
pub(super) fn fit_all(
    candidates: &[Candidate],
    points: &[Vec3],
    tree: &Neighbours,
    sigma: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Option<FittedTube>>> {
    candidates
        .par_iter()
        .map(|candidate| {
            ctx.check()?;
            fit(candidate, points, tree, sigma, ctx)
        })
        .collect()
}

/// Integrals over the domain of products of two splines, of their first and of their second derivatives.
static ENERGY: LazyLock<[Vec<f64>; 3]> = LazyLock::new(|| {
    let mut out = [vec![0.0; SIDE * SIDE], vec![0.0; SIDE * SIDE], vec![0.0; SIDE * SIDE]];
    let unit = INTERVALS as f64 * 0.5;
    for i in 0..INTERVALS {
        for (t, w) in GAUSS {
            let values = [spline(t), spline_d1(t).map(|x| x * unit), spline_d2(t).map(|x| x * unit * unit)];
            for (m, v) in out.iter_mut().zip(&values) {
                for k in 0..4 {
                    for l in 0..4 {
                        m[(i + k) * SIDE + i + l] += w / unit * v[k] * v[l];
                    }
                }
            }
        }
    }
    out
});

const COEFFS: usize = SIDE * HARMONICS;
/// Functions without energy: constant and linear radius, constant and linear shift of the axis in two
/// directions.
const FREE: usize = 6;

/// Fits the radius of one tube.
fn fit(
    candidate: &Candidate,
    points: &[Vec3],
    tree: &Neighbours,
    sigma: f64,
    ctx: &Context<'_>,
) -> Result<Option<FittedTube>> {
    let mut tube = candidate.tube.clone();
    let local = |tube: &Tube, i: u32| {
        let l = tube.local(points[i as usize]);
        [l.s, l.theta, l.d]
    };
    let inner: Vec<[f64; 3]> = candidate.members.iter().map(|&m| local(&tube, m)).collect();
    tube.mean_radius = rice_radius(&inner.iter().map(|l| l[2]).collect::<Vec<_>>(), sigma);
    let ratio = sigma / tube.mean_radius;
    let mut weights = vec![1.0; inner.len()];
    let mut own = sigma;
    if ratio < TUBES.circle {
        for _ in 0..3 {
            let Some(about) = shape(&mut tube, &inner, &weights, Noise { sigma, smoothing: None }, ctx)?
            else {
                return Ok(None);
            };
            own = about.max(0.3 * sigma);
            for (w, l) in weights.iter_mut().zip(&inner) {
                *w = tukey(l[2] - tube.radius_at(l[0], l[1]).value, TUKEY * own.max(sigma));
            }
        }
        if gap(&tube, &inner) {
            return Ok(None);
        }
    } else if lopsided(&inner) {
        return Ok(None);
    }
    *tube.mask = mask(&tube, &inner, candidate.spacing.max(0.5 * sigma), candidate.mean);
    // Who belongs to it: all points to the tails of the noise, those beyond an open end too.
    let tail = TUKEY * own.max(sigma);
    let past = 1.0 + tail / tube.half_length;
    let open = [-1.0, 1.0].map(|s| tube.mask_at(s) < 0.5);
    let mut near = Vec::new();
    let reach = 1.7 * tube.mean_radius + tail;
    tree.within(
        tube.center,
        tube.half_length * (1.0 + TUBES.max_slope * TUBES.max_slope) * past + reach,
        &mut near,
    );
    near.sort_unstable_by_key(|f| f.index);
    let (mut members, mut covered) = (Vec::new(), Vec::new());
    for (k, f) in near.iter().enumerate() {
        ctx.check_at(k)?;
        let [s, theta, d] = local(&tube, f.index);
        if s.abs() > past || d > reach {
            continue;
        }
        let e = d - tube.radius_at(s, theta).value;
        if e < tail && ((s > -PARTITION.core || open[0]) && (s < PARTITION.core || open[1])) {
            covered.push(f.index);
        }
        let w = if ratio < TUBES.circle { tukey(e, tail) } else { f64::from(u8::from(e < tail)) };
        if s.abs() <= 1.0 && w > 0.0 {
            members.push((f.index, w as f32));
        }
    }
    let support = weights.iter().sum();
    let chart = Chart { map: Map::Tube(tube), sigma: own, sign: 1.0, support };
    Ok((!members.is_empty()).then_some(FittedTube {
        fitted: FittedChart { chart, members, expected: sigma, of_two: false },
        covered,
        ratio,
    }))
}

/// Fits a tube's radius again, smoother or rougher than the data say, to the same members. One whose
/// cross-section is a circle, or which cannot be fitted so, stays as it was.
pub(super) fn refit(
    tube: &mut Tube,
    members: &[(u32, f32)],
    points: &[Vec3],
    sigma: f64,
    smoothing: Smoothing,
    ctx: &Context<'_>,
) -> Result<()> {
    let (local, weights): (Vec<[f64; 3]>, Vec<f64>) = members
        .iter()
        .map(|&(m, w)| {
            let l = tube.local(points[m as usize]);
            ([l.s, l.theta, l.d], f64::from(w))
        })
        .unzip();
    if sigma / tube.mean_radius < TUBES.circle {
        shape(tube, &local, &weights, Noise { sigma, smoothing: Some(smoothing) }, ctx)?;
    }
    Ok(())
}

/// How noisy a tube's points are.
struct Noise {
    /// Standard deviation.
    sigma: f64,
    /// How much smoother the radius, fitted before, is to be than the data say; if it is.
    smoothing: Option<Smoothing>,
}

/// Fits the harmonics of the radius. Gives the noise about it.
fn shape(
    tube: &mut Tube,
    local: &[[f64; 3]],
    weights: &[f64],
    noise: Noise,
    ctx: &Context<'_>,
) -> Result<Option<f64>> {
    let Noise { sigma, smoothing } = noise;
    let n = Problem::width(COEFFS);
    // The radii are one more column beside the functions.
    let (mut a, mut count) = (vec![0.0; n * n], 0.0);
    // A point's functions follow one another: the harmonics of four splines.
    let mut row = [0.0; 4 * HARMONICS];
    for (k, (&[s, theta, d], &w)) in local.iter().zip(weights).enumerate() {
        ctx.check_at(k)?;
        if w <= 1e-3 {
            continue;
        }
        let r = tube.radius_at(s, theta).value;
        // The angle is known only up to the noise; its mean cosine takes out what noise adds to the distance.
        let target = d * mean_cosine(d * r / (sigma * sigma).max(1e-300)) - tube.mean_radius;
        let (i, t) = locate(s);
        let (f, h) = (spline(t), harmonics(theta));
        for k in 0..4 {
            for m in 0..HARMONICS {
                row[k * HARMONICS + m] = f[k] * h[m];
            }
        }
        for (x, p) in row.iter().enumerate() {
            let (v, at) = (w * p, i * HARMONICS + x);
            for (a, q) in a[at * n + at..].iter_mut().zip(&row[x..]) {
                *a += v * q;
            }
            a[at * n + COEFFS] += v * target;
        }
        a[COEFFS * n + COEFFS] += w * target * target;
        count += w;
    }
    let aspect = tube.half_length / tube.mean_radius;
    let mut penalty = vec![0.0; n * n];
    for h in 0..HARMONICS {
        let m = h.div_ceil(2) as f64;
        let around = if h == 0 { 0.0 } else { m * m - 1.0 };
        let (g1, g0) = (2.0 * around * aspect.powi(2), around * around * aspect.powi(4));
        for i in 0..SIDE {
            for j in 0..SIDE {
                let at = i * SIDE + j;
                penalty[(i * HARMONICS + h) * n + j * HARMONICS + h] =
                    ENERGY[2][at] + g1 * ENERGY[1][at] + g0 * ENERGY[0][at];
            }
        }
    }
    let problem =
        Problem { unknowns: COEFFS, free: FREE, count, expected: (0.0, 0.0), range: TUBES.log_kappa };
    let system = |kappa: f64, system: &mut [f64]| {
        for ((x, a), p) in system.iter_mut().zip(&a).zip(&penalty) {
            *x = a + kappa * p;
        }
        system.iter_mut().step_by(n + 1).take(COEFFS).for_each(|x| *x += 1e-9);
    };
    let mut work = Work::default();
    let solved = problem.solve(TUBES.likely, &mut work, system).and_then(|mut found| {
        let Some(smoothing) = smoothing else { return Some(found) };
        // The penalty is of second derivatives: it grows with the fourth power of the frequency.
        let wanted = problem.at(smoothing.log_kappa(&found, found.sigma, 4.0), &mut work, system)?;
        // What the two differ by goes to the radius as it is.
        let now = tube.radius.as_flattened().iter().map(|&r| f64::from(r));
        for ((f, w), now) in found.weights.iter_mut().zip(&wanted.weights).zip(now) {
            *f = now + w - *f;
        }
        Some(found)
    });
    let Some(fit) = solved.filter(|fit| fit.weights.iter().all(|c| c.is_finite())) else { return Ok(None) };
    for (row, c) in tube.radius.iter_mut().zip(fit.weights.chunks_exact(HARMONICS)) {
        *row = std::array::from_fn(|k| c[k] as f32);
    }
    Ok(Some(fit.sigma))
}
