//! Growing a tube from an elongated neighbourhood: its axis, how far it reaches, which points are its.
//!
//! In: points, their spacing and noise, a neighbourhood. Out: a candidate, its radius not yet fitted, or
//! nothing where the points about the axis are no tube.

use super::clumps::clumps_gain;
use super::constants::{BINS, TUBES};
use super::rice::circle_gain;
use crate::atlas::tube::{CurvePoint, HARMONICS, MASK_NODES};
use crate::atlas::{Monge, Tube};
use crate::numeric::dense::{cholesky, cholesky_solve};
use crate::numeric::spline::SIDE;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::partition::Cut;
use crate::spatial::neighbours::Neighbour;

/// A tube before its radius is fitted.
pub(super) struct Candidate {
    pub tube: Tube,
    /// Its points, ascending.
    pub members: Vec<u32>,
    /// Mean distance of the members from the axis.
    pub mean: f64,
    /// Median spacing of the members.
    pub spacing: f64,
}

/// A neighbourhood that looks like a tube.
pub(super) struct Neighbourhood {
    /// Mean of its points.
    pub mean: Vec3,
    /// Direction of its greatest variance.
    pub along: Vec3,
    /// Its radius.
    pub radius: f64,
    /// Principal variances, ascending.
    pub spread: [f64; 3],
}

/// Grows a tube from a neighbourhood.
pub(super) fn grow(cut: &Cut<'_>, near: &Neighbourhood, found: &mut Vec<Neighbour>) -> Option<Candidate> {
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
    let mut best: Option<Candidate> = None;
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
            if seen.len() < TUBES.min_points {
                return best;
            }
            tube.axis = fit_axis(&seen)?;
            turn(&mut tube);
            let middle = median(&mut seen.iter().map(|s| s[3]).collect::<Vec<_>>());
            reach = (TUBES.within * middle).min(1.4 * middle + 5.0 * cut.sigma);
        }
        let Some(raw) = accept(cut, found, &tube, reach) else { break };
        let rms = raw.tube.mean_radius;
        let bent = [-1.0, 1.0].iter().any(|&s| slope(&tube, s) > TUBES.max_slope);
        if bent && best.is_some() {
            break;
        }
        let full = tube.half_length >= TUBES.longest * rms;
        best = Some(raw);
        if full || bent {
            break;
        }
        tube.half_length *= TUBES.growth;
        for q in &mut tube.axis {
            for (k, c) in q.iter_mut().enumerate() {
                *c *= TUBES.growth.powi(k as i32);
            }
        }
    }
    best.filter(|b| {
        let long = b.tube.half_length >= TUBES.shortest * b.tube.mean_radius;
        long && b.members.len() >= TUBES.min_points && !are_clumps(b, points)
    })
}

/// Whether the points are clumps of strays rather than a tube.
fn are_clumps(candidate: &Candidate, points: &[Vec3]) -> bool {
    let Candidate { tube, members, .. } = candidate;
    let place = |&m: &u32| {
        let foot = tube.foot(points[m as usize]);
        (foot.s, foot.d)
    };
    let (along, distances): (Vec<f64>, Vec<f64>) = members.iter().map(place).unzip();
    clumps_gain(&along, &distances, tube.half_length) > 0.0
}

fn frame(along: Vec3) -> [Vec3; 3] {
    let (a, _) = along.tangents();
    // Monge::frame gives the given direction third.
    let [e1, e2, n] = Monge::frame(along, a);
    [n, e1, e2]
}

fn slope(tube: &Tube, s: f64) -> f64 {
    let c1 = tube.axis_at(s).first;
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

/// Turns the frame to the axis's tangent in the middle and moves its origin there. The cubics follow to first
/// order; the next fit settles them.
fn turn(tube: &mut Tube) {
    let CurvePoint { position: c, first: c1, .. } = tube.axis_at(0.0);
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
fn accept(cut: &Cut<'_>, found: &[Neighbour], tube: &Tube, reach: f64) -> Option<Candidate> {
    let Cut { points, sampling, .. } = *cut;
    let (mut inside, mut outside, mut sums) = ([0usize; BINS], [0usize; BINS], [0.0; BINS]);
    let (mut first, mut second, mut square) = ([0.0; 2], [0.0; 2], 0.0);
    let (mut along, mut along2, mut distance_along) = (0.0, 0.0, 0.0);
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
            along += l.s;
            along2 += l.s * l.s;
            distance_along += l.s * l.d;
            members.push(f.index);
            spacings.push(f64::from(sampling.spacing[f.index as usize]));
        } else if l.d <= 1.5 * reach {
            outside[bin] += 1;
        }
    }
    let n = members.len() as f64;
    if members.len() < TUBES.min_points {
        return None;
    }
    let typical = *inside.iter().max()? as f64;
    let crowded = outside.iter().any(|&o| o as f64 > TUBES.crowded * typical);
    let rms = (square / n).sqrt();
    let spacing = median(&mut spacings);
    let sided =
        first[0].hypot(first[1]) > TUBES.one_side * n || second[0].hypot(second[1]) > TUBES.two_sides * n;
    // The radius may vary along a tube, but not beyond recognition from a cone's.
    let mean = sums.iter().sum::<f64>() / n;
    let taper = (distance_along - along * mean) / (along2 - along * along / n).max(f64::MIN_POSITIVE);
    let cone = |bin: usize| {
        let s = (bin as f64 + 0.5) * (2.0 / BINS as f64) - 1.0;
        (mean + taper * (s - along / n)).max(cut.sigma)
    };
    let uneven = inside
        .iter()
        .zip(&sums)
        .enumerate()
        .filter(|(_, (c, _))| **c as f64 > 0.2 * typical)
        .any(|(bin, (&c, s))| !(0.6..1.7).contains(&(s / c as f64 / cone(bin))));
    let line = || {
        let distances: Vec<f64> = members.iter().map(|&m| tube.foot(points[m as usize]).d).collect();
        circle_gain(&distances) < TUBES.circle_gain
    };
    if crowded || sided || uneven || (rms < TUBES.thick * spacing && line()) {
        return None;
    }
    members.sort_unstable();
    Some(Candidate { tube: Tube { mean_radius: rms, ..tube.clone() }, members, mean, spacing })
}
