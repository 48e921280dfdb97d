//! The radius of a tube, as a smooth function along its axis and around it.
//!
//! In: a candidate. Out: a fitted chart with its members, or nothing where the points turn out to be no tube.

use super::constants::TUBES;
use super::extent::{gap, lopsided, mask};
use super::grow::Candidate;
use super::rice::rice_radius;
use crate::atlas::tube::{HARMONICS, harmonics};
use crate::atlas::{Chart, FittedChart, Map, Smoothness, Tube};
use crate::error::Result;
use crate::numeric::robust::{TUKEY, tukey};
use crate::numeric::special::mean_cosine;
use crate::numeric::spline::{GAUSS, INTERVALS, SIDE, locate, spline, spline_d1, spline_d2};
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::prior::evidence::{Problem, Work};
use crate::prior::posterior::Posterior;
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
    /// Middle of its axis.
    pub center: Vec3,
}

/// Fits all radii, each with its noise; nothing where the points turn out to be no tube.
pub(super) fn fit_all(
    candidates: &[Candidate],
    points: &[Vec3],
    tree: &Neighbours,
    sigma: impl Fn(&Candidate) -> f64 + Sync,
    ctx: &Context<'_>,
) -> Result<Vec<Option<FittedTube>>> {
    candidates
        .par_iter()
        .map(|candidate| {
            ctx.check()?;
            fit(candidate, points, tree, sigma(candidate), ctx)
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
/// Columns of the system.
const WIDTH: usize = Problem::width(COEFFS);
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
    let (mut own, mut smoothness) = (sigma, None);
    if ratio < TUBES.circle {
        for _ in 0..3 {
            let Some(about) = shape(&mut tube, &inner, &weights, Noise { sigma, smoothing: None }, ctx)?
            else {
                return Ok(None);
            };
            own = about.sigma.max(0.3 * sigma);
            smoothness = Some(Smoothness::of_tube(about.log_kappa));
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
    let (support, center) = (weights.iter().sum(), tube.center);
    let chart = Chart { map: Map::Tube(tube), sigma: own, sign: 1.0, support };
    Ok((!members.is_empty()).then_some(FittedTube {
        fitted: FittedChart { chart, members, expected: sigma, smoothness, of_two: false },
        covered,
        ratio,
        center,
    }))
}

/// Fits a tube's radius again, smoother or rougher than the data say, to the same members. Gives the
/// smoothness. One whose cross-section is a circle, or which cannot be fitted so, stays as it was.
pub(super) fn refit(
    tube: &mut Tube,
    members: &[(u32, f32)],
    points: &[Vec3],
    sigma: f64,
    smoothing: Smoothing,
    ctx: &Context<'_>,
) -> Result<Option<Smoothness>> {
    if sigma / tube.mean_radius >= TUBES.circle {
        return Ok(None);
    }
    let (local, weights) = local_members(tube, members, points);
    let shaped = shape(tube, &local, &weights, Noise { sigma, smoothing: Some(smoothing) }, ctx)?;
    Ok(shaped.map(|s| Smoothness::of_tube(s.log_kappa)))
}

/// A tube's members in its own coordinates (s, theta, distance from the axis), and their weights.
fn local_members(tube: &Tube, members: &[(u32, f32)], points: &[Vec3]) -> (Vec<[f64; 3]>, Vec<f64>) {
    members
        .iter()
        .map(|&(m, w)| {
            let l = tube.local(points[m as usize]);
            ([l.s, l.theta, l.d], f64::from(w))
        })
        .unzip()
}

/// How noisy a tube's points are.
struct Noise {
    /// Standard deviation.
    sigma: f64,
    /// How much smoother the radius, fitted before, is to be than the data say; if it is.
    smoothing: Option<Smoothing>,
}

/// The smoothness and the noise of a fit.
struct Shaped {
    log_kappa: f64,
    sigma: f64,
}

/// The least squares system of the radius, and the penalty of its bending.
struct System {
    /// The radii are one more column beside the functions.
    data: Vec<f64>,
    penalty: Vec<f64>,
    count: f64,
}

impl System {
    fn new(tube: &Tube, local: &[[f64; 3]], weights: &[f64], sigma: f64, ctx: &Context<'_>) -> Result<Self> {
        let n = WIDTH;
        let (mut a, mut count) = (vec![0.0; n * n], 0.0);
        for (k, (&[s, theta, d], &w)) in local.iter().zip(weights).enumerate() {
            ctx.check_at(k)?;
            if w <= 1e-3 {
                continue;
            }
            let r = tube.radius_at(s, theta).value;
            // The angle is known only up to the noise; its mean cosine takes out what noise adds to the
            // distance.
            let target = d * mean_cosine(d * r / (sigma * sigma).max(1e-300)) - tube.mean_radius;
            let (i, row) = functions(s, theta);
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
        Ok(Self { data: a, penalty: penalty(tube), count })
    }

    /// The system at a smoothness.
    fn at(&self, kappa: f64, system: &mut [f64]) {
        for ((x, a), p) in system.iter_mut().zip(&self.data).zip(&self.penalty) {
            *x = a + kappa * p;
        }
        system.iter_mut().step_by(WIDTH + 1).take(COEFFS).for_each(|x| *x += 1e-9);
    }
}

/// A place's functions, which follow one another: the harmonics of four splines. The first spline, values.
fn functions(s: f64, theta: f64) -> (usize, [f64; 4 * HARMONICS]) {
    let (i, t) = locate(s);
    let (f, h) = (spline(t), harmonics(theta));
    let mut row = [0.0; 4 * HARMONICS];
    for k in 0..4 {
        for m in 0..HARMONICS {
            row[k * HARMONICS + m] = f[k] * h[m];
        }
    }
    (i, row)
}

/// The penalty of bending, upper triangle.
fn penalty(tube: &Tube) -> Vec<f64> {
    let n = WIDTH;
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
    penalty
}

/// What is still uncertain of a tube's radius at its members: a vector for each, one after another, whose
/// scalar products are covariances in units of the noise's variance. Nothing where there is no such fit.
pub(crate) fn whitened(
    tube: &Tube,
    members: &[(u32, f32)],
    points: &[Vec3],
    noise: f64,
    log_kappa: f64,
    ctx: &Context<'_>,
) -> Result<Option<(Vec<f64>, usize)>> {
    let (local, weights) = local_members(tube, members, points);
    let system = System::new(tube, &local, &weights, noise, ctx)?;
    let mut whole = vec![0.0; WIDTH * WIDTH];
    system.at(log_kappa.exp(), &mut whole);
    let Some(posterior) = Posterior::new(whole, WIDTH, COEFFS) else { return Ok(None) };
    let mut rows = vec![0.0; members.len() * COEFFS];
    for (row, &[s, theta, _]) in rows.chunks_exact_mut(COEFFS).zip(&local) {
        let (i, values) = functions(s, theta);
        row[i * HARMONICS..][..values.len()].copy_from_slice(&values);
        posterior.whiten(row);
    }
    Ok(Some((rows, COEFFS)))
}

/// Fits the harmonics of the radius. Gives the noise about it.
fn shape(
    tube: &mut Tube,
    local: &[[f64; 3]],
    weights: &[f64],
    noise: Noise,
    ctx: &Context<'_>,
) -> Result<Option<Shaped>> {
    let Noise { sigma, smoothing } = noise;
    let data = System::new(tube, local, weights, sigma, ctx)?;
    let problem = Problem {
        unknowns: COEFFS,
        free: FREE,
        count: data.count,
        expected: (0.0, 0.0),
        range: TUBES.log_kappa,
    };
    let mut work = Work::default();
    let solved = problem.solve(TUBES.likely, &mut work, |kappa, system| data.at(kappa, system)).and_then(
        |mut found| {
            let Some(smoothing) = smoothing else { return Some(found) };
            // The penalty is of second derivatives: it grows with the fourth power of the frequency.
            let log_kappa = smoothing.log_kappa(found.log_kappa, found.sigma, 4.0);
            let wanted = problem.at(log_kappa, &mut work, |kappa, system| data.at(kappa, system))?;
            // What the two differ by goes to the radius as it is.
            let now = tube.radius.as_flattened().iter().map(|&r| f64::from(r));
            for ((f, w), now) in found.weights.iter_mut().zip(&wanted.weights).zip(now) {
                *f = now + w - *f;
            }
            found.log_kappa = log_kappa;
            Some(found)
        },
    );
    let Some(fit) = solved.filter(|fit| fit.weights.iter().all(|c| c.is_finite())) else { return Ok(None) };
    for (row, c) in tube.radius.iter_mut().zip(fit.weights.chunks_exact(HARMONICS)) {
        *row = std::array::from_fn(|k| c[k] as f32);
    }
    Ok(Some(Shaped { log_kappa: fit.log_kappa, sigma: fit.sigma }))
}
