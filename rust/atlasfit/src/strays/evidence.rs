//! How much likelier the points about a place are on a sheet than as strays.
//!
//! In: points, their search tree, a chart or a place. Out: the logarithm of the ratio of the two marginal
//! likelihoods, in nats. Strays know no direction: across the sheet they spread as far as along it.

use super::constants::STRAYS;
use crate::atlas::Monge;
use crate::numeric::dense::principal;
use crate::numeric::robust::TUKEY;
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::spatial::Neighbours;
use crate::spatial::neighbours::Neighbour;
use std::f64::consts::TAU;

/// Noise so small that no length can be divided by it.
const LEAST_SIGMA: f64 = 1e-12;
/// Rounds in which the share of strays in a window is found.
const SHARE_ROUNDS: usize = 20;

/// A chart as it is looked at.
#[derive(Clone, Copy)]
pub(super) struct Sheet<'a> {
    /// Its map.
    pub map: &'a Monge,
    /// Its noise.
    pub sigma: f64,
    /// Spacing of its points.
    pub spacing: f64,
}

/// The evidence for a sheet: the heights over it of the points that `counts` are a mixture of its noise and
/// of strays.
pub(super) fn of_sheet(
    points: &[Vec3],
    tree: &Neighbours,
    sheet: &Sheet<'_>,
    counts: impl Fn(u32) -> bool,
    found: &mut Vec<Neighbour>,
) -> f64 {
    let Sheet { map, spacing, .. } = *sheet;
    let sigma = sheet.sigma.max(LEAST_SIGMA);
    let window = (STRAYS.window * sigma).max(STRAYS.window_spacings * spacing);
    let radii = map.radii.map(|r| r.min(window));
    let narrow = radii[0].min(radii[1]);
    let reach = narrow.max(TUKEY * sigma);
    tree.within(map.center, radii[0].max(radii[1]).hypot(reach), found);
    found.retain(|f| counts(f.index));
    let step = found.len().div_ceil(STRAYS.most).max(1);
    let over: Vec<[f64; 3]> = found
        .iter()
        .step_by(step)
        .filter_map(|f| {
            let l = map.local(points[f.index as usize]);
            let (x, y) = (l.u * map.radii[0], l.v * map.radii[1]);
            if (x / radii[0]).powi(2) + (y / radii[1]).powi(2) > 1.0 {
                return None;
            }
            let surface = map.height_normal(l.u, l.v);
            let height = (l.z - surface.height) * surface.cos;
            (height.abs() <= reach).then_some([x, y, height])
        })
        .collect();
    let half = reach.min(as_far_as_along(&over));
    // Ratio of the densities of a point of the sheet and of a stray.
    let peak = 2.0 * half / (TAU.sqrt() * sigma);
    let ratio: Vec<f64> = over
        .iter()
        .filter(|p| p[2].abs() <= half)
        .map(|p| peak * (-0.5 * (p[2] / sigma).powi(2)).exp())
        .collect();
    if ratio.is_empty() {
        return 0.0;
    }
    let stray = share_of_strays(&ratio);
    let data: f64 = ratio.iter().map(|r| (stray + (1.0 - stray) * r).ln()).sum();
    let on = ratio.len() as f64 * (1.0 - stray);
    (data - cost_of_a_quadric(on, half / sigma, PARTITION.curved * narrow / sigma)) * step as f64
}

/// Half the height up to which points spread evenly are as widely scattered as they are along the sheet.
fn as_far_as_along(over: &[[f64; 3]]) -> f64 {
    let n = over.len().max(1) as f64;
    let variance = |k: usize| {
        let mean = over.iter().map(|p| p[k]).sum::<f64>() / n;
        over.iter().map(|p| (p[k] - mean).powi(2)).sum::<f64>() / n
    };
    (1.5 * (variance(0) + variance(1))).sqrt()
}

/// The share of strays that makes the points likeliest.
fn share_of_strays(ratio: &[f64]) -> f64 {
    let mut share = 0.5;
    for _ in 0..SHARE_ROUNDS {
        let sum: f64 = ratio.iter().map(|r| share / (share + (1.0 - share) * r)).sum();
        share = (sum / ratio.len() as f64).clamp(1e-6, 1.0);
    }
    share
}

/// What a quadric fitted to `n` points costs: each coefficient half the logarithm of how much the points
/// narrow it down (the Occam factor; MacKay 1992). Offset and slopes may be anything within `half`, curvature
/// within `curved`, both in standard deviations of the noise; the mean squares of the terms are those on a
/// disk.
fn cost_of_a_quadric(n: f64, half: f64, curved: f64) -> f64 {
    let cost = |width: f64, mean_square: f64| 0.5 * (n * mean_square * width * width).ln_1p();
    let even = half / 3f64.sqrt();
    cost(even, 1.0) + 2.0 * cost(even, 0.25) + 3.0 * cost(curved, 1.0 / 12.0)
}

/// What it costs, in nats, that the noise is `sigma` here and `usual` elsewhere in the scan. Less noise costs
/// nothing.
pub(super) fn cost_of_noise(sigma: f64, usual: f64) -> f64 {
    0.5 * ((sigma / usual.max(LEAST_SIGMA)).ln().max(0.0) / STRAYS.noise_varies).powi(2)
}

/// The evidence that points about a place lie in a flat slab, several times as thick as the noise `sigma`:
/// two sheets close together that cannot be told apart.
pub(super) fn of_slab(
    points: &[Vec3],
    tree: &Neighbours,
    place: Vec3,
    sigma: f64,
    found: &mut Vec<Neighbour>,
) -> f64 {
    let sigma = sigma.max(LEAST_SIGMA);
    let mut best = f64::NEG_INFINITY;
    for k in 1..=STRAYS.slabs {
        tree.within(place, STRAYS.window * sigma * STRAYS.thicker.powi(k), found);
        if found.len() < PARTITION.min_members {
            continue;
        }
        let step = found.len().div_ceil(STRAYS.most).max(1);
        let few = found.iter().step_by(step).map(|f| (points[f.index as usize], 1.0));
        let Some(spread) = principal(few.clone()) else { continue };
        let n = few.count() as f64;
        // Strays may spread along one direction more than along the others.
        let [across, along, _] = spread.variances;
        let thick = across.max(0.0).sqrt().max(sigma);
        let half = (3.0 * along).sqrt();
        let data = n * ((2.0 * half / (TAU.sqrt() * thick)).ln() - 0.5);
        let cost = 1.5 * (n * (half / thick).powi(2) / 3.0).ln_1p();
        best = best.max(data - cost - cost_of_noise(thick, sigma));
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use crate::run::Run;

    fn flat(radius: f64) -> Monge {
        Monge {
            center: Vec3::ZERO,
            axes: [Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.0, 0.0, 1.0])],
            radii: [radius; 2],
            coeffs: Box::new([0.0; crate::numeric::spline::COEFFS]),
            mask: crate::atlas::mask::Mask::build(&[], [radius; 2], 1.0),
        }
    }
    fn for_sheet(points: &[Vec3], sigma: f64, radius: f64) -> f64 {
        let tree = Run::default().execute(|ctx| Neighbours::build(points, ctx)).unwrap();
        let sheet = Sheet { map: &flat(radius), sigma, spacing: radius / 6.0 };
        of_sheet(points, &tree, &sheet, |_| true, &mut Vec::new())
    }
    /// Points scattered by these standard deviations along x, y and z.
    fn cloud(n: usize, spread: [f64; 3]) -> Vec<Vec3> {
        let mut rng = Rng::new(3);
        (0..n).map(|_| Vec3(spread.map(|s| s * rng.normal()))).collect()
    }

    #[test]
    fn a_sheet_has_evidence_that_grows_with_its_points_and_a_clump_has_none() {
        let few = for_sheet(&cloud(30, [0.5, 0.5, 0.05]), 0.05, 1.0);
        let many = for_sheet(&cloud(300, [0.5, 0.5, 0.05]), 0.05, 1.0);
        assert!(few > 0.0 && many > 5.0 * few, "{few} {many}");
        for sigma in [0.05, 0.2, 0.5] {
            let clump = for_sheet(&cloud(300, [0.5; 3]), sigma, 1.0);
            assert!(clump < 0.0, "{sigma}: {clump}");
        }
    }
    #[test]
    fn a_handful_of_points_is_no_evidence_as_a_quadric_goes_through_any() {
        let few = for_sheet(&cloud(7, [0.5, 0.5, 0.001]), 0.05, 1.0);
        assert!(few < 5.0, "{few}");
    }
    #[test]
    fn a_slab_of_two_sheets_is_known_and_a_ball_is_not() {
        let slab: Vec<Vec3> = cloud(600, [0.5, 0.5, 0.02])
            .into_iter()
            .enumerate()
            .map(|(i, p)| p + Vec3([0.0, 0.0, if i % 2 == 0 { 0.03 } else { -0.03 }]))
            .collect();
        let ball = cloud(600, [0.1; 3]);
        let slab_and_ball = [slab, ball].map(|points| {
            let tree = Run::default().execute(|ctx| Neighbours::build(&points, ctx)).unwrap();
            of_slab(&points, &tree, Vec3::ZERO, 0.02, &mut Vec::new())
        });
        assert!(slab_and_ball[0] > 20.0 && slab_and_ball[1] < 0.0, "{slab_and_ball:?}");
    }
}
