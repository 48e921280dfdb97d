//! Tests of distributions and slopes of power laws.
//!
//! In: samples and a distribution function; pairs of positive numbers. Out: the Kolmogorov-Smirnov test; the
//! tail's index; the slope in logarithms.

/// The outcome of a Kolmogorov-Smirnov test.
#[derive(Debug, Clone, Copy)]
pub struct Test {
    /// The largest difference of the distribution functions.
    pub distance: f64,
    /// The chance of a larger one were the samples from the distribution.
    pub p: f64,
}

/// Tests whether samples are from a continuous distribution (Kolmogorov 1933; the p value by Stephens' 1970
/// correction of the limit).
///
/// ```
/// let even: Vec<f64> = (0..100).map(|i| (f64::from(i) + 0.5) / 100.0).collect();
/// let uniform = |x: f64| x.clamp(0.0, 1.0);
/// assert!(atlasfit_gp::statistic::kolmogorov(&even, uniform).p > 0.99);
/// assert!(atlasfit_gp::statistic::kolmogorov(&even, |x| uniform(x * x)).p < 1e-3);
/// ```
#[must_use]
pub fn kolmogorov(samples: &[f64], distribution: impl Fn(f64) -> f64) -> Test {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let distance = (sorted.iter().enumerate())
        .map(|(i, x)| {
            let f = distribution(*x);
            (f - i as f64 / n).max((i + 1) as f64 / n - f)
        })
        .fold(0.0, f64::max);
    let root = n.sqrt();
    let x = (root + 0.12 + 0.11 / root) * distance;
    let term = |k: i32| (-2.0 * f64::from(k * k) * x * x).exp() * if k % 2 == 1 { 2.0 } else { -2.0 };
    // The series alternates too slowly below this, where the p value is 1 to six digits.
    let p = if x < 0.3 { 1.0 } else { (1..=100).map(term).sum::<f64>().clamp(0.0, 1.0) };
    Test { distance, p }
}

/// The index a of a tail P(X > x) ~ x^-a, from the largest `count` of the samples (Hill 1975). Means exist
/// for a > 1 only.
#[must_use]
pub fn tail_index(samples: &[f64], count: usize) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let Some(least) = sorted.get(count) else { return f64::NAN };
    count as f64 / sorted[..count].iter().map(|x| (x / least).ln()).sum::<f64>()
}

/// The slope of the line of least squares through the logarithms of pairs of positive numbers.
#[must_use]
pub fn power(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let logs: Vec<(f64, f64)> = pairs.map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = logs.iter().fold((0.0, 0.0), |m, l| (m.0 + l.0 / n, m.1 + l.1 / n));
    let (mut xy, mut xx) = (0.0, 0.0);
    for (x, y) in logs {
        xy += (x - mean.0) * (y - mean.1);
        xx += (x - mean.0) * (x - mean.0);
    }
    xy / xx
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::numeric::rng::Rng;

    #[test]
    fn p_values_of_true_hypotheses_are_uniform() {
        let mut rng = Rng::new(3);
        let mut below = 0;
        for _ in 0..1000 {
            let samples: Vec<f64> = (0..100).map(|_| rng.uniform()).collect();
            below += u32::from(kolmogorov(&samples, |x| x).p < 0.1);
        }
        assert!((60..140).contains(&below), "{below}");
    }

    #[test]
    fn the_index_and_the_slope_of_a_power_law_are_its_own() {
        let mut rng = Rng::new(3);
        let samples: Vec<f64> = (0..50_000).map(|_| (1.0 - rng.uniform()).powf(-1.0 / 1.5)).collect();
        assert!((tail_index(&samples, 2000) - 1.5).abs() < 0.1);
        assert!((power((1..9).map(|i| (f64::from(i), f64::from(i).powf(-2.5)))) + 2.5).abs() < 1e-12);
    }
}
