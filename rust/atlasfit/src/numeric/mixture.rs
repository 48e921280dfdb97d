//! Points of something known among strays, which lie anywhere.
//!
//! In: for each point the ratio of its densities as one of the known and as a stray. Out: the share of
//! strays, and how likely each is one.

/// Rounds of expectation and maximisation (Dempster, Laird and Rubin 1977), at the most. Source: chosen.
const ROUNDS: usize = 20;
/// They end where the share changes by less than this part of itself. Source: derived, about its peak such a
/// change is worth less than a thousandth of a nat to a thousand points.
const SETTLED: f64 = 1e-3;
/// The least share, so that none is ruled out. Source: chosen, one in more points than a chart sees.
const LEAST: f64 = 1e-6;

/// The share of strays that makes the points likeliest.
pub(crate) fn share_of_strays(ratios: &[f64]) -> f64 {
    let mut share = 0.5;
    for _ in 0..ROUNDS {
        let sum: f64 = ratios.iter().map(|&r| stray(share, r)).sum();
        let last = std::mem::replace(&mut share, (sum / ratios.len().max(1) as f64).clamp(LEAST, 1.0));
        if (share - last).abs() < SETTLED * last {
            break;
        }
    }
    share
}

/// The probability that a point is a stray, where so large a share are.
pub(crate) fn stray(share: f64, ratio: f64) -> f64 {
    share / (share + (1.0 - share) * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_that_of_the_points_that_are_strays_beyond_doubt() {
        assert!((share_of_strays(&[1e9, 1e9, 1e9, 1e-9]) - 0.25).abs() < 1e-6);
        assert_eq!(share_of_strays(&[1e-9; 3]), 1.0);
        assert!(share_of_strays(&[1e9; 3]) < 1e-5 && share_of_strays(&[]) < 1e-5);
        assert_eq!(stray(0.25, 3.0), 0.1);
    }
}
