//! Where the one scanner stood that measured a scan, if there was only one.
//!
//! In: points on the atlas and their spacing. Out: the scanner's position, or nothing. A scanner that turns,
//! and a depth camera, send rays that are evenly spread in angle: a point at distance r, where the surface
//! leans by an angle whose cosine is c, then stands for an area of about r² / c. An object seen from all
//! sides is sampled evenly by area instead. Which of the two the spacings fit better is decided by
//! likelihood; and one scanner sees only what faces it.

use super::constants::ORIENT;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::dense::{cholesky, cholesky_solve};
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// A point as the search sees it.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Logarithm of the area that it stands for.
    pub(super) log_area: f64,
}

/// A scanner that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Found {
    /// Where it stood.
    pub(crate) at: Vec3,
    /// Whether nearly all points face it, each part turned as a whole. If not, there may be others.
    pub(crate) all_face: bool,
}

/// The scanner's position in the normalised frame (the scan's longest side is 1, its middle the origin).
/// `part` names the connected part of the surface that each chart is of: a part's normals agree among
/// themselves, but the part as a whole may face either way. `origin` is the origin of the user's frame, where
/// scanners often stand.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn find_scanner(
    projected: &[ProjectedPoint],
    spacing: &[f32],
    part: &[u32],
    origin: Vec3,
    ctx: &Context<'_>,
) -> Result<Option<Found>> {
    let stride = projected.len().div_ceil(ORIENT.scanner_sample).max(1);
    let sampled = (0..projected.len()).step_by(stride).filter(|&i| projected[i].chart != u32::MAX);
    let seen: Vec<Seen> = sampled
        .map(|i| Seen {
            position: projected[i].position,
            normal: projected[i].normal,
            log_area: 2.0 * f64::from(spacing[i]).ln(),
        })
        .collect();
    if seen.is_empty() {
        return Ok(None);
    }
    // A few points tell good starts from bad ones.
    let few: Vec<Seen> = seen.iter().step_by(ORIENT.scanner_few).copied().collect();
    let best_of = |places: Vec<Place>, n: usize| {
        let mut places = places;
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        places.truncate(n);
        places
    };
    let begun = best_of(starts(origin).map(|v| (misfit(&few, v), v)).collect(), ORIENT.starts_followed[0]);
    let rough = begun.par_iter().map(|p| descend(&few, p.1, ctx)).collect::<Result<Vec<_>>>()?;
    let rough = best_of(rough, ORIENT.starts_followed[1]);
    let even = deviation(seen.iter().map(|s| s.log_area).collect());
    let explains = |spread: f64, share: f64| spread * spread < (1.0 - share) * even * even;
    // Most scans end here: half of what must be explained in the end is seen with few points.
    if !rough.iter().any(|p| explains(p.0, 0.5 * ORIENT.explained)) {
        return Ok(None);
    }
    let found = rough.par_iter().map(|p| descend(&seen, p.1, ctx)).collect::<Result<Vec<_>>>()?;
    let Some(&best) = best_of(found, 1).first() else { return Ok(None) };
    let (spread, scanner) = best;
    let measured = (projected.len() as f64 / ORIENT.shared).min(seen.len() as f64);
    // The logarithm of how much likelier the scan is with this scanner than with a density that only falls
    // along some direction: its spacings (Laplace's distribution, whose scale is the mean absolute deviation;
    // both have three parameters). That points face it speaks for nothing, as they do about any place within
    // a body; that they do not, speaks against it.
    let facing = facing(projected, part, scanner, stride);
    let faces =
        facing * (2.0 - 2.0 * ORIENT.turned_away).ln() + (1.0 - facing) * (2.0 * ORIENT.turned_away).ln();
    let gain = measured * ((falling(&seen) / spread.max(1e-12)).ln() + faces.min(0.0));
    let found = Found { at: scanner, all_face: facing >= 1.0 - ORIENT.turned_away };
    Ok((explains(spread, ORIENT.explained) && gain > 0.0).then_some(found))
}

/// Where the search begins: the origin of the user's frame, the middle, and points about it.
fn starts(origin: Vec3) -> impl Iterator<Item = Vec3> {
    let directions = (0..27).map(|k| Vec3([k % 3, k / 3 % 3, k / 9].map(|x| f64::from(x) - 1.0)));
    let about =
        directions.filter(|d| *d != Vec3::ZERO).flat_map(|d| ORIENT.starts.map(|r| d.normalized() * r));
    let near = origin.norm() < 10.0;
    near.then_some(origin).into_iter().chain([Vec3::ZERO]).chain(about)
}

/// Mean absolute deviation from the median.
pub(super) fn deviation(mut values: Vec<f64>) -> f64 {
    let middle = median(&mut values);
    values.iter().map(|v| (v - middle).abs()).sum::<f64>() / values.len() as f64
}

/// How badly a density that falls evenly along some direction explains the spacings: mean absolute deviation
/// of the logarithm of the area that each point stands for, from its linear fit over space.
pub(super) fn falling(seen: &[Seen]) -> f64 {
    let row = |s: &Seen| [1.0, s.position[0], s.position[1], s.position[2]];
    let (mut a, mut b) = ([0.0; 16], [0.0; 4]);
    for s in seen {
        let row = row(s);
        for i in 0..4 {
            (i..4).for_each(|j| a[i * 4 + j] += row[i] * row[j]);
            b[i] += row[i] * s.log_area;
        }
    }
    // A plane has no extent across: the density is even there.
    (0..4).for_each(|i| a[i * 5] += 1e-9 * seen.len() as f64);
    if cholesky(&mut a, 4) {
        cholesky_solve(&a, 4, &mut b);
    } else {
        b = [0.0; 4];
    }
    let off = |s: &Seen| s.log_area - row(s).iter().zip(&b).map(|(x, b)| x * b).sum::<f64>();
    deviation(seen.iter().map(off).collect())
}

/// How badly a scanner at `v` explains the spacings: mean absolute deviation of the logarithm of the angle
/// that each point stands for.
fn misfit(seen: &[Seen], v: Vec3) -> f64 {
    let angle = |s: &Seen| {
        let ray = v - s.position;
        let r = ray.norm().max(1e-9);
        let cosine = (ray.dot(s.normal).abs() / r).max(ORIENT.least_cosine);
        s.log_area + cosine.ln() - 2.0 * r.ln()
    };
    deviation(seen.iter().map(angle).collect())
}

/// The misfit, and the place that it belongs to.
type Place = (f64, Vec3);

/// The places a step away along each axis, either way.
pub(super) fn compass(at: Vec3, step: f64) -> impl Iterator<Item = Vec3> {
    let along = move |k: usize| Vec3::from_fn(|c| if c == k / 2 { [step, -step][k % 2] } else { 0.0 });
    (0..6).map(move |k| at + along(k))
}

/// Compass search for the least misfit: a step along an axis as long as one helps, half the step when none
/// does.
fn descend(seen: &[Seen], start: Vec3, ctx: &Context<'_>) -> Result<Place> {
    let (mut at, mut least) = (start, misfit(seen, start));
    let mut step = 0.25 * start.norm().max(0.5);
    for _ in 0..ORIENT.most_steps {
        ctx.check()?;
        let next = compass(at, step).map(|v| (misfit(seen, v), v)).min_by(|a, b| a.0.total_cmp(&b.0));
        match next {
            Some((misfit, v)) if misfit < least => (least, at) = (misfit, v),
            _ if step < ORIENT.step_end * at.norm().max(0.5) => break,
            _ => step *= 0.5,
        }
    }
    Ok((least, at))
}

/// Share of the points that face `v` when each part is turned to it as a whole.
fn facing(projected: &[ProjectedPoint], part: &[u32], v: Vec3, stride: usize) -> f64 {
    let mut of_part = std::collections::BTreeMap::<u32, (f64, f64)>::new();
    for p in projected.iter().step_by(stride) {
        if let Some(&part) = part.get(p.chart as usize) {
            let cosine = (v - p.position).normalized().dot(p.normal);
            let sums = of_part.entry(part).or_default();
            sums.0 += cosine;
            sums.1 += cosine.abs();
        }
    }
    let (net, all) = of_part.values().fold((0.0, 0.0), |s, p| (s.0 + p.0.abs(), s.1 + p.1));
    0.5 + 0.5 * net / f64::max(all, 1e-12)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::Run;
    use crate::numeric::Rng;

    /// Where a ray from within a room meets its wall, and the wall's normal, outward.
    pub(in super::super) fn wall(from: Vec3, direction: Vec3) -> (Vec3, Vec3) {
        let half = Vec3([0.5, 0.4, 0.25]);
        let (mut t, mut axis) = (f64::INFINITY, 0);
        for k in 0..3 {
            let hit = (half[k].copysign(direction[k]) - from[k]) / direction[k];
            if hit < t {
                (t, axis) = (hit, k);
            }
        }
        (from + direction * t, Vec3::from_fn(|k| if k == axis { direction[k].signum() } else { 0.0 }))
    }

    /// Points of a room as a scanner at `at` sees it, or evenly by area; with their spacing.
    fn room(at: Option<Vec3>) -> (Vec<ProjectedPoint>, Vec<f32>) {
        let mut rng = Rng::new(3);
        let mut spacing = Vec::new();
        let mut points = Vec::new();
        for _ in 0..3000 {
            let direction = Vec3::from_fn(|_| rng.normal()).normalized();
            let from = at.unwrap_or(Vec3::ZERO);
            let (position, normal) = wall(from, direction);
            let area = if at.is_some() { from.dist2(position) / direction.dot(normal) } else { 1.0 };
            let noise = (0.2 * rng.normal()).exp();
            spacing.push((0.02 * area.sqrt() * noise) as f32);
            points.push(ProjectedPoint { position, normal, chart: 0 });
        }
        (points, spacing)
    }

    fn found(at: Option<Vec3>) -> Option<Vec3> {
        let (points, spacing) = room(at);
        let origin = Vec3([3.0, 0.0, 0.0]);
        Run::default()
            .execute(|ctx| find_scanner(&points, &spacing, &[0], origin, ctx))
            .unwrap()
            .map(|f| f.at)
    }

    #[test]
    fn a_scanner_is_found_by_the_density_of_what_it_saw() {
        let scanner = Vec3([0.2, -0.1, 0.05]);
        let off = found(Some(scanner)).expect("one scanner") - scanner;
        assert!(off.norm() < 0.05, "{off:?}");
    }

    #[test]
    fn an_evenly_sampled_body_has_no_scanner_inside() {
        assert_eq!(found(None), None);
    }
    #[test]
    fn a_body_whose_density_falls_along_a_direction_has_none_either() {
        let mut rng = Rng::new(4);
        let point = |_| {
            // Thirty times as dense at one end as at the other.
            let normal = loop {
                let n = Vec3::from_fn(|_| rng.normal()).normalized();
                if rng.uniform() < 30f64.powf(-0.5 * (n[0] + 1.0)) {
                    break n;
                }
            };
            let spacing = 0.01 * 30f64.powf(0.25 * normal[0]) * (0.2 * rng.normal()).exp();
            (ProjectedPoint { position: normal * 0.5, normal, chart: 0 }, spacing as f32)
        };
        let (points, spacing): (Vec<_>, Vec<_>) = (0..3000).map(point).unzip();
        let origin = Vec3([3.0, 0.0, 0.0]);
        let found = Run::default()
            .execute(|ctx| find_scanner(&points, &spacing, &[0], origin, ctx))
            .unwrap()
            .map(|f| f.at);
        assert_eq!(found, None);
    }
}
