//! Special functions that Rust's library does not have.

/// Ratio of the modified Bessel functions I1 / I0: the mean cosine of an angle known with concentration `k`
/// (Abramowitz and Stegun 9.8).
///
/// ```
/// use atlasfit::numeric::special::mean_cosine;
/// assert_eq!(mean_cosine(0.0), 0.0);
/// assert!((mean_cosine(2.0) - 0.697_775).abs() < 1e-5);
/// ```
#[must_use]
pub fn mean_cosine(k: f64) -> f64 {
    let (l0, l1) = bessel_scaled(k);
    l1 / l0
}

/// exp(-k) I0(k) and exp(-k) I1(k) (Abramowitz and Stegun 9.8.1 to 9.8.4, errors below 2e-7).
///
/// ```
/// let (i0, i1) = atlasfit::numeric::special::bessel_scaled(1.0);
/// assert!((i0 - 0.465_760).abs() < 1e-5 && (i1 - 0.207_910).abs() < 1e-5);
/// ```
#[must_use]
pub fn bessel_scaled(k: f64) -> (f64, f64) {
    let horner = |c: &[f64], x: f64| c.iter().rev().fold(0.0, |a, b| a * x + b);
    if k < 3.75 {
        let t = (k / 3.75) * (k / 3.75);
        let e = (-k).exp();
        (
            e * horner(
                &[1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3],
                t,
            ),
            e * k
                * horner(
                    &[
                        0.5,
                        0.878_905_94,
                        0.514_988_69,
                        0.150_849_34,
                        0.026_587_33,
                        0.003_015_32,
                        0.000_324_11,
                    ],
                    t,
                ),
        )
    } else {
        let t = 3.75 / k;
        let root = 1.0 / k.sqrt();
        (
            root * horner(
                &[
                    0.398_942_28,
                    0.013_285_92,
                    0.002_253_19,
                    -0.001_575_65,
                    0.009_162_81,
                    -0.020_577_06,
                    0.026_355_37,
                    -0.016_476_33,
                    0.003_923_77,
                ],
                t,
            ),
            root * horner(
                &[
                    0.398_942_28,
                    -0.039_880_24,
                    -0.003_620_18,
                    0.001_638_01,
                    -0.010_315_55,
                    0.022_829_67,
                    -0.028_953_12,
                    0.017_876_54,
                    -0.004_200_59,
                ],
                t,
            ),
        )
    }
}

/// Density of the standard normal distribution.
#[must_use]
pub(crate) fn normal_density(x: f64) -> f64 {
    const SCALE: f64 = std::f64::consts::FRAC_2_SQRT_PI * 0.5 * std::f64::consts::FRAC_1_SQRT_2;
    SCALE * (-0.5 * x * x).exp()
}

/// Share of the standard normal distribution below `x`.
#[must_use]
pub(crate) fn normal_distribution(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

/// The value below which a standard Gaussian lies with probability `p` in (0, 1): its distribution function
/// inverted by bisection.
pub(crate) fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (-40.0, 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if normal_distribution(middle) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_functions_at_known_places() {
        // I0(1) = 1.2660658, I1(1) = 0.5651591, I0(5) = 27.2398718, I1(5) = 24.3356421.
        for (k, i0, i1) in [(1.0, 1.266_065_8, 0.565_159_1), (5.0, 27.239_871_8, 24.335_642_1)] {
            let (a, b) = bessel_scaled(k);
            assert!((a * f64::exp(k) / i0 - 1.0).abs() < 1e-5);
            assert!((b * f64::exp(k) / i1 - 1.0).abs() < 1e-5);
        }
    }
}
