//! Noise that differs from place to place: with range, angle and surface.
//!
//! In: neighbourhoods about a sample of the points. Out: the noise at each point, as a multiple of the usual,
//! where some part of the scan is clearly noisier or calmer.

use super::constants::NOISE;
use super::estimate::{LocalNoise, Looked, growth, least};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::run::Context;
use crate::spatial::Neighbours;
use rayon::prelude::*;

/// The noise at each point, as a multiple of the `usual`; empty where the usual noise explains all parts.
/// `spacing` is the median.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn relative(
    looked: &Looked<'_>,
    points: &[Vec3],
    usual: &LocalNoise,
    spacing: f64,
    ctx: &Context<'_>,
) -> Result<Vec<f32>> {
    if !usual.shows_surface {
        return Ok(Vec::new());
    }
    let (usual, floor) = (usual.sigma, NOISE.floor * spacing);
    let most = (NOISE.most * spacing).max(usual);
    // Samples whose neighbourhoods share points say no more together than one.
    let step = points.len().div_ceil(looked.at.len().max(1));
    let together = NOISE.together.max(NOISE.together * NOISE.scales[0].0 / step);
    let places: Vec<Vec3> = looked.at.iter().map(|&i| points[i]).collect();
    let tree = Neighbours::build(&places, ctx)?;
    let about = |found: &mut Vec<_>, &p: &Vec3| {
        ctx.check()?;
        tree.nearest(p, together, found);
        let readings = looked.readings(found.iter().map(|f| f.index as usize));
        let ratio = least(&readings).map_or(1.0, |here| here.clamp(floor, most) / usual.max(floor));
        let steepest = if ratio > 1.0 { NOISE.grows } else { NOISE.follows };
        Ok(if growth(&readings, looked.sizes) < steepest { ratio } else { 1.0 })
    };
    let ratios: Vec<f64> = places.par_iter().map_init(Vec::new, about).collect::<Result<_>>()?;
    if ratios.iter().all(|&r| usual_explains(r)) {
        return Ok(Vec::new());
    }
    let of_place = |&place: &u32| {
        let ratio = ratios[place as usize];
        if usual_explains(ratio) { 1.0 } else { ratio as f32 }
    };
    Ok(tree.nearest_of(points, ctx)?.iter().map(of_place).collect())
}

/// Whether the usual noise explains that of a place, `ratio` times as large.
fn usual_explains(ratio: f64) -> bool {
    (NOISE.calm..=PARTITION.explained).contains(&ratio)
}

/// Lets places keep their noise where the usual noise has turned out to be `share` of what it was thought to
/// be: calm ones what they were thought to have, noisier ones the share `noisier` of that.
pub(crate) fn ease(relative: &mut [f32], share: f64, noisier: f64) {
    let share = share.min(1.0);
    for ratio in relative.iter_mut().filter(|r| **r != 1.0) {
        let was = f64::from(*ratio);
        let eased = if was < 1.0 { (was / share).min(1.0) } else { was * (noisier / share).max(1.0) };
        *ratio = if usual_explains(eased) { 1.0 } else { eased as f32 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::noise::estimate;
    use crate::numeric::rng::Rng;

    /// A bumpy sheet of 100 by 100 points a unit apart, with noise that depends on the place.
    fn sheet(noise: impl Fn(f64) -> f64) -> Vec<Vec3> {
        let mut rng = Rng::new(3);
        let mut at = |i: u32| {
            let [x, y] = [i % 100, i / 100].map(|k| f64::from(k) + 0.5 * rng.normal());
            Vec3([x, y, (0.1 * x).sin() + noise(x) * rng.normal()])
        };
        (0..10_000).map(&mut at).collect()
    }

    fn relative_noise(points: &[Vec3]) -> Vec<f32> {
        let found = Run::default().execute(|ctx| {
            let tree = Neighbours::build(points, ctx)?;
            let looked = estimate::look(points, &tree, ctx)?;
            let usual = estimate::noise(points, &tree, &looked, ctx)?;
            relative(&looked, points, &usual, 1.0, ctx)
        });
        found.unwrap()
    }

    #[test]
    fn even_noise_is_the_same_everywhere() {
        assert!(relative_noise(&sheet(|_| 0.3)).is_empty());
    }

    #[test]
    fn a_side_with_four_times_the_noise_is_said_to_have_it() {
        let points = sheet(|x| if x > 65.0 { 0.4 } else { 0.1 });
        let found = relative_noise(&points);
        for (p, r) in points.iter().zip(found).filter(|(p, _)| (p[0] - 65.0).abs() > 20.0) {
            let true_ratio = if p[0] > 65.0 { 4.0 } else { 1.0 };
            assert!((f64::from(r) / true_ratio - 1.0).abs() < 0.3, "{r} instead of {true_ratio} at {p:?}");
        }
    }

    #[test]
    fn what_a_quadric_cannot_follow_is_no_noise() {
        // A wave of ten points on one side.
        let ripple = |x: f64| if x > 65.0 { (x * std::f64::consts::TAU / 10.0).sin() } else { 0.0 };
        let mut points = sheet(|_| 0.1);
        points.iter_mut().for_each(|p| p.0[2] += ripple(p[0]));
        assert!(relative_noise(&points).iter().all(|&r| r <= 1.0));
    }

    #[test]
    fn places_keep_their_noise_when_the_usual_falls() {
        let eased = |noisier: f64| {
            let mut relative = vec![1.0, 3.0, 0.4, 0.2];
            ease(&mut relative, 0.5, noisier);
            relative
        };
        assert_eq!(eased(1.0), [1.0, 6.0, 1.0, 0.4]);
        assert_eq!(eased(0.4), [1.0, 3.0, 1.0, 0.4]);
    }
}
