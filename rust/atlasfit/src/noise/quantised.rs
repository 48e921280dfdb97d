//! Depth in steps: whether a scan's points lie on stacks of parallel planes, as a depth camera's rounding
//! puts them, and what to make of that.
//!
//! In: points and their search tree. Out: where the points lie between the steps, if levels show where they
//! end ([`between`]); else, of a single stack, the standard deviation of the noise along the surface's normal
//! at each point. Steps are wider than neighbourhoods, so that these look like clean planes: an estimate from
//! neighbourhoods finds no noise, and the surface becomes stairs. What the sensor errs before it rounds is
//! seen only across several steps.

use super::between::{self, Between};
use super::constants::NOISE;
use super::estimate::quadric;
use super::stack::{self, Stacks};
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use rayon::prelude::*;

/// What is known of depth in steps.
pub(crate) enum Rounded {
    /// Nothing: the points are on no stacks of planes.
    No,
    /// They have so much noise, each, along the normal, standard deviation.
    Noisy(Vec<f32>),
    /// Where each lies between its steps.
    Between(Between),
}

/// Whether depth is rounded to steps. `spacing` is that of each point. Points are put between steps only
/// where the scan is `whole`: what a part of it shows of the steps, another part may not.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn look(
    points: &[Vec3],
    tree: &Neighbours,
    spacing: &[f32],
    whole: bool,
    ctx: &Context<'_>,
) -> Result<Rounded> {
    let Some(Stacks { most, levels }) = stack::find(points, tree, ctx)? else { return Ok(Rounded::No) };
    if whole && let Some(between) = between::steps(points, tree, levels, ctx)? {
        return Ok(Rounded::Between(between));
    }
    Ok(noise(points, tree, spacing, most, ctx)?.map_or(Rounded::No, Rounded::Noisy))
}

/// The noise at each point along the normal, standard deviation; nothing where the points are not on a stack
/// of planes. `spacing` is that of each point.
///
/// # Errors
/// Cancelled or out of time.
fn noise(
    points: &[Vec3],
    tree: &Neighbours,
    spacing: &[f32],
    direction: Vec3,
    ctx: &Context<'_>,
) -> Result<Option<Vec<f32>>> {
    let Some(steps) = stack::steps(points, direction, ctx)? else { return Ok(None) };
    let wide = steps.iter().zip(spacing).map(|(s, p)| s / f64::from(*p));
    if median(&mut wide.collect::<Vec<_>>()) < NOISE.step_seen {
        return Ok(None);
    }
    let places = places(points, tree, direction, &steps, ctx)?;
    if !are_rounded(&places) {
        return Ok(None);
    }
    let noise = nearby(points, &places, ctx)?;
    Ok(noise.iter().all(|&s| s > 0.0).then_some(noise))
}

/// What a neighbourhood of several steps says.
struct Place {
    at: Vec3,
    /// The normal of the plane through it.
    normal: Vec3,
    /// What the neighbourhood leaves of a quadric, standard deviation along the normal.
    residual: f64,
    /// What rounding leaves of a surface with this normal: a step over the root of twelve along it.
    rounding: f64,
    /// The cosine of the normal with the direction that the planes are across.
    along: f64,
}

/// Looks at a sample of places.
fn places(
    points: &[Vec3],
    tree: &Neighbours,
    direction: Vec3,
    steps: &[f64],
    ctx: &Context<'_>,
) -> Result<Vec<Place>> {
    let apart = points.len().div_ceil(NOISE.samples).max(1);
    let at: Vec<usize> = (0..points.len()).step_by(apart).collect();
    let look = |found: &mut Vec<Neighbour>, &i: &usize| {
        ctx.check()?;
        tree.within(points[i], NOISE.steps_across * steps[i], found);
        if found.len() < NOISE.points_across {
            tree.nearest(points[i], NOISE.points_across, found);
        }
        found.truncate(NOISE.largest);
        Ok(quadric(points, found).map(|q| {
            let along = q.normal.dot(direction).abs();
            let rounding = along * steps[i] / 12f64.sqrt();
            Place { at: q.mean, normal: q.normal, residual: q.residual, rounding, along }
        }))
    };
    let places: Vec<Option<Place>> = at.par_iter().map_init(Vec::new, look).collect::<Result<_>>()?;
    Ok(places.into_iter().flatten().collect())
}

/// Whether the planes are from rounding: columns of a regular grid lie on planes too, but a slanted surface
/// through them is smooth. Surfaces along the direction say nothing, nor do those across it that show a
/// neighbourhood one plane, unless there are no others.
fn are_rounded(places: &[Place]) -> bool {
    let slanted = places.iter().filter(|p| (NOISE.slants.0..NOISE.slants.1).contains(&p.along));
    let mut of_rounding: Vec<f64> = slanted.map(|p| p.residual / p.rounding).collect();
    if of_rounding.is_empty() {
        return places.iter().any(|p| p.along >= NOISE.slants.1);
    }
    median(&mut of_rounding) > NOISE.rounded
}

impl Place {
    /// The noise along the normal, never less than the rounding itself.
    fn noise(&self) -> f64 {
        self.residual.max(self.rounding)
    }
    /// Whether `p` lies on the same surface, as far as noise lets it be told.
    fn holds(&self, p: Vec3) -> bool {
        (p - self.at).dot(self.normal).abs() <= NOISE.on_place * self.noise()
    }
}

/// The noise at each point: the median of places near by on the same surface. The wall of a room may have ten
/// times the noise of its floor.
fn nearby(points: &[Vec3], places: &[Place], ctx: &Context<'_>) -> Result<Vec<f32>> {
    let at: Vec<Vec3> = places.iter().map(|p| p.at).collect();
    let tree = Neighbours::build(&at, ctx)?;
    let on_surface = |found: &mut Vec<Neighbour>, p: Vec3| {
        tree.nearest(p, NOISE.together, found);
        found.iter().map(|f| f.index as usize).filter(|&k| places[k].holds(p)).collect::<Vec<_>>()
    };
    let about = |found: &mut Vec<Neighbour>, place: &Place| {
        ctx.check()?;
        let mut noise: Vec<f64> =
            on_surface(found, place.at).into_iter().map(|k| places[k].noise()).collect();
        Ok(median(&mut noise))
    };
    let noise: Vec<f64> = places.par_iter().map_init(Vec::new, about).collect::<Result<_>>()?;
    let of_point = |found: &mut Vec<Neighbour>, &p: &Vec3| {
        ctx.check()?;
        let on = on_surface(found, p);
        let nearest = on.first().copied().unwrap_or(found[0].index as usize);
        Ok(noise[nearest] as f32)
    };
    points.par_iter().map_init(Vec::new, of_point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use crate::run::Run;

    /// The noise found on points of a unit square, or on as many of a surface of that size.
    fn of(points: &[Vec3]) -> Option<Vec<f32>> {
        let spacing = vec![(1.0 / points.len() as f32).sqrt(); points.len()];
        Run::default()
            .execute(|ctx| {
                let tree = Neighbours::build(points, ctx)?;
                let Some(found) = stack::find(points, &tree, ctx)? else { return Ok(None) };
                noise(points, &tree, &spacing, found.most, ctx)
            })
            .unwrap()
    }

    /// A slanted wavy sheet.
    fn height(x: f64, y: f64) -> f64 {
        0.5 * x + 0.1 * (5.0 * y).sin()
    }

    /// The sheet seen along `axis` by a sensor that errs by `jitter` and rounds depth to `step`, both in
    /// units of length; what its noise is along the normal at each point.
    fn seen(axis: Vec3, step: f64, jitter: f64) -> Vec<(Vec3, f64)> {
        let (u, v) = axis.tangents();
        let mut rng = Rng::new(5);
        (0..8000)
            .map(|_| {
                let (x, y) = (rng.uniform(), rng.uniform());
                let z = ((height(x, y) + jitter * rng.normal()) / step).round() * step;
                let along = 1.0 / (1.0 + 0.25 + (0.5 * (5.0 * y).cos()).powi(2)).sqrt();
                (u * x + v * y + axis * z, along * (step * step / 12.0 + jitter * jitter).sqrt())
            })
            .collect()
    }

    /// The largest factor by which the noise is missed, but for one in twenty points.
    fn missed_by(seen: &[(Vec3, f64)]) -> f64 {
        let points: Vec<Vec3> = seen.iter().map(|s| s.0).collect();
        let found = of(&points).expect("rounded");
        let mut factors: Vec<f64> =
            seen.iter().zip(found).map(|(s, f)| (f64::from(f) / s.1).ln().abs().exp()).collect();
        factors.sort_by(f64::total_cmp);
        factors[factors.len() * 19 / 20]
    }

    const ASKEW: Vec3 = Vec3([0.3, -0.5, 0.8]);

    #[test]
    fn rounded_depth_is_known_by_its_step_whatever_the_direction() {
        for axis in [Vec3([0.0, 0.0, 1.0]), ASKEW.normalized()] {
            let seen = seen(axis, 0.02, 0.0);
            let points: Vec<Vec3> = seen.iter().map(|s| s.0).collect();
            let steps = Run::default().execute(|ctx| {
                let tree = Neighbours::build(&points, ctx)?;
                let found = stack::find(&points, &tree, ctx)?.expect("a stack");
                stack::steps(&points, found.most, ctx)
            });
            let steps = steps.unwrap().expect("steps");
            assert!(steps.iter().all(|&s| (s / 0.02 - 1.0).abs() < 0.01), "{axis:?}");
            let factor = missed_by(&seen);
            assert!(factor < 1.25, "{factor} along {axis:?}");
        }
    }
    #[test]
    fn what_the_sensor_errs_before_it_rounds_counts_too() {
        for axis in [Vec3([0.0, 0.0, 1.0]), ASKEW.normalized()] {
            let factor = missed_by(&seen(axis, 0.02, 0.01));
            assert!(factor < 1.25, "{factor} along {axis:?}");
        }
    }
    /// A slanted wall in the pixels of a camera that looks askew and measures the inverse of the depth, with
    /// an error of 0.4 steps; what its noise is along the normal at each point.
    fn pictured(step: Option<f64>) -> Vec<(Vec3, f64)> {
        let forward = ASKEW.normalized();
        let (right, up) = forward.tangents();
        let mut rng = Rng::new(8);
        let pixel = |k: u32| [k % 90, k / 90].map(|i| (f64::from(i) - 44.5) / 90.0);
        (0..8100)
            .map(pixel)
            .map(|[x, y]| {
                let ray = forward + right * x + up * y;
                // The wall is where depth + x = 1.
                let depth = 1.0 / (1.0 + x);
                let rounded = |s: f64| 1.0 / ((1.0 / (s * depth) + 0.4 * rng.normal()).round() * s);
                let along = (1.0 + x) / 2f64.sqrt();
                let noise = step.map_or(0.0, |s| along * s * depth * depth * (1.0f64 / 12.0 + 0.16).sqrt());
                (ray * step.map_or(depth, rounded), noise)
            })
            .collect()
    }

    #[test]
    fn a_camera_has_steps_hardly_wider_than_its_pixels_and_its_rows_of_pixels_are_none() {
        for step in [0.012, 0.03] {
            let factor = missed_by(&pictured(Some(step)));
            assert!(factor < 1.35, "{factor}, steps of {step}");
        }
        let clean: Vec<Vec3> = pictured(None).into_iter().map(|p| p.0).collect();
        assert!(of(&clean).is_none());
    }
    #[test]
    fn each_surface_of_a_corner_has_its_own_noise() {
        // A wall across the view and a floor along it: the same error in depth moves few points off the
        // floor.
        let (step, mut rng) = (0.02, Rng::new(7));
        let mut seen: Vec<(Vec3, f64)> = Vec::new();
        for k in 0..12_000 {
            let (x, y) = (rng.uniform(), rng.uniform());
            let floor = k % 2 == 0;
            let (height, depth, slope) =
                if floor { (0.1 * y, y, 10.0) } else { (0.1 + y, 1.0 + 0.3 * y, 0.3) };
            let z = ((depth + 0.5 * step * rng.normal()) / step).round() * step;
            let noise = step * (1.0f64 / 12.0 + 0.25).sqrt() / 1f64.hypot(slope);
            seen.push((Vec3([x, height, z]), noise));
        }
        let factor = missed_by(&seen);
        assert!(factor < 2.0, "{factor}");
    }
    #[test]
    fn clean_sheets_boxes_and_grids_are_not_rounded() {
        let (u, v) = ASKEW.normalized().tangents();
        let mut rng = Rng::new(6);
        let sheet: Vec<Vec3> = (0..8000)
            .map(|_| (rng.uniform(), rng.uniform()))
            .map(|(x, y)| u * x + v * y + ASKEW.normalized() * height(x, y))
            .collect();
        assert!(of(&sheet).is_none());
        let cube: Vec<Vec3> = (0..6000)
            .map(|i| {
                let mut p = Vec3::from_fn(|_| rng.uniform());
                p.0[i % 3] = f64::from(i as u32 / 3 % 2);
                p
            })
            .collect();
        assert!(of(&cube).is_none());
        let grid: Vec<Vec3> = (0..10_000)
            .map(|i| [i % 100, i / 100].map(|k| f64::from(k) / 100.0))
            .map(|[x, y]| Vec3([x, y, 2.0 * height(x, y)]))
            .collect();
        assert!(of(&grid).is_none());
        let plane: Vec<Vec3> = grid.iter().map(|p| Vec3([p[0], p[1], 0.3])).collect();
        assert!(of(&plane).is_none());
        let mut rng = Rng::new(9);
        let noisy: Vec<Vec3> = plane.iter().map(|p| Vec3([p[0], p[1], 0.001 * rng.normal()])).collect();
        assert!(of(&noisy).is_none());
    }
}
