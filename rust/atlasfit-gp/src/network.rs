//! Finite random networks: what the kernels are checked against, and what is drawn beside their limit.
//!
//! In: a kernel's activation, depth and variances, a width. Out: a network drawn from them, its outputs, and
//! the covariance of its outputs given its hidden layers.

use crate::kernel::{Kernel, Pair, products};
use atlasfit::numeric::rng::Rng;

/// A layer: rows of weights, and the biases.
struct Layer {
    weights: Vec<f64>,
    bias: Vec<f64>,
}

impl Layer {
    fn draw(inputs: usize, outputs: usize, deviations: [f64; 2], rng: &mut Rng) -> Self {
        let mut normal = |n: usize, deviation: f64| (0..n).map(|_| deviation * rng.normal()).collect();
        Self { weights: normal(inputs * outputs, deviations[0]), bias: normal(outputs, deviations[1]) }
    }

    fn sums(&self, x: &[f64]) -> Vec<f64> {
        let rows = self.weights.chunks_exact(x.len().max(1)).zip(&self.bias);
        rows.map(|(row, b)| b + row.iter().zip(x).map(|(w, x)| w * x).sum::<f64>()).collect()
    }
}

/// A random fully connected network.
pub struct Network {
    kernel: Kernel,
    hidden: Vec<Layer>,
    last: Layer,
}

impl Network {
    /// A network of hidden layers of `width` units each.
    pub fn draw(kernel: Kernel, inputs: usize, width: usize, outputs: usize, rng: &mut Rng) -> Self {
        let later = [(kernel.weight / width as f64).sqrt(), kernel.bias.sqrt()];
        let hidden = (0..kernel.depth)
            .map(|l| {
                if l == 0 {
                    Layer::draw(inputs, width, [1.0, kernel.bias.sqrt()], rng)
                } else {
                    Layer::draw(width, width, later, rng)
                }
            })
            .collect();
        Self { kernel, hidden, last: Layer::draw(width, outputs, later, rng) }
    }

    /// The outputs.
    #[must_use]
    pub fn at(&self, x: &[f64]) -> Vec<f64> {
        self.last.sums(&self.features(x))
    }

    /// The last hidden layer's activations.
    fn features(&self, x: &[f64]) -> Vec<f64> {
        self.hidden.iter().fold(x.to_vec(), |x, layer| {
            let mut y = layer.sums(&x);
            y.iter_mut().for_each(|y| *y = self.kernel.activation.at(*y));
            y
        })
    }

    /// Each output along a line through `x` in direction `u`: value, first and second derivative. The second
    /// of a ReLU network is 0 where it exists.
    #[must_use]
    pub fn along(&self, x: &[f64], u: &[f64]) -> Vec<[f64; 3]> {
        let mut f = [x.to_vec(), u.to_vec(), vec![0.0; x.len()]];
        let linear = |layer: &Layer, f: &[Vec<f64>; 3]| {
            let mut sums = [0, 1, 2].map(|k| layer.sums(&f[k]));
            for sums in &mut sums[1..] {
                sums.iter_mut().zip(&layer.bias).for_each(|(s, b)| *s -= b);
            }
            sums
        };
        for layer in &self.hidden {
            f = linear(layer, &f);
            for i in 0..f[0].len() {
                let [h, slope, bend] = self.kernel.activation.slopes(f[0][i]);
                let first = f[1][i];
                (f[0][i], f[1][i], f[2][i]) = (h, slope * first, bend * first * first + slope * f[2][i]);
            }
        }
        let [value, first, second] = linear(&self.last, &f);
        (0..value.len()).map(|i| [value[i], first[i], second[i]]).collect()
    }

    /// The covariance of an output at two inputs over the last layer's weights, the hidden layers given: the
    /// kernel's, where they are wide.
    #[must_use]
    pub fn covariance(&self, x: &[f64], y: &[f64]) -> f64 {
        let (x, y) = (self.features(x), self.features(y));
        let sum: f64 = x.iter().zip(&y).map(|(a, b)| a * b).sum();
        self.kernel.bias + self.kernel.weight * sum / x.len() as f64
    }
}

/// How far the covariance of networks of one width is from the kernel's.
#[derive(Debug, Clone, Copy)]
pub struct Convergence {
    /// Units per hidden layer.
    pub width: usize,
    /// Root mean square over networks of (covariance / kernel - 1).
    pub spread: f64,
    /// Mean over networks of the same.
    pub offset: f64,
}

/// The kernel at two inputs by Monte Carlo, layer by layer: in each, so many draws of the sums of one unit.
pub fn monte_carlo(kernel: Kernel, [x, y]: [&[f64]; 2], draws: usize, rng: &mut Rng) -> f64 {
    let inputs = products(x, y);
    let mut k =
        Pair { aa: inputs.aa + kernel.bias, ab: inputs.ab + kernel.bias, bb: inputs.bb + kernel.bias };
    for _ in 0..kernel.depth {
        let (root, slope) = (k.aa.sqrt(), k.ab / k.aa);
        let rest = (k.bb - slope * k.ab).max(0.0).sqrt();
        let mut sum = Pair { aa: 0.0, ab: 0.0, bb: 0.0 };
        for _ in 0..draws {
            let a = root * rng.normal();
            let b = slope * a + rest * rng.normal();
            let [a, b] = [a, b].map(|z| kernel.activation.at(z));
            sum = Pair { aa: sum.aa + a * a, ab: sum.ab + a * b, bb: sum.bb + b * b };
        }
        let next = |s: f64| kernel.bias + kernel.weight * s / draws as f64;
        k = Pair { aa: next(sum.aa), ab: next(sum.ab), bb: next(sum.bb) };
    }
    k.ab
}

/// The covariance at two inputs over `networks` networks of each width.
#[must_use]
pub fn convergence(
    kernel: Kernel,
    [x, y]: [&[f64]; 2],
    widths: &[usize],
    networks: usize,
    rng: &mut Rng,
) -> Vec<Convergence> {
    let limit = kernel.at(x, y);
    (widths.iter())
        .map(|&width| {
            let (mut sum, mut square) = (0.0, 0.0);
            for _ in 0..networks {
                let off = Network::draw(kernel, x.len(), width, 1, rng).covariance(x, y) / limit - 1.0;
                sum += off;
                square += off * off;
            }
            let n = networks as f64;
            Convergence { width, spread: (square / n).sqrt(), offset: sum / n }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_agree_with_monte_carlo_within_a_hundredth_and_with_networks_within_three() {
        let inputs: [&[f64]; 2] = [&[0.6, -0.2], &[-0.3, 0.9]];
        let mut rng = Rng::new(2);
        for kernel in [Kernel::relu(1), Kernel::relu(3), Kernel::erf(1), Kernel::erf(3)] {
            let off = monte_carlo(kernel, inputs, 200_000, &mut rng) / kernel.at(inputs[0], inputs[1]) - 1.0;
            assert!(off.abs() < 0.01, "{kernel:?}: {off}");
            let found = convergence(kernel, inputs, &[128], 400, &mut rng)[0];
            assert!(found.offset.abs() < 0.03, "{kernel:?}: {found:?}");
        }
    }

    #[test]
    fn the_covariance_converges_with_one_over_the_root_of_the_width() {
        let (x, y) = ([0.6, -0.2], [-0.3, 0.9]);
        let found = convergence(Kernel::relu(2), [&x, &y], &[16, 256], 400, &mut Rng::new(3));
        let ratio = found[0].spread / found[1].spread;
        assert!((ratio / 4.0 - 1.0).abs() < 0.2, "{ratio}");
    }

    #[test]
    fn outputs_are_independent_and_have_the_kernels_variance() {
        let x = [0.4, 0.1];
        let kernel = Kernel::relu(2);
        let mut rng = Rng::new(4);
        let n = 4000;
        let (mut own, mut across) = (0.0, 0.0);
        for _ in 0..n {
            let y = Network::draw(kernel, 2, 40, 3, &mut rng).at(&x);
            own += y.iter().map(|y| y * y).sum::<f64>() / f64::from(3 * n);
            across += y[0] * y[1] / f64::from(n);
        }
        let limit = kernel.at(&x, &x);
        assert!((own / limit - 1.0).abs() < 0.06, "{own} {limit}");
        assert!((across / limit).abs() < 0.06, "{across}");
    }
}
