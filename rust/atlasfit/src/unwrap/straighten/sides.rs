//! Long sides of a chart made straight, where it is no rectangle.
//!
//! In: a chart and its border curves. Out: the chart turned so that most of its straight sides lie along the
//! axes, and each of them exactly on a line. Sides are those of a polygon that follows the border (Douglas,
//! Peucker 1973).

use super::border::{chords, distance};
use super::constants::STRAIGHT;
use super::flat::Flat;
use super::goal::Goal;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::flatten::shape::all_positive;
use crate::unwrap::planar::rotated;
use crate::unwrap::surface::{NONE, Surface};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// The chart with its sides on lines along the axes; `None` where too few are straight, or where it is not
/// accepted.
pub(super) fn with_straight_sides(
    s: &Surface,
    c: &Chart,
    curves: &[Vec<u32>],
    goal: Goal,
    ctx: &Context<'_>,
) -> Option<Chart> {
    let unit = c.area.sqrt();
    let mut runs: Vec<Vec<u32>> = curves.iter().flat_map(|curve| polygon(curve, &c.uv, unit)).collect();
    runs.retain(|run| is_straight(run, &c.uv, unit));
    let (sin, cos) = main_direction(&runs, &c.uv)?.sin_cos();
    let flat = Flat::new(s, c);
    let at = flat.small(&rotated(&c.uv, [cos, -sin]));
    let lines = Lines::new(c, curves, runs, &at);
    if lines.share < STRAIGHT.share {
        return None;
    }
    ctx.check().ok()?;
    // What is off the lines gives way softly.
    let pinned: Vec<bool> = lines.of.iter().map(|of| of.iter().any(Option::is_some)).collect();
    let line = |v: usize, k: usize| lines.of[v][k].unwrap_or(at[v][k]);
    let shifts: Vec<[f64; 2]> = (0..at.len()).map(|v| [0, 1].map(|k| line(v, k) - at[v][k])).collect();
    let shifts = flat.harmonic(&at, &pinned, &shifts, ctx)?;
    let mut uv: Vec<[f64; 2]> = (0..at.len())
        .map(|v| [0, 1].map(|k| if pinned[v] { line(v, k) } else { at[v][k] + shifts[v][k] }))
        .collect();
    if !all_positive(&c.tris, &uv) {
        return None;
    }
    let made = goal.accepted(s, c, flat.sized(&uv), ctx);
    if made.is_some() {
        return made;
    }
    let held: Vec<[bool; 2]> = lines.of.iter().map(|of| of.map(|x| x.is_some())).collect();
    flat.relax(&mut uv, &held, ctx)?;
    goal.accepted(s, c, flat.sized(&uv), ctx)
}

/// The coordinates at which vertices are held.
struct Lines {
    of: Vec<[Option<f64>; 2]>,
    /// Share of the border's length that lies on them.
    share: f64,
}

impl Lines {
    /// One for each run along an axis.
    fn new(c: &Chart, curves: &[Vec<u32>], runs: Vec<Vec<u32>>, at: &[[f64; 2]]) -> Self {
        // The coordinate that is the same all along, and the run.
        let mut axial: Vec<(usize, Vec<u32>)> = Vec::new();
        for run in runs {
            let angle = direction(&run, at);
            if off_axis(angle).abs() > STRAIGHT.turned {
                continue;
            }
            axial.push(((angle / FRAC_PI_2).round().rem_euclid(2.0) as usize ^ 1, run));
        }
        // Longest first: of two that share a vertex and an axis the shorter one stays as it is.
        axial.sort_by(|a, b| span(&b.1, at).total_cmp(&span(&a.1, at)).then(a.1.cmp(&b.1)));
        let mut on = vec![[NONE; 2]; at.len()];
        for (i, (k, run)) in axial.iter().enumerate() {
            if run.iter().all(|&v| on[v as usize][*k] == NONE) {
                run.iter().for_each(|&v| on[v as usize][*k] = i as u32);
            }
        }
        let mut good = vec![true; axial.len()];
        chords(c, curves, &on).for_each(|i| good[i as usize] = false);
        let mut of = vec![[None; 2]; at.len()];
        let mut straight = 0.0;
        for (i, (k, run)) in axial.iter().enumerate() {
            if !good[i] || on[run[0] as usize][*k] != i as u32 {
                continue;
            }
            let (mut sum, mut length) = (0.0, 0.0);
            for pair in run.windows(2) {
                let [p, q] = [pair[0], pair[1]].map(|v| at[v as usize]);
                let l = distance(p, q);
                (sum, length) = (sum + 0.5 * l * (p[*k] + q[*k]), length + l);
            }
            run.iter().for_each(|&v| of[v as usize][*k] = Some(sum / length));
            straight += length;
        }
        let all: f64 = (curves.iter())
            .flat_map(|c| (0..c.len()).map(|i| [c[i], c[(i + 1) % c.len()]]))
            .map(|[a, b]| distance(at[a as usize], at[b as usize]))
            .sum();
        Self { of, share: straight / all }
    }
}

/// From its first to its last vertex.
fn span(run: &[u32], at: &[[f64; 2]]) -> f64 {
    distance(at[run[0] as usize], at[run[run.len() - 1] as usize])
}

fn direction(run: &[u32], at: &[[f64; 2]]) -> f64 {
    let [a, b] = [run[0], run[run.len() - 1]].map(|v| at[v as usize]);
    (b[1] - a[1]).atan2(b[0] - a[0])
}

/// The angle from the nearest axis.
fn off_axis(angle: f64) -> f64 {
    (angle + FRAC_PI_4).rem_euclid(FRAC_PI_2) - FRAC_PI_4
}

/// How far a point is from the line through two.
fn off_line(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let d = [b[0] - a[0], b[1] - a[1]];
    let l = d[0].hypot(d[1]);
    if l > 0.0 { ((p[0] - a[0]) * d[1] - (p[1] - a[1]) * d[0]).abs() / l } else { distance(p, a) }
}

fn is_straight(run: &[u32], uv: &[[f64; 2]], unit: f64) -> bool {
    let ends = [run[0], run[run.len() - 1]].map(|v| uv[v as usize]);
    let length = distance(ends[0], ends[1]);
    length >= STRAIGHT.long * unit
        && run.iter().all(|&v| off_line(uv[v as usize], ends) <= STRAIGHT.bent * length)
}

/// The sides of a polygon that follows a closed curve, each with its vertices.
fn polygon(curve: &[u32], uv: &[[f64; 2]], unit: f64) -> Vec<Vec<u32>> {
    let n = curve.len();
    let at = |i: usize| uv[curve[i % n] as usize];
    let farthest = |p: [f64; 2]| {
        (0..n).fold((0, -1.0), |best: (usize, f64), i| {
            let d = distance(p, at(i));
            if d > best.1 { (i, d) } else { best }
        })
    };
    let sum = (0..n).fold([0.0; 2], |sum, i| [sum[0] + at(i)[0], sum[1] + at(i)[1]]);
    let first = farthest(sum.map(|x| x / n as f64)).0;
    let second = farthest(at(first)).0;
    let (low, high) = (first.min(second), first.max(second));
    let mut open = vec![(high, low + n), (low, high)];
    let mut out = Vec::new();
    while let Some((from, to)) = open.pop() {
        let ends = [at(from), at(to)];
        let off = (from + 1..to).map(|i| (i, off_line(at(i), ends)));
        let worst = off.fold((0, -1.0), |best: (usize, f64), o| if o.1 > best.1 { o } else { best });
        if worst.1 > STRAIGHT.off * unit {
            open.push((worst.0, to));
            open.push((from, worst.0));
        } else if to > from {
            out.push((from..=to).map(|i| curve[i % n]).collect());
        }
    }
    out
}

/// The direction that the greatest length of straight sides has, or is square to: radians.
fn main_direction(runs: &[Vec<u32>], uv: &[[f64; 2]]) -> Option<f64> {
    let all: Vec<(f64, f64)> = runs.iter().map(|run| (direction(run, uv), span(run, uv))).collect();
    let near =
        |a: f64| all.iter().map(move |&(b, l)| (off_axis(b - a), l)).filter(|x| x.0.abs() <= STRAIGHT.turned);
    let sum = |a: f64| near(a).map(|x| x.1).sum::<f64>();
    let best = all.iter().map(|&(a, _)| (a, sum(a))).fold((0.0, 0.0), |b, x| if x.1 > b.1 { x } else { b });
    (best.1 > 0.0).then(|| best.0 + near(best.0).map(|(d, l)| d * l).sum::<f64>() / best.1)
}
