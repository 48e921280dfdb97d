//! How likely each point is a stray.
//!
//! In: residuals over the noise. Out: probabilities. The residuals of the points on charts are a mixture of
//! the noise and of strays, which lie anywhere within the charts' reach; the share of strays is the likeliest
//! one.

use crate::numeric::mixture;
use crate::numeric::robust::TUKEY;
use std::f64::consts::TAU;

/// The probability that each is a stray; `None` are points on no chart.
pub(super) fn probabilities(scaled: &[Option<f64>]) -> Vec<f64> {
    // Densities on the surface over those as a stray.
    let ratio = |z: f64| 2.0 * TUKEY / TAU.sqrt() * (-0.5 * z * z).exp();
    let ratios: Vec<f64> = scaled.iter().flatten().map(|&z| ratio(z)).collect();
    let share = mixture::share_of_strays(&ratios);
    scaled.iter().map(|z| z.map_or(1.0, |z| mixture::stray(share, ratio(z)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;

    #[test]
    fn strays_among_noise_are_known_as_far_as_they_stand_out_of_it() {
        let mut rng = Rng::new(5);
        let mut scaled: Vec<Option<f64>> = (0..2000).map(|_| Some(rng.normal())).collect();
        scaled.extend((0..100).map(|_| Some((2.0 * rng.uniform() - 1.0) * TUKEY)));
        scaled.push(None);
        let p = probabilities(&scaled);
        let expected: f64 = p[..2100].iter().sum();
        assert!((60.0..160.0).contains(&expected), "{expected} strays of 100");
        assert_eq!(p[2100], 1.0);
        for (z, p) in scaled.iter().zip(&p).filter_map(|(z, p)| z.map(|z| (z.abs(), p))) {
            assert!(z < 3.5 || *p > 0.5, "{z}: {p}");
            assert!(z > 1.5 || *p < 0.1, "{z}: {p}");
        }
    }

    #[test]
    fn a_scan_without_strays_has_hardly_any() {
        let mut rng = Rng::new(7);
        let p = probabilities(&(0..2000).map(|_| Some(rng.normal())).collect::<Vec<_>>());
        assert!(p.iter().sum::<f64>() < 40.0 && probabilities(&[]).is_empty());
    }
}
