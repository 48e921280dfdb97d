//! What batch norm does to the limit: outputs stay Gaussian, but their covariance is that of the batch.
//!
//! In: a kernel and the inputs of a batch. Out: the covariance between these inputs when each hidden unit is
//! normalised over them after its activation, as in *Deep Manifold Prior*, section 5.1. No closed form is
//! known for it: units are drawn from the process of the layer before, layer by layer.

use crate::kernel::Kernel;
use crate::sample::Draws;
use atlasfit::numeric::rng::Rng;
use nalgebra::DMatrix;

/// Covariances between the inputs of a batch, by `units` random units in each layer. An entry's error is
/// about 1 / sqrt(units) of the variance, which is the share of the units that are on somewhere in the batch,
/// plus that of the biases.
#[must_use]
pub fn covariance(kernel: &Kernel, batch: &[Vec<f64>], units: usize, rng: &mut Rng) -> DMatrix<f64> {
    let n = batch.len();
    let inner = |i: usize, j: usize| batch[i].iter().zip(&batch[j]).map(|(a, b)| a * b).sum::<f64>();
    let mut k = DMatrix::from_fn(n, n, |i, j| inner(i, j) + kernel.bias);
    for _ in 0..kernel.depth {
        let draws = Draws::new(&k);
        let mut next = DMatrix::zeros(n, n);
        for _ in 0..units {
            let mut z = draws.draw(rng);
            z.iter_mut().for_each(|z| *z = kernel.activation.at(*z));
            let mean = z.mean();
            z.add_scalar_mut(-mean);
            let deviation = (z.norm_squared() / n as f64).sqrt();
            // A unit that is off everywhere gives 0.
            if deviation > 1e-12 {
                next.syger(1.0 / (deviation * deviation * units as f64), &z, &z, 1.0);
            }
        }
        next.fill_upper_triangle_with_lower_triangle();
        k = next.add_scalar(kernel.bias);
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalised_units_have_mean_0_and_their_covariance_depends_on_the_batch() {
        let kernel = Kernel::relu(1).with_bias(0.0);
        let even: Vec<Vec<f64>> = (0..21).map(|i| vec![f64::from(i) / 10.0 - 1.0, 1.0]).collect();
        let uneven: Vec<Vec<f64>> =
            (0..21).map(|i| vec![2.0 * (f64::from(i) / 20.0).powi(3) - 1.0, 1.0]).collect();
        let mut rng = Rng::new(1);
        let [a, b] = [&even, &uneven].map(|x| covariance(&kernel, x, 4000, &mut rng));
        for k in [&a, &b] {
            // A quarter of the units is off over the whole batch.
            assert!((k.trace() / 21.0 - 0.75).abs() < 0.05, "{}", k.trace());
            // Rows sum to 0: each unit has mean 0 over the batch.
            assert!(k.row_sum().amax() < 1e-9);
        }
        // Both batches begin and end at the same inputs.
        let between = |k: &DMatrix<f64>| k[(0, 20)] / (k[(0, 0)] * k[(20, 20)]).sqrt();
        assert!((between(&a) - between(&b)).abs() > 0.1, "{} {}", between(&a), between(&b));
    }
}
