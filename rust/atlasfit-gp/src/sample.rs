//! Draws from a Gaussian process: curves in the plane and surfaces in space.
//!
//! In: a kernel and the places where it is looked at. Out: values; curves by their coordinates, curves by arc
//! length, surfaces. Source: *Deep Manifold Prior*, section 4.1 and its figure of the prior.

use crate::kernel::Kernel;
use atlasfit::numeric::rng::Rng;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// What is added to the diagonal, as a share of its mean, where a covariance is singular to rounding.
const JITTER: f64 = 1e-10;
/// Tries, each with a hundredfold jitter.
const TRIES: i32 = 4;

/// Makes draws with a given covariance.
pub struct Draws {
    factor: DMatrix<f64>,
}

impl Draws {
    /// Factors a covariance: by Cholesky, and where rounding has made it indefinite by its eigenvectors.
    #[must_use]
    pub fn new(covariance: &DMatrix<f64>) -> Self {
        let n = covariance.nrows();
        let mean = covariance.trace() / n.max(1) as f64;
        for attempt in 0..TRIES {
            let mut shifted = covariance.clone();
            for i in 0..n {
                shifted[(i, i)] += JITTER * 100f64.powi(attempt - 1) * mean;
            }
            if let Some(factor) = Cholesky::new(shifted) {
                return Self { factor: factor.unpack() };
            }
        }
        let eigen = SymmetricEigen::new(covariance.clone());
        let roots = eigen.eigenvalues.map(|x| x.max(0.0).sqrt());
        Self { factor: eigen.eigenvectors * DMatrix::from_diagonal(&roots) }
    }

    /// Of a kernel at some inputs.
    #[must_use]
    pub fn of(kernel: &Kernel, inputs: &[Vec<f64>]) -> Self {
        Self::new(&matrix(kernel, inputs))
    }

    /// One draw.
    pub fn draw(&self, rng: &mut Rng) -> DVector<f64> {
        let standard = DVector::from_fn(self.factor.ncols(), |_, _| rng.normal());
        &self.factor * standard
    }
}

/// A kernel's covariances between some inputs.
#[must_use]
pub fn matrix(kernel: &Kernel, inputs: &[Vec<f64>]) -> DMatrix<f64> {
    let mut k = DMatrix::zeros(inputs.len(), inputs.len());
    for (i, x) in inputs.iter().enumerate() {
        for (j, y) in inputs[..=i].iter().enumerate() {
            k[(i, j)] = kernel.at(x, y);
            k[(j, i)] = k[(i, j)];
        }
    }
    k
}

/// So many numbers from -1 to 1.
#[must_use]
pub fn interval(n: usize) -> Vec<Vec<f64>> {
    (0..n).map(|i| vec![2.0 * i as f64 / (n - 1).max(1) as f64 - 1.0]).collect()
}

/// A grid of `side` x `side` places in [-1, 1]^2, row by row.
#[must_use]
pub fn square(side: usize) -> Vec<Vec<f64>> {
    let line = interval(side);
    line.iter().flat_map(|u| line.iter().map(move |v| vec![u[0], v[0]])).collect()
}

/// A curve whose coordinates are two draws.
#[must_use]
pub fn curve(draws: &Draws, rng: &mut Rng) -> Vec<[f64; 2]> {
    let [x, y] = [draws.draw(rng), draws.draw(rng)];
    x.iter().zip(&y).map(|(x, y)| [*x, *y]).collect()
}

/// A curve of length 2 whose direction's angle is a draw, by the trapezoidal rule.
#[must_use]
pub fn arc_length_curve(draws: &Draws, rng: &mut Rng) -> Vec<[f64; 2]> {
    let angle = draws.draw(rng);
    let half = 1.0 / (angle.len() - 1).max(1) as f64;
    let mut at = [0.0; 2];
    let mut curve = vec![at];
    for w in angle.as_slice().windows(2) {
        at = [at[0] + half * (w[0].cos() + w[1].cos()), at[1] + half * (w[0].sin() + w[1].sin())];
        curve.push(at);
    }
    curve
}

/// A surface whose coordinates are three draws.
#[must_use]
pub fn surface(draws: &Draws, rng: &mut Rng) -> Vec<[f64; 3]> {
    let [x, y, z] = [0; 3].map(|_| draws.draw(rng));
    (0..x.len()).map(|i| [x[i], y[i], z[i]]).collect()
}

/// How rough draws on an interval are beside their size: the mean square of their slope over their variance
/// about their own mean. Exact, from the kernel.
#[must_use]
pub fn roughness(kernel: &Kernel, inputs: &[Vec<f64>]) -> f64 {
    let n = inputs.len() as f64;
    let k = matrix(kernel, inputs);
    let slope: f64 = inputs.iter().map(|x| kernel.gradient(x, &[1.0], x, &[1.0])).sum::<f64>() / n;
    slope / (k.trace() / n - k.sum() / (n * n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_have_the_kernels_covariance() {
        let inputs = interval(7);
        let kernel = Kernel::erf(2);
        let draws = Draws::of(&kernel, &inputs);
        let mut rng = Rng::new(8);
        let n = 40_000;
        let mut sum = DMatrix::zeros(7, 7);
        for _ in 0..n {
            let f = draws.draw(&mut rng);
            sum += &f * f.transpose() / f64::from(n);
        }
        let off = (&sum - matrix(&kernel, &inputs)).amax() / kernel.at(&inputs[6], &inputs[6]);
        assert!(off < 0.03, "{off}");
    }

    #[test]
    fn arc_length_curves_have_unit_speed() {
        let draws = Draws::of(&Kernel::relu(2), &interval(400));
        let curve = arc_length_curve(&draws, &mut Rng::new(2));
        let length: f64 = curve.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum();
        assert!((length / 2.0 - 1.0).abs() < 1e-3, "{length}");
    }
}
