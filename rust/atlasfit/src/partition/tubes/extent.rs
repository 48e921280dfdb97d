//! Where a tube is: all around its axis or on one side only, and from where to where along it.
//!
//! In: points in the tube's coordinates (along the axis, angle, distance). Out: yes or no; the mask along the
//! axis.

use super::constants::{SECTORS, TUBES};
use crate::atlas::Tube;
use crate::atlas::tube::{MASK_NODES, harmonics};
use std::f64::consts::TAU;

/// Whether a part of the circumference lacks its share of the points: a channel or a strip, not a tube.
pub(super) fn gap(tube: &Tube, local: &[[f64; 3]]) -> bool {
    let (mut seen, mut arc, mut counted) = ([0.0; SECTORS], [0.0; SECTORS], 0.0);
    for l in local.iter().filter(|l| l[0].abs() < 1.0) {
        let k = ((l[1] / TAU + 0.5) * SECTORS as f64) as usize;
        seen[k.min(SECTORS - 1)] += 1.0;
        counted += 1.0;
    }
    for k in 0..4 * SECTORS {
        let theta = ((k as f64 + 0.5) / (4 * SECTORS) as f64 - 0.5) * TAU;
        for s in [-0.75, -0.25, 0.25, 0.75] {
            let radius = tube.radius_at(s, theta);
            arc[k / 4] += radius.value.hypot(radius.dv);
        }
    }
    let whole: f64 = arc.iter().sum();
    seen.iter().zip(&arc).any(|(&n, a)| {
        let expected = counted * a / whole;
        n < TUBES.even * expected - 2.5 * expected.sqrt()
    })
}

/// The same where noise hides the shape: then the angles are spread evenly if it is a circle.
pub(super) fn lopsided(local: &[[f64; 3]]) -> bool {
    let (mut first, mut second) = ([0.0; 2], [0.0; 2]);
    for l in local {
        let h = harmonics(l[1]);
        first = [first[0] + h[1], first[1] + h[2]];
        second = [second[0] + h[3], second[1] + h[4]];
    }
    let n = local.len() as f64;
    first[0].hypot(first[1]).max(second[0].hypot(second[1])) > (TUBES.lopsided + 2.0 / n.sqrt()) * n
}

/// Where along the axis there is surface: where the points are at least half as dense, by area, as usual,
/// which is where a tube ends when noise blurs its end. `mean` is their mean distance from the axis.
pub(super) fn mask(tube: &Tube, local: &[[f64; 3]], spacing: f64, mean: f64) -> [u8; MASK_NODES] {
    let half_length = tube.half_length;
    // Wide enough for a few dozen points.
    let per_length = local.len() as f64 / (2.0 * half_length);
    let width = (24.0 / per_length).max(spacing).min(2.0 * mean.max(spacing)) / half_length;
    // Where a tube tapers it has fewer points for its length.
    let girth = |s: f64| {
        let radius = |k: u32| tube.radius_at(s, f64::from(k) * (TAU / 8.0)).value;
        ((0..8).map(radius).sum::<f64>() / 8.0).max(TUBES.taper * tube.mean_radius)
    };
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
                whole += kernel(t) * girth(at + t * width);
            }
        }
        *d = if whole > 0.0 { sum / whole } else { 0.0 };
    }
    let mut sorted = density.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[MASK_NODES * 3 / 4].max(1e-12);
    std::array::from_fn(|k| ((0.5 + (density[k] / usual - 0.5) / 0.5).clamp(0.0, 1.0) * 255.0) as u8)
}
