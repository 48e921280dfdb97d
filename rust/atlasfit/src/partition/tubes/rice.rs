//! Radius and noise of a circle from the distances of noisy points from its centre: the Rice distribution.
//!
//! In: distances from tubes' axes. Out: the likeliest radius at a known noise; the one noise that explains
//! all tubes best.

use super::constants::TUBES;
use crate::numeric::special::{bessel_scaled, mean_cosine};
use rayon::prelude::*;

/// Radius of a circle whose noisy points have these distances from the centre: maximum of the Rice likelihood
/// for known noise.
pub(super) fn rice_radius(distances: &[f64], sigma: f64) -> f64 {
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
            // exp(-(d^2 + r^2) / 2 s^2) I0(k) with the scaled function: the exponent becomes -(d - r)^2 / 2
            // s^2.
            -s2.ln() - (d - r) * (d - r) / (2.0 * s2) + bessel_scaled(k).0.max(1e-300).ln()
        })
        .sum()
}

/// How much better a circle explains distances from an axis than a line of points does, each with the noise
/// that suits it best, in nats.
pub(super) fn circle_gain(distances: &[f64]) -> f64 {
    let n = distances.len() as f64;
    let most = (distances.iter().map(|d| d * d).sum::<f64>() / (2.0 * n)).sqrt();
    let line = rice_likelihood(distances, 0.0, most);
    let circle = |k: i32| {
        let sigma = most * 0.93f64.powi(k);
        rice_likelihood(distances, rice_radius(distances, sigma), sigma)
    };
    let circle = (1..=TUBES.noise_steps as i32).map(circle).fold(f64::NEG_INFINITY, f64::max);
    circle - line - 0.5 * n.ln()
}

/// The one noise that explains the distances from all axes best: `distances` are those of one tube's points
/// each, `widest` is the tubes' usual root mean square distance.
pub(super) fn pooled_noise(distances: &[Vec<f64>], widest: f64) -> f64 {
    // With no radius at all the noise would be the root mean square distance over the square root of two.
    let most = widest / 2f64.sqrt();
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
    let step = (distances.iter().map(Vec::len).sum::<usize>() / TUBES.pooled).max(1);
    let few: Vec<Vec<f64>> = distances.iter().map(|d| d.iter().step_by(step).copied().collect()).collect();
    let about = likeliest(0..=TUBES.noise_steps, &few);
    sigma(likeliest(about.saturating_sub(TUBES.within_steps)..=about + TUBES.within_steps, distances))
}

#[cfg(test)]
mod tests {
    use super::*;

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
