//! Finding thin tubes and fitting them.
//!
//! In: points, search tree, spacing, noise. Out: tube charts with their members, which points they cover, and what they say of
//! the noise. A patch that must stay flatter than its own radius holds few points on a thin tube, and noise as large as the radius leaves no surface to
//! grow a patch on; a tube's axis and radius are averaged over all points around it (paper, section 3: contours as 1-manifolds).

use super::Cut;
use crate::atlas::FittedChart;
use crate::atlas::tube::{HARMONICS, MASK_NODES, Tube, harmonics};
use crate::atlas::{Chart, Map, Monge};
use crate::error::Result;
use crate::numeric::dense::{cholesky, cholesky_solve, principal};
use crate::numeric::rng::shuffled;
use crate::numeric::robust::{TUKEY, tukey};
use crate::numeric::special::{bessel_scaled, mean_cosine};
use crate::numeric::spline::{GAUSS, INTERVALS, SIDE, locate, spline, spline_d1, spline_d2};
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::prior::evidence::{Problem, Work};
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use rayon::prelude::*;
use std::sync::LazyLock;

/// Radii of the neighbourhoods that are tried, in point spacings. The least shows more of a scan than one scan line; beyond the largest, tubes
/// are thick enough for patches.
const SCALES: [f64; 4] = [7.0, 11.0, 17.0, 26.0];
/// One point in this many takes part in the first look.
const THIN_OUT: usize = 8;
/// But no fewer points than this.
const FIRST_LOOK: usize = 3000;
/// A neighbourhood looks like a tube when its second principal variance is below this share of the first (a ball of radius R about a tube of
/// radius R / 3.7), and its third above this share of the second (a strip has none).
const ELONGATED: f64 = 0.11;
const ROUND: f64 = 0.35;
/// Fewer points at the first look say nothing.
const FEWEST: usize = 12;
/// Members farther than this many times the median distance from the axis are not the tube's (a Gaussian blob without any radius keeps 99.5 percent).
const WITHIN: f64 = 2.8;
/// Slope of the axis at the ends of a tube's domain: half a right angle in all.
const MAX_SLOPE: f64 = 0.42;
/// Half lengths in units of the root mean square distance from the axis.
const SHORTEST: f64 = 3.0;
const LONGEST: f64 = 14.0;
/// Growth of the domain in one step.
const GROWTH: f64 = 1.3;
/// First and second harmonic of the points' angles: more says that the points lie on one side, or on two as in a strip.
const ONE_SIDE: f64 = 0.3;
const TWO_SIDES: f64 = 0.4;
/// In no tenth of the length may the points just outside outnumber this share of those inside.
const CROWDED: f64 = 0.3;
/// The tube must be thicker than this many point spacings: else it is a line of points, such as a scan line, that says nothing of a surface.
const THICK: f64 = 1.2;
/// Points within this share of the domain are covered.
const CORE: f64 = 0.72;
/// Fewer points make no tube.
const MIN_POINTS: usize = 60;
/// Points that are looked at together, in parallel: more would often lie on the same tube.
const AT_ONCE: usize = 4;
/// Above this ratio of noise to radius the shape of the cross-section is lost; a circle is fitted.
const CIRCLE: f64 = 0.4;
/// Share of the points that must lie on tubes for these to tell the scan's noise.
const MOST: f64 = 0.5;
/// A tube whose points scatter by this many times the noise is none.
const NOISY: f64 = 1.2;
/// Least share of its points that a sector of the circumference must have, and largest first or second harmonic of the angles where noise hides the shape.
const EVEN: f64 = 0.6;
const LOPSIDED: f64 = 0.1;
/// Bins along the axis for the checks.
const BINS: usize = 10;

/// What was found.
pub struct Tubes {
    /// The charts.
    pub fitted: Vec<FittedChart>,
    /// Points that need no other chart.
    pub covered: Vec<bool>,
    /// The noise, where the tubes hold most of the scan.
    pub sigma: Option<f64>,
}

/// A tube before its radius is fitted.
struct Raw {
    tube: Tube,
    members: Vec<u32>,
    /// Mean distance of the members from the axis.
    mean: f64,
    spacing: f64,
}

/// Finds and fits tubes. `known` says that the noise was given and is not to be questioned.
///
/// # Errors
/// Cancelled or out of time.
pub fn find(cut: &Cut<'_>, known: bool, ctx: &Context<'_>) -> Result<Tubes> {
    let Cut { points, tree, sampling, sigma: given, .. } = *cut;
    let n = points.len();
    let order = shuffled(n, ctx.seed);
    let coarse: Vec<Vec3> =
        order.iter().step_by((n / FIRST_LOOK).clamp(1, THIN_OUT)).map(|&i| points[i as usize]).collect();
    let coarse_tree = Neighbours::build(&coarse, ctx)?;
    let mut covered = vec![false; n];
    let mut looked = vec![false; n];
    let mut raws: Vec<Raw> = Vec::new();
    let unit = |i: usize| f64::from(sampling.spacing[i]).max(0.8 * given);
    // A tube about a point, if there is one.
    let look = |i: usize, found: &mut Vec<Neighbour>| {
        let unit = unit(i);
        SCALES.iter().find_map(|scale| {
            coarse_tree.within(points[i], scale * unit, found);
            if found.len() < FEWEST {
                return None;
            }
            let near = found.iter().map(|f| (coarse[f.index as usize], 1.0));
            let (mean, spread, [_, _, along]) = principal(near)?;
            if spread[1] > ELONGATED * spread[2] || spread[0] < ROUND * spread[1] {
                return None;
            }
            let near = Neighbourhood { mean, along, radius: scale * unit, spread };
            grow(cut, &near, found)
        })
    };
    let mut found = Vec::new();
    let mut next = order.iter().map(|&i| i as usize);
    loop {
        ctx.check()?;
        let seeds: Vec<usize> = next.by_ref().filter(|&i| !covered[i] && !looked[i]).take(AT_ONCE).collect();
        if seeds.is_empty() {
            break;
        }
        let seen: Vec<Option<Raw>> =
            seeds.par_iter().map_init(Vec::new, |found, &i| look(i, found)).collect();
        for (i, raw) in seeds.into_iter().zip(seen) {
            // As if they had been looked at one after another.
            if covered[i] || looked[i] {
                continue;
            }
            let Some(raw) = raw else {
                tree.within(points[i], 0.5 * SCALES[0] * unit(i), &mut found);
                found.iter().for_each(|f| looked[f.index as usize] = true);
                continue;
            };
            let end = open_ends(&raw, points);
            for &m in &raw.members {
                let s = raw.tube.foot(points[m as usize]).s;
                if (s > -CORE || end[0]) && (s < CORE || end[1]) {
                    covered[m as usize] = true;
                }
            }
            raws.push(raw);
        }
    }
    if raws.is_empty() {
        return Ok(Tubes { fitted: vec![], covered, sigma: None });
    }
    let share = covered.iter().filter(|c| **c).count() as f64 / n as f64;
    let most = share > MOST && !known;
    let sigma = if most { pooled_noise(&raws, points) } else { given };
    let mut fits = fit_all(&raws, points, tree, sigma, ctx)?;
    let mut found = Tubes { fitted: vec![], covered: vec![false; n], sigma: most.then_some(sigma) };
    if most {
        // Where the radius stands well out of the noise the fits know it best.
        let mut clear: Vec<f64> =
            fits.iter().flatten().filter(|f| f.ratio < CIRCLE).map(|f| f.fitted.chart.sigma).collect();
        if clear.len() * 2 > fits.len() {
            let sigma = median(&mut clear);
            found.sigma = Some(sigma);
            fits = fit_all(&raws, points, tree, sigma, ctx)?;
        }
    }
    let noise = found.sigma.unwrap_or(given);
    for fit in fits.into_iter().flatten() {
        if fit.fitted.chart.sigma > NOISY * noise {
            continue;
        }
        for &i in &fit.covered {
            found.covered[i as usize] = true;
        }
        found.fitted.push(fit.fitted);
    }
    Ok(found)
}

/// Whether the data end inside the domain, at either side.
fn open_ends(raw: &Raw, points: &[Vec3]) -> [bool; 2] {
    let mut bins = [0usize; BINS];
    for &m in &raw.members {
        let s = raw.tube.foot(points[m as usize]).s;
        bins[(((s + 1.0) * 0.5 * BINS as f64).clamp(0.0, BINS as f64 - 1.0)) as usize] += 1;
    }
    let typical = *bins.iter().max().unwrap_or(&0);
    [bins[0] * 5 < typical, bins[BINS - 1] * 5 < typical]
}

/// A neighbourhood that looks like a tube.
struct Neighbourhood {
    /// Mean of its points.
    mean: Vec3,
    /// Direction of its greatest variance.
    along: Vec3,
    /// Its radius.
    radius: f64,
    /// Principal variances, ascending.
    spread: [f64; 3],
}

/// Grows a tube from a neighbourhood.
fn grow(cut: &Cut<'_>, near: &Neighbourhood, found: &mut Vec<Neighbour>) -> Option<Raw> {
    let &Neighbourhood { mean, along, radius, spread } = near;
    let points = cut.points;
    let mut tube = Tube {
        center: mean,
        axes: frame(along),
        half_length: 0.7 * radius,
        axis: [[0.0; 4]; 2],
        mean_radius: (spread[0] + spread[1]).sqrt(),
        radius: Box::new([[0.0; HARMONICS]; SIDE]),
        mask: Box::new([255; MASK_NODES]),
    };
    let mut reach = 2.0 * tube.mean_radius;
    let mut best: Option<Raw> = None;
    loop {
        // Fit the axis twice, turning the frame to it.
        let ball = tube.half_length * 1.15 + 1.6 * reach;
        cut.tree.within(tube.center, ball, found);
        for _ in 0..3 {
            let seen: Vec<[f64; 4]> = found
                .iter()
                .filter_map(|f| {
                    let p = points[f.index as usize];
                    let foot = tube.foot(p);
                    let d = p - tube.center;
                    let x = d.dot(tube.axes[0]) / tube.half_length;
                    (foot.s.abs() <= 1.0 && foot.d <= reach)
                        .then(|| [x, d.dot(tube.axes[1]), d.dot(tube.axes[2]), foot.d])
                })
                .collect();
            if seen.len() < MIN_POINTS {
                return best;
            }
            tube.axis = fit_axis(&seen)?;
            turn(&mut tube);
            let middle = median(&mut seen.iter().map(|s| s[3]).collect::<Vec<_>>());
            reach = (WITHIN * middle).min(1.4 * middle + 5.0 * cut.sigma);
        }
        let Some(raw) = accept(cut, found, &tube, reach) else { break };
        let rms = raw.tube.mean_radius;
        let bent = [-1.0, 1.0].iter().any(|&s| slope(&tube, s) > MAX_SLOPE);
        if bent && best.is_some() {
            break;
        }
        let full = tube.half_length >= LONGEST * rms;
        best = Some(raw);
        if full || bent {
            break;
        }
        tube.half_length *= GROWTH;
        for q in &mut tube.axis {
            for (k, c) in q.iter_mut().enumerate() {
                *c *= GROWTH.powi(k as i32);
            }
        }
    }
    best.filter(|b| b.tube.half_length >= SHORTEST * b.tube.mean_radius && b.members.len() >= MIN_POINTS)
}

fn frame(along: Vec3) -> [Vec3; 3] {
    let (a, _) = along.tangents();
    // Monge::frame gives the given direction third.
    let [e1, e2, n] = Monge::frame(along, a);
    [n, e1, e2]
}

fn slope(tube: &Tube, s: f64) -> f64 {
    let (_, c1, _) = tube.axis_at(s);
    let x = c1.dot(tube.axes[0]);
    (c1.dot(tube.axes[1]).hypot(c1.dot(tube.axes[2]))) / x.max(1e-12)
}

/// Cubics through the offsets: least squares in x.
fn fit_axis(seen: &[[f64; 4]]) -> Option<[[f64; 4]; 2]> {
    let (mut a, mut y, mut z) = ([0.0; 16], [0.0; 4], [0.0; 4]);
    for &[x, p, q, _] in seen {
        let row = [1.0, x, x * x, x * x * x];
        for i in 0..4 {
            for j in i..4 {
                a[i * 4 + j] += row[i] * row[j];
            }
            y[i] += row[i] * p;
            z[i] += row[i] * q;
        }
    }
    for i in 0..4 {
        // Ends without points: the curve goes on straight.
        a[i * 5] += if i < 2 { 1e-9 } else { 1e-3 } * seen.len() as f64;
    }
    if !cholesky(&mut a, 4) {
        return None;
    }
    cholesky_solve(&a, 4, &mut y);
    cholesky_solve(&a, 4, &mut z);
    Some([y, z])
}

/// Turns the frame to the axis's tangent in the middle and moves its origin there. The cubics follow to first order; the next fit settles them.
fn turn(tube: &mut Tube) {
    let (c, c1, _) = tube.axis_at(0.0);
    let e1 = c1.normalized();
    let e2 = (tube.axes[1] - (e1 * tube.axes[1].dot(e1))).normalized();
    tube.axes = [e1, e2, e1.cross(e2)];
    tube.center = c;
    for q in &mut tube.axis {
        q[0] = 0.0;
        q[1] = 0.0;
    }
}

/// The tube as it stands, if the points about it are a tube.
fn accept(cut: &Cut<'_>, found: &[Neighbour], tube: &Tube, reach: f64) -> Option<Raw> {
    let Cut { points, sampling, .. } = *cut;
    let (mut inside, mut outside, mut sums) = ([0usize; BINS], [0usize; BINS], [0.0; BINS]);
    let (mut first, mut second, mut square) = ([0.0; 2], [0.0; 2], 0.0);
    let mut members = Vec::new();
    let mut spacings = Vec::new();
    for f in found {
        let l = tube.local(points[f.index as usize]);
        if l.s.abs() > 1.0 {
            continue;
        }
        let bin = (((l.s + 1.0) * 0.5 * BINS as f64) as usize).min(BINS - 1);
        if l.d <= reach {
            inside[bin] += 1;
            sums[bin] += l.d;
            let (s, c) = l.theta.sin_cos();
            first[0] += c;
            first[1] += s;
            second[0] += c * c - s * s;
            second[1] += 2.0 * s * c;
            square += l.d * l.d;
            members.push(f.index);
            spacings.push(f64::from(sampling.spacing[f.index as usize]));
        } else if l.d <= 1.5 * reach {
            outside[bin] += 1;
        }
    }
    let n = members.len() as f64;
    if members.len() < MIN_POINTS {
        return None;
    }
    let typical = *inside.iter().max()? as f64;
    let crowded = outside.iter().any(|&o| o as f64 > CROWDED * typical);
    let rms = (square / n).sqrt();
    let spacing = median(&mut spacings);
    let sided = first[0].hypot(first[1]) > ONE_SIDE * n || second[0].hypot(second[1]) > TWO_SIDES * n;
    // The radius may vary along a tube, but not beyond recognition.
    let mean = sums.iter().sum::<f64>() / n;
    let uneven = inside
        .iter()
        .zip(&sums)
        .filter(|(c, _)| **c as f64 > 0.2 * typical)
        .any(|(&c, s)| !(0.6..1.7).contains(&(s / c as f64 / mean)));
    if crowded || sided || uneven || rms < THICK * spacing {
        return None;
    }
    members.sort_unstable();
    Some(Raw { tube: Tube { mean_radius: rms, ..tube.clone() }, members, mean, spacing })
}

/// Radius of a circle whose noisy points have these distances from the centre: maximum of the Rice likelihood for known noise.
fn rice_radius(distances: &[f64], sigma: f64) -> f64 {
    let n = distances.len() as f64;
    let square = distances.iter().map(|d| d * d).sum::<f64>() / n;
    let mut r = (square - 2.0 * sigma * sigma).max(0.01 * square).sqrt();
    // Expectation maximisation, as the moment's estimate is already close.
    for _ in 0..30 {
        let next =
            distances.iter().map(|d| d * mean_cosine(d * r / (sigma * sigma).max(1e-300))).sum::<f64>() / n;
        let done = (next - r).abs() < 1e-4 * r;
        r = next;
        if done {
            break;
        }
    }
    r
}

/// Log likelihood of distances under the Rice distribution, terms in the distances alone left out.
fn rice_likelihood(distances: &[f64], r: f64, sigma: f64) -> f64 {
    let s2 = sigma * sigma;
    distances
        .iter()
        .map(|&d| {
            let k = d * r / s2;
            // exp(-(d^2 + r^2) / 2 s^2) I0(k) with the scaled function: the exponent becomes -(d - r)^2 / 2 s^2.
            -s2.ln() - (d - r) * (d - r) / (2.0 * s2) + bessel_scaled(k).0.max(1e-300).ln()
        })
        .sum()
}

/// Steps of the search for the noise.
const NOISE_STEPS: usize = 28;

/// Distances that say about where it is, ...
const POOLED: usize = 6000;
/// ... to within so many steps.
const WITHIN_STEPS: usize = 2;

/// The one noise that explains the distances from all axes best.
fn pooled_noise(raws: &[Raw], points: &[Vec3]) -> f64 {
    let distances: Vec<Vec<f64>> = raws
        .par_iter()
        .map(|r| r.members.iter().map(|&m| r.tube.foot(points[m as usize]).d).collect())
        .collect();
    // With no radius at all the noise would be the root mean square distance over the square root of two.
    let mut most: Vec<f64> = raws.iter().map(|r| r.tube.mean_radius / 2f64.sqrt()).collect();
    let most = median(&mut most);
    let sigma = |k: usize| most * 0.93f64.powi(k as i32);
    let likeliest = |steps: std::ops::RangeInclusive<usize>, distances: &[Vec<f64>]| {
        let likely: Vec<(f64, usize)> = steps
            .into_par_iter()
            .map(|k| {
                let s = sigma(k);
                (distances.iter().map(|d| rice_likelihood(d, rice_radius(d, s), s)).sum(), k)
            })
            .collect();
        likely.into_iter().fold((f64::NEG_INFINITY, 0), |a, b| if b.0 > a.0 { b } else { a }).1
    };
    let step = (distances.iter().map(Vec::len).sum::<usize>() / POOLED).max(1);
    let few: Vec<Vec<f64>> = distances.iter().map(|d| d.iter().step_by(step).copied().collect()).collect();
    let about = likeliest(0..=NOISE_STEPS, &few);
    sigma(likeliest(about.saturating_sub(WITHIN_STEPS)..=about + WITHIN_STEPS, &distances))
}

/// A fitted tube.
struct Fit {
    fitted: FittedChart,
    /// Points that need no other chart.
    covered: Vec<u32>,
    /// Noise over radius.
    ratio: f64,
}

/// Fits all radii; nothing where the points turn out to be no tube.
fn fit_all(
    raws: &[Raw],
    points: &[Vec3],
    tree: &Neighbours,
    sigma: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Option<Fit>>> {
    raws.par_iter()
        .map(|raw| {
            ctx.check()?;
            Ok(fit(raw, points, tree, sigma))
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
/// Functions without energy: constant and linear radius, constant and linear shift of the axis in two directions.
const FREE: usize = 6;
/// Smoothness that is tried, natural logarithm: from interpolation to a cone.
const LOG_KAPPA: (f64, f64) = (-25.0, 5.0);
/// Where the search begins.
const LIKELY: f64 = -5.0;

/// Fits the radius of one tube.
fn fit(raw: &Raw, points: &[Vec3], tree: &Neighbours, sigma: f64) -> Option<Fit> {
    let mut tube = raw.tube.clone();
    let local = |tube: &Tube, i: u32| {
        let l = tube.local(points[i as usize]);
        [l.s, l.theta, l.d]
    };
    let inner: Vec<[f64; 3]> = raw.members.iter().map(|&m| local(&tube, m)).collect();
    tube.mean_radius = rice_radius(&inner.iter().map(|l| l[2]).collect::<Vec<_>>(), sigma);
    let ratio = sigma / tube.mean_radius;
    let mut weights = vec![1.0; inner.len()];
    let mut own = sigma;
    if ratio < CIRCLE {
        for _ in 0..3 {
            own = shape(&mut tube, &inner, &weights, sigma)?.max(0.3 * sigma);
            for (w, l) in weights.iter_mut().zip(&inner) {
                *w = tukey(l[2] - tube.radius_at(l[0], l[1]).0, TUKEY * own.max(sigma));
            }
        }
        if gap(&tube, &inner) {
            return None;
        }
    } else if lopsided(&inner) {
        return None;
    }
    *tube.mask = mask(&inner, tube.half_length, raw.spacing.max(0.5 * sigma), raw.mean);
    // Who belongs to it: all points to the tails of the noise, those beyond an open end too.
    let tail = TUKEY * own.max(sigma);
    let past = 1.0 + tail / tube.half_length;
    let open = [-1.0, 1.0].map(|s| tube.mask_at(s) < 0.5);
    let mut near = Vec::new();
    let reach = 1.7 * tube.mean_radius + tail;
    tree.within(tube.center, tube.half_length * (1.0 + MAX_SLOPE * MAX_SLOPE) * past + reach, &mut near);
    near.sort_unstable_by_key(|f| f.index);
    let (mut members, mut covered) = (Vec::new(), Vec::new());
    for f in &near {
        let [s, theta, d] = local(&tube, f.index);
        if s.abs() > past || d > reach {
            continue;
        }
        let e = d - tube.radius_at(s, theta).0;
        if e < tail && ((s > -CORE || open[0]) && (s < CORE || open[1])) {
            covered.push(f.index);
        }
        let w = if ratio < CIRCLE { tukey(e, tail) } else { f64::from(u8::from(e < tail)) };
        if s.abs() <= 1.0 && w > 0.0 {
            members.push((f.index, w as f32));
        }
    }
    let support = weights.iter().sum();
    let chart = Chart { map: Map::Tube(tube), sigma: own, sign: 1.0, support };
    (!members.is_empty()).then_some(Fit { fitted: FittedChart { chart, members }, covered, ratio })
}

/// Whether a part of the circumference lacks its share of the points: a channel or a strip, not a tube.
fn gap(tube: &Tube, local: &[[f64; 3]]) -> bool {
    const SECTORS: usize = 12;
    let (mut seen, mut arc, mut counted) = ([0.0; SECTORS], [0.0; SECTORS], 0.0);
    for l in local.iter().filter(|l| l[0].abs() < 1.0) {
        let k = ((l[1] / std::f64::consts::TAU + 0.5) * SECTORS as f64) as usize;
        seen[k.min(SECTORS - 1)] += 1.0;
        counted += 1.0;
    }
    for k in 0..4 * SECTORS {
        let theta = ((k as f64 + 0.5) / (4 * SECTORS) as f64 - 0.5) * std::f64::consts::TAU;
        for s in [-0.75, -0.25, 0.25, 0.75] {
            let (r, _, rt) = tube.radius_at(s, theta);
            arc[k / 4] += r.hypot(rt);
        }
    }
    let whole: f64 = arc.iter().sum();
    seen.iter().zip(&arc).any(|(&n, a)| {
        let expected = counted * a / whole;
        n < EVEN * expected - 2.5 * expected.sqrt()
    })
}

/// The same where noise hides the shape: then the angles are spread evenly if it is a circle.
fn lopsided(local: &[[f64; 3]]) -> bool {
    let (mut first, mut second) = ([0.0; 2], [0.0; 2]);
    for l in local {
        let h = harmonics(l[1]);
        first = [first[0] + h[1], first[1] + h[2]];
        second = [second[0] + h[3], second[1] + h[4]];
    }
    let n = local.len() as f64;
    first[0].hypot(first[1]).max(second[0].hypot(second[1])) > (LOPSIDED + 2.0 / n.sqrt()) * n
}

/// Fits the harmonics of the radius. Gives the noise about it.
fn shape(tube: &mut Tube, local: &[[f64; 3]], weights: &[f64], sigma: f64) -> Option<f64> {
    let n = Problem::width(COEFFS);
    // The radii are one more column beside the functions.
    let (mut a, mut count) = (vec![0.0; n * n], 0.0);
    // A point's functions follow one another: the harmonics of four splines.
    let mut row = [0.0; 4 * HARMONICS];
    for (&[s, theta, d], &w) in local.iter().zip(weights) {
        if w <= 1e-3 {
            continue;
        }
        let r = tube.radius_at(s, theta).0;
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
    let problem = Problem { unknowns: COEFFS, free: FREE, count, expected: (0.0, 0.0), range: LOG_KAPPA };
    let fit = problem.solve(LIKELY, &mut Work::default(), |kappa, system| {
        for ((x, a), p) in system.iter_mut().zip(&a).zip(&penalty) {
            *x = a + kappa * p;
        }
        system.iter_mut().step_by(n + 1).take(COEFFS).for_each(|x| *x += 1e-9);
    })?;
    if fit.weights.iter().any(|c| !c.is_finite()) {
        return None;
    }
    for (row, c) in tube.radius.iter_mut().zip(fit.weights.chunks_exact(HARMONICS)) {
        *row = std::array::from_fn(|k| c[k] as f32);
    }
    Some(fit.sigma)
}

/// Where along the axis there is surface: where the points are at least half as dense as usual, which is where a tube ends when noise blurs
/// its end.
fn mask(local: &[[f64; 3]], half_length: f64, spacing: f64, mean: f64) -> [u8; MASK_NODES] {
    // Wide enough for a few dozen points.
    let per_length = local.len() as f64 / (2.0 * half_length);
    let width = (24.0 / per_length).max(spacing).min(2.0 * mean.max(spacing)) / half_length;
    let node = |k: usize| k as f64 * (2.0 / (MASK_NODES - 1) as f64) - 1.0;
    let mut density: Vec<f64> = vec![0.0; MASK_NODES];
    for (k, d) in density.iter_mut().enumerate() {
        let at = node(k);
        // The kernel's part within the domain.
        let (mut sum, mut whole) = (0.0, 0.0);
        let kernel = |t: f64| if t.abs() < 1.0 { (1.0 - t * t) * (1.0 - t * t) } else { 0.0 };
        for l in local {
            sum += kernel((l[0] - at) / width);
        }
        for q in -8..=8 {
            let t = f64::from(q) / 8.0;
            if (at + t * width).abs() <= 1.0 {
                whole += kernel(t);
            }
        }
        *d = if whole > 0.0 { sum / whole } else { 0.0 };
    }
    let mut sorted = density.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[MASK_NODES * 3 / 4].max(1e-12);
    std::array::from_fn(|k| ((0.5 + (density[k] / usual - 0.5) / 0.5).clamp(0.0, 1.0) * 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_functions_at_known_places() {
        // I0(1) = 1.2660658, I1(1) = 0.5651591, I0(5) = 27.2398718, I1(5) = 24.3356421.
        for (k, i0, i1) in [(1.0, 1.266_065_8, 0.565_159_1), (5.0, 27.239_871_8, 24.335_642_1)] {
            let (a, b) = bessel_scaled(k);
            assert!((a * f64::exp(k) / i0 - 1.0).abs() < 1e-5);
            assert!((b * f64::exp(k) / i1 - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn the_radius_is_found_in_noise_as_large_as_itself() {
        let mut rng = crate::numeric::rng::Rng::new(3);
        let distances: Vec<f64> = (0..20_000)
            .map(|_| {
                let (x, y) = (1.0 + rng.normal(), rng.normal());
                x.hypot(y)
            })
            .collect();
        assert!((rice_radius(&distances, 1.0) - 1.0).abs() < 0.05);
    }
}
