//! The distributions of the curvature of random curves.
//!
//! In: a kernel and a parameter of the curve. Out: the distribution, draws from the process and from finite
//! networks. Sources: *Deep Manifold Prior*, section 4.1 ("Normals and curvature") and the supplement's
//! "Limiting distribution for the curvature"; derived here where they end.
//!
//! - Arc length: the direction's angle is the process f, so the signed curvature is f', exactly Gaussian.
//! - Coordinates: x and y are two draws. With a the variance of x' and s^2 that of x'' given x', the
//!   curvature is s z / (a e) / 2, where z is standard normal and e standard exponential, independent. So it
//!   has a distribution, symmetric and without parameters but its scale, whose tail falls as 1 / k: no mean.
//!   It needs second derivatives: the ReLU limit has none.

use crate::kernel::{Activation, Kernel, erf, scaled_complement};
use crate::network::Network;
use atlasfit::numeric::rng::Rng;
use std::f64::consts::SQRT_2;

/// Standard deviation of the curvature of a curve by arc length at parameter `t`.
#[must_use]
pub fn arc_length_deviation(kernel: &Kernel, t: f64) -> f64 {
    kernel.gradient(&[t], &[1.0], &[t], &[1.0]).sqrt()
}

/// Distribution function of a centred normal variable.
#[must_use]
pub fn normal(deviation: f64, x: f64) -> f64 {
    0.5 * (1.0 + erf(x / (deviation * SQRT_2)))
}

/// Curvature of arc-length curves at `t` by finite networks of one width.
pub fn arc_length_draws(kernel: Kernel, t: f64, width: usize, count: usize, rng: &mut Rng) -> Vec<f64> {
    (0..count).map(|_| Network::draw(kernel, 1, width, 1, rng).along(&[t], &[1.0])[0][1]).collect()
}

/// The distribution of the signed curvature of a curve by its coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Variances of x' and of x'', and their covariance.
    moments: [f64; 3],
    /// The curvature beside z / e.
    pub scale: f64,
}

impl Plane {
    /// At parameter `t`; `None` for kernels without second derivatives.
    #[must_use]
    pub fn new(kernel: &Kernel, t: f64) -> Option<Self> {
        let jet = kernel.jet(&[t], &[1.0], &[t], &[1.0])?;
        let moments = [jet.derivative(1, 1), jet.derivative(2, 2), jet.derivative(1, 2)];
        let [a, c, b] = moments;
        Some(Self { moments, scale: (c - b * b / a).max(0.0).sqrt() / (2.0 * a) })
    }

    /// The chance of a curvature of more than `k` in size: 1 - exp(q^2) erfc(q) with q = scale / (k sqrt 2).
    #[must_use]
    pub fn exceeds(&self, k: f64) -> f64 {
        if k <= 0.0 { 1.0 } else { 1.0 - scaled_complement(self.scale / (k * SQRT_2)) }
    }

    /// Distribution function.
    #[must_use]
    pub fn below(&self, k: f64) -> f64 {
        let beyond = 0.5 * self.exceeds(k.abs());
        if k < 0.0 { beyond } else { 1.0 - beyond }
    }

    /// Curvatures by draws of the derivatives.
    pub fn draws(&self, count: usize, rng: &mut Rng) -> Vec<f64> {
        let [a, c, b] = self.moments;
        (0..count)
            .map(|_| {
                let [x, y] = [0; 2].map(|_| {
                    let first = a.sqrt() * rng.normal();
                    [first, b / a * first + (c - b * b / a).max(0.0).sqrt() * rng.normal()]
                });
                signed(x, y)
            })
            .collect()
    }
}

/// Curvature at `t` of plane curves by finite smooth networks of one width.
///
/// # Panics
/// For activations without second derivatives.
pub fn plane_draws(kernel: Kernel, t: f64, width: usize, count: usize, rng: &mut Rng) -> Vec<f64> {
    assert_eq!(kernel.activation, Activation::Erf, "curvature needs second derivatives");
    (0..count)
        .map(|_| {
            let f = Network::draw(kernel, 1, width, 2, rng).along(&[t], &[1.0]);
            signed([f[0][1], f[0][2]], [f[1][1], f[1][2]])
        })
        .collect()
}

/// Signed curvature, from the first and second derivatives of the coordinates.
fn signed(x: [f64; 2], y: [f64; 2]) -> f64 {
    (x[0] * y[1] - y[0] * x[1]) / x[0].hypot(y[0]).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistic::{kolmogorov, tail_index};

    #[test]
    fn arc_length_curvature_is_gaussian() {
        let mut rng = Rng::new(12);
        for kernel in [Kernel::erf(2), Kernel::relu(2)] {
            let deviation = arc_length_deviation(&kernel, 0.4);
            let draws = arc_length_draws(kernel, 0.4, 128, 2000, &mut rng);
            let test = kolmogorov(&draws, |k| normal(deviation, k));
            assert!(test.p > 0.01, "{kernel:?} {test:?}");
            // Another deviation is refused.
            assert!(kolmogorov(&draws, |k| normal(1.3 * deviation, k)).p < 0.01);
        }
    }

    #[test]
    fn plane_curvature_has_its_closed_form_and_a_tail_without_mean() {
        let kernel = Kernel::erf(2);
        let plane = Plane::new(&kernel, 0.4).unwrap();
        let mut rng = Rng::new(13);
        let draws = plane.draws(20_000, &mut rng);
        let test = kolmogorov(&draws, |k| plane.below(k));
        assert!(test.p > 0.01, "{test:?}");
        let sizes: Vec<f64> = draws.iter().map(|k| k.abs()).collect();
        let index = tail_index(&sizes, 500);
        assert!((index - 1.0).abs() < 0.15, "{index}");
        let test = kolmogorov(&plane_draws(kernel, 0.4, 128, 2000, &mut rng), |k| plane.below(k));
        assert!(test.p > 0.01, "{test:?}");
    }

    #[test]
    fn the_relu_limit_has_no_second_derivatives() {
        assert_eq!(Plane::new(&Kernel::relu(2), 0.4), None);
    }

    #[test]
    fn the_smooth_kernels_derivatives_are_those_of_finite_differences() {
        let kernel = Kernel::erf(3);
        let jet = kernel.jet(&[0.3], &[1.0], &[0.3], &[1.0]).unwrap();
        let at = |s: f64, t: f64| kernel.at(&[0.3 + s], &[0.3 + t]);
        let h = 1e-2;
        let mixed = (at(h, h) - at(h, -h) - at(-h, h) + at(-h, -h)) / (4.0 * h * h);
        assert!((jet.derivative(1, 1) - mixed).abs() < 1e-3, "{jet:?} {mixed}");
        let second = |s: f64| (at(s, h) - 2.0 * at(s, 0.0) + at(s, -h)) / (h * h);
        let fourth = (second(h) - 2.0 * second(0.0) + second(-h)) / (h * h);
        assert!((jet.derivative(2, 2) / fourth - 1.0).abs() < 1e-2, "{jet:?} {fourth}");
    }

    #[test]
    fn the_gradient_field_of_relu_is_continuous_at_one_input() {
        let kernel = Kernel::relu(3);
        let (x, u, v) = ([0.3, -0.2, 0.5], [1.0, 0.0, 0.0], [0.6, 0.8, 0.0]);
        let near = [0.3 + 1e-5, -0.2, 0.5];
        let (at, beside) = (kernel.gradient(&x, &u, &x, &v), kernel.gradient(&x, &u, &near, &v));
        assert!((at - 0.6).abs() < 1e-12 && (at - beside).abs() < 1e-3, "{at} {beside}");
    }
}
