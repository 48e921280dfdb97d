//! Whether the points about an axis are those of a tube, or of a clump of strays, or of two side by side.
//!
//! In: where the points are along the axis and how far from it. Out: the logarithm of the ratio of the two
//! likelihoods, in nats. A clump scatters along the axis as far as across it; a tube's points are as dense
//! along it as they may be, and lie on a circle across it.

use super::constants::BINS;
use super::rice::circle_gain;
use crate::numeric::special::normal_distribution;

/// Bins along the axis: two for each in which a tube is equally dense.
const FINE: usize = 2 * BINS;
/// Places beyond either end of the axis where clumps may be, for the ends may cut through one. Source:
/// derived, three bins are 1.3 widths of a clump where the axis is shortest: a tenth of its points is inside.
const BEYOND: usize = 6;
/// Places where clumps may be: two for each bin, and those beyond the ends.
const PLACES: usize = 2 * FINE + 2 * BEYOND;
/// Rounds in which the share of each of two clumps is found (expectation and maximisation; Dempster, Laird
/// and Rubin 1977). Source: chosen, clumps that lie apart settle at once.
const ROUNDS: usize = 5;
/// The least probability, so that no point is impossible. Source: chosen, one stray in a thousand points.
const LEAST: f64 = 1e-3 / FINE as f64;

/// How much better clumps explain the points than a tube does, in nats. `along` is in half lengths (-1 to 1),
/// `distances` are in any unit, of which a half length has `half_length`.
pub(super) fn clumps_gain(along: &[f64], distances: &[f64], half_length: f64) -> f64 {
    let n = along.len() as f64;
    let mut bins = [0.0; FINE];
    for s in along {
        bins[(((s + 1.0) * 0.5 * FINE as f64).max(0.0) as usize).min(FINE - 1)] += 1.0;
    }
    let width = (distances.iter().map(|d| d * d).sum::<f64>() / (2.0 * n)).sqrt() / half_length;
    // Each number that is chosen to suit the points costs half the logarithm of how many there are (Schwarz
    // 1978).
    let cost = 0.5 * n.ln();
    let clumps: Vec<[f64; FINE]> = (0..PLACES).filter_map(|place| clump(place, width)).collect();
    let one = clumps.iter().map(|c| likelihood(&bins, c) - cost);
    let pairs = clumps.iter().enumerate().flat_map(|(k, a)| clumps[..k].iter().map(move |b| (a, b)));
    let two = pairs.map(|(a, b)| of_two(&bins, a, b) - 3.0 * cost);
    let gain = one.chain(two).fold(f64::NEG_INFINITY, f64::max)
        - (even(&bins) - 2.0 * cost).max(in_pairs(&bins) - (BINS - 1) as f64 * cost);
    // The search for the circle takes longer.
    if gain > 0.0 { gain - circle_gain(distances).max(0.0) } else { gain }
}

/// Logarithm of the likelihood of what lies in the bins, by each one's probability.
fn likelihood(bins: &[f64; FINE], probability: &[f64; FINE]) -> f64 {
    bins.iter().zip(probability).map(|(c, p)| c * p.max(LEAST).ln()).sum()
}

/// The bins' probabilities for the points of a clump that lie within the domain; none where hardly any do.
fn clump(place: usize, width: f64) -> Option<[f64; FINE]> {
    let at = (place as f64 + 0.5 - BEYOND as f64) / FINE as f64 - 1.0;
    let below = |k: usize| normal_distribution((2.0 * k as f64 / FINE as f64 - 1.0 - at) / width);
    let inside = below(FINE) - below(0);
    (inside > LEAST).then(|| std::array::from_fn(|k| (below(k + 1) - below(k)) / inside))
}

/// The likelihood of two clumps, their shares as they suit the points best.
fn of_two(bins: &[f64; FINE], a: &[f64; FINE], b: &[f64; FINE]) -> f64 {
    let n: f64 = bins.iter().sum();
    let mut share = 0.5;
    for _ in 0..ROUNDS {
        let of_first = |k: usize| share * a[k] / (share * a[k] + (1.0 - share) * b[k]).max(f64::MIN_POSITIVE);
        share = (0..FINE).map(|k| bins[k] * of_first(k)).sum::<f64>() / n;
    }
    likelihood(bins, &std::array::from_fn(|k| share * a[k] + (1.0 - share) * b[k]))
}

/// The likelihood of a density that is even between the first and the last point.
fn even(bins: &[f64; FINE]) -> f64 {
    let first = bins.iter().position(|c| *c > 0.0).unwrap_or(0);
    let last = bins.iter().rposition(|c| *c > 0.0).unwrap_or(FINE - 1);
    let n: f64 = bins.iter().sum();
    -n * ((last + 1 - first) as f64).ln()
}

/// The likelihood of a density that is even within each two bins.
fn in_pairs(bins: &[f64; FINE]) -> f64 {
    let n: f64 = bins.iter().sum();
    let of_pair = |pair: &[f64]| {
        let both: f64 = pair.iter().sum();
        if both > 0.0 { both * (0.5 * both / n).ln() } else { 0.0 }
    };
    bins.chunks(2).map(of_pair).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;

    /// Points about an axis from -`half` to `half`, with noise about a circle of this radius.
    fn gain(n: usize, half: f64, radius: f64, noise: f64, along: impl Fn(&mut Rng) -> f64) -> f64 {
        let mut rng = Rng::new(5);
        let (mut s, mut distances) = (Vec::new(), Vec::new());
        while s.len() < n {
            let x = (along(&mut rng) + noise * rng.normal()) / half;
            if x.abs() < 1.0 {
                s.push(x);
                distances.push((radius + noise * rng.normal()).hypot(noise * rng.normal()));
            }
        }
        clumps_gain(&s, &distances, half)
    }

    #[test]
    fn one_clump_and_two_side_by_side_are_told_from_a_tube() {
        let one = gain(80, 5.0, 0.0, 1.0, |_| 0.0);
        let two = gain(80, 5.0, 0.0, 1.0, |rng| if rng.uniform() < 0.4 { -3.0 } else { 3.0 });
        let cut = gain(80, 5.0, 0.0, 1.0, |rng| if rng.uniform() < 0.4 { -5.0 } else { 1.0 });
        assert!(one > 5.0 && two > 5.0 && cut > 5.0, "{one} {two} {cut}");
    }

    #[test]
    fn tubes_are_no_clumps_however_short_uneven_or_noisy() {
        for n in [60, 600] {
            let short = gain(n, 4.0, 1.0, 0.5, |rng| 12.0 * rng.uniform() - 6.0);
            let wire = gain(n, 5.0, 0.0, 1.0, |rng| 12.0 * rng.uniform() - 6.0);
            let end = gain(n, 5.0, 0.0, 1.0, |rng| 7.0 * rng.uniform() - 1.0);
            let denser = gain(n, 5.0, 0.5, 1.0, |rng| 10.0 * rng.uniform().powi(2) - 4.0);
            let gap = gain(n, 4.0, 1.0, 0.1, |rng| (1.0 + 2.0 * rng.uniform()).copysign(rng.uniform() - 0.5));
            assert!(
                [short, wire, end, denser, gap].iter().all(|g| *g < 0.0),
                "{n}: {short} {wire} {end} {denser} {gap}"
            );
        }
    }
}
