//! Gauss-Legendre quadrature, and the kernels' moments by it: independent of their closed forms.
//!
//! In: a number of nodes and an interval; an activation and a pair of Gaussian variables. Out: nodes with
//! weights; the moment.

use crate::kernel::{Activation, Pair};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Nodes and weights on [from, to], exact for polynomials of degree 2 n - 1 (Golub and Welsch 1969; here by
/// Newton's method on the Legendre polynomial).
///
/// ```
/// let rule = atlasfit_gp::quadrature::gauss(3, [0.0, 2.0]);
/// let integral: f64 = rule.iter().map(|(x, w)| w * x.powi(5)).sum();
/// assert!((integral - 64.0 / 6.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn gauss(n: usize, [from, to]: [f64; 2]) -> Vec<(f64, f64)> {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let mut rule: Vec<(f64, f64)> = (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..60 {
                let (mut before, mut value) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
                }
                slope = n as f64 * (x * value - before) / (x * x - 1.0);
                let step = value / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (middle + half * x, half * 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect();
    rule.reverse();
    rule
}

/// Radius beyond which a standard Gaussian's mass is below rounding, in standard deviations.
const FAR: f64 = 9.0;
/// Nodes along the radius, and on each arc between two directions where the integrand may have a kink.
const NODES: [usize; 2] = [64, 48];

/// E[h(a) h(b)] by quadrature in polar coordinates, with the plane cut where a or b changes sign. Exact to
/// about 1e-12.
#[must_use]
pub fn second_moment(h: Activation, of: Pair<f64>) -> f64 {
    let (sa, sb) = (of.aa.sqrt(), of.bb.sqrt());
    let psi = (of.ab / (sa * sb)).clamp(-1.0, 1.0).acos();
    let mut cuts: Vec<f64> = [FRAC_PI_2, -FRAC_PI_2, psi + FRAC_PI_2, psi - FRAC_PI_2]
        .iter()
        .map(|a| a.rem_euclid(TAU))
        .chain([0.0, TAU])
        .collect();
    cuts.sort_by(f64::total_cmp);
    let radii = gauss(NODES[0], [0.0, FAR]);
    let mut sum = 0.0;
    for arc in cuts.windows(2) {
        for (angle, w) in gauss(NODES[1], [arc[0], arc[1]]) {
            let [a, b] = [sa * angle.cos(), sb * (angle - psi).cos()];
            for (r, wr) in &radii {
                sum += w * wr * r * (-0.5 * r * r).exp() * h.at(r * a) * h.at(r * b);
            }
        }
    }
    sum / TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use atlasfit::numeric::rng::Rng;

    #[test]
    fn closed_forms_agree_with_quadrature() {
        let mut rng = Rng::new(5);
        for activation in [Activation::Erf, Activation::Relu, Activation::LeakyRelu] {
            for _ in 0..40 {
                let [aa, bb] = [0; 2].map(|_| 0.01 + 4.0 * rng.uniform());
                let ab = (2.0 * rng.uniform() - 1.0) * f64::sqrt(aa * bb);
                let of = Pair { aa, ab, bb };
                let (closed, numeric) = (activation.second_moment(of), second_moment(activation, of));
                assert!((closed - numeric).abs() < 1e-9, "{activation:?} {of:?}: {closed} {numeric}");
            }
        }
    }

    #[test]
    fn the_slopes_moment_is_the_moments_slope() {
        // Price's theorem: dE[h(a) h(b)] / dE[a b] = E[h'(a) h'(b)].
        for activation in [Activation::Erf, Activation::Relu, Activation::LeakyRelu] {
            let at = |ab: f64| activation.second_moment(Pair { aa: 1.3, ab, bb: 0.7 });
            let slope = (at(0.4 + 1e-5) - at(0.4 - 1e-5)) / 2e-5;
            let closed = activation.second_moment_of_slope(Pair { aa: 1.3, ab: 0.4, bb: 0.7 });
            assert!((slope - closed).abs() < 1e-8, "{activation:?} {slope} {closed}");
        }
    }

    #[test]
    fn a_deep_kernel_is_the_recursion_of_quadratures() {
        let (x, y) = ([0.3, -0.8], [0.9, 0.2]);
        for kernel in [Kernel::relu(4), Kernel::erf(4)] {
            let first = |a: &[f64; 2], b: &[f64; 2]| a[0] * b[0] + a[1] * b[1] + kernel.bias;
            let mut k = Pair { aa: first(&x, &x), ab: first(&x, &y), bb: first(&y, &y) };
            for _ in 0..kernel.depth {
                let next = |aa, ab, bb| {
                    kernel.weight * second_moment(kernel.activation, Pair { aa, ab, bb }) + kernel.bias
                };
                k = Pair {
                    aa: next(k.aa, k.aa, k.aa),
                    ab: next(k.aa, k.ab, k.bb),
                    bb: next(k.bb, k.bb, k.bb),
                };
            }
            assert!((kernel.at(&x, &y) - k.ab).abs() < 1e-9);
        }
    }
}
