//! Eigenvalues and eigenfunctions of a kernel on the unit disk.
//!
//! In: a kernel of fully connected networks in two dimensions, which is invariant under rotation. Out: its
//! Karhunen-Loève expansion: radial functions times cosines and sines. For each number of periods around, the
//! kernel's Fourier coefficient is a kernel of the radius alone, solved by Nyström's method on Gauss-Legendre
//! nodes (Atkinson 1997, "The numerical solution of integral equations of the second kind").

use crate::kernel::Pair;
use crate::quadrature::gauss;
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// How finely the disk is taken.
#[derive(Debug, Clone, Copy)]
pub struct Resolution {
    /// Nodes along the radius.
    pub radii: usize,
    /// Angles of the Fourier transform; the kernel is not smooth where its two inputs meet.
    pub angles: usize,
    /// The largest number of periods around.
    pub periods: usize,
}

impl Default for Resolution {
    /// Enough for a few hundred eigenvalues: doubling each number changes the first 300 of the ReLU kernels
    /// by less than a hundredth.
    fn default() -> Self {
        Self { radii: 48, angles: 768, periods: 48 }
    }
}

/// A radial function of the expansion.
#[derive(Debug, Clone)]
pub struct Mode {
    /// The eigenvalue.
    pub value: f64,
    /// Periods around. 0 stands for one eigenfunction, all else for two: cosine and sine.
    pub periods: usize,
    /// At the expansion's radii.
    pub radial: Vec<f64>,
}

/// The expansion.
#[derive(Debug, Clone)]
pub struct Expansion {
    /// Radii and their weights r dr.
    pub radii: Vec<(f64, f64)>,
    /// The modes, largest eigenvalue first.
    pub modes: Vec<Mode>,
}

impl Expansion {
    /// Of a kernel given by the inputs' inner products.
    pub fn new(kernel: impl Fn(Pair<f64>) -> f64 + Sync, how: Resolution) -> Self {
        let radii: Vec<(f64, f64)> =
            gauss(how.radii, [0.0, 1.0]).into_iter().map(|(r, w)| (r, w * r)).collect();
        let n = radii.len();
        let half = how.angles / 2;
        let cosines: Vec<f64> = (0..how.angles).map(|k| (TAU * k as f64 / how.angles as f64).cos()).collect();
        // The Fourier coefficients of every pair of radii.
        let pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).collect();
        let transformed: Vec<Vec<f64>> = (pairs.par_iter())
            .map(|&(i, j)| {
                let (r, s) = (radii[i].0, radii[j].0);
                let around: Vec<f64> = (0..=half)
                    .map(|k| kernel(Pair { aa: r * r, ab: r * s * cosines[k], bb: s * s }))
                    .collect();
                (0..=how.periods)
                    .map(|m| {
                        let sum: f64 = (around.iter().enumerate())
                            .map(|(k, x)| {
                                let twice = if k == 0 || k == half { 1.0 } else { 2.0 };
                                twice * x * cosines[m * k % how.angles]
                            })
                            .sum();
                        TAU / how.angles as f64 * sum
                    })
                    .collect()
            })
            .collect();
        let mut modes: Vec<Mode> = (0..=how.periods)
            .into_par_iter()
            .flat_map_iter(|m| {
                let mut k = DMatrix::zeros(n, n);
                for (&(i, j), coefficients) in pairs.iter().zip(&transformed) {
                    k[(i, j)] = coefficients[m] * (radii[i].1 * radii[j].1).sqrt();
                    k[(j, i)] = k[(i, j)];
                }
                let eigen = SymmetricEigen::new(k);
                // The integral of a squared cosine.
                let around = if m == 0 { TAU } else { PI };
                let radii = &radii;
                (0..n)
                    .map(|c| Mode {
                        value: eigen.eigenvalues[c],
                        periods: m,
                        radial: (eigen.eigenvectors.column(c).iter().zip(radii))
                            .map(|(x, (_, w))| x / (w * around).sqrt())
                            .collect(),
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        modes.sort_by(|a, b| b.value.total_cmp(&a.value));
        Self { radii, modes }
    }

    /// The eigenvalues in falling order, those of cosines and sines twice.
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        let twice = |m: &Mode| std::iter::repeat_n(m.value, if m.periods == 0 { 1 } else { 2 });
        self.modes.iter().flat_map(twice).collect()
    }

    /// The first eigenfunctions at every radius and so many angles: one column each, radius by radius. They
    /// are orthonormal under the weights of the expansion.
    #[must_use]
    pub fn functions(&self, count: usize, angles: usize) -> DMatrix<f64> {
        let all =
            self.modes.iter().flat_map(|m| [(m, false), (m, true)]).filter(|(m, s)| m.periods > 0 || !s);
        let chosen: Vec<(&Mode, bool)> = all.take(count).collect();
        DMatrix::from_fn(self.radii.len() * angles, chosen.len(), |row, column| {
            let (mode, sine) = chosen[column];
            let angle = mode.periods as f64 * TAU * (row % angles) as f64 / angles as f64;
            mode.radial[row / angles] * if sine { angle.sin() } else { angle.cos() }
        })
    }

    /// The places of [`Self::functions`] and their shares of the disk's area.
    #[must_use]
    pub fn places(&self, angles: usize) -> Vec<([f64; 2], f64)> {
        (self.radii.iter())
            .flat_map(|&(r, w)| {
                (0..angles).map(move |k| {
                    let a = TAU * k as f64 / angles as f64;
                    ([r * a.cos(), r * a.sin()], w * TAU / angles as f64)
                })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use crate::statistic::power;

    const COARSE: Resolution = Resolution { radii: 24, angles: 256, periods: 24 };

    #[test]
    fn the_expansion_gives_the_kernel_back() {
        let kernel = Kernel::relu(2);
        let found = Expansion::new(|p| kernel.covariance(p).ab, COARSE);
        let (count, angles) = (300, 8);
        let functions = found.functions(count, angles);
        let places = found.places(angles);
        let values = found.values();
        for (i, j) in [(20, 20), (37, 120), (100, 5)] {
            let sum: f64 = (0..count).map(|k| values[k] * functions[(i, k)] * functions[(j, k)]).sum();
            let exact = kernel.at(&places[i].0, &places[j].0);
            assert!((sum / exact - 1.0).abs() < 2e-3, "{sum} {exact}");
        }
    }

    #[test]
    fn eigenvalues_fall_as_the_orders_of_the_kernels_say() {
        let slope = |found: &Expansion| {
            let values = found.values();
            power((30..120).map(|n| (n as f64, values[n - 1])))
        };
        let kernel = Kernel::relu(1);
        // Frequency^-5 in two dimensions is n^-5/2; frequency^-3 is n^-3/2.
        let limit = slope(&Expansion::new(|p| kernel.covariance(p).ab, COARSE));
        let tangent = slope(&Expansion::new(|p| kernel.tangent(p), COARSE));
        assert!((limit + 2.5).abs() < 0.3, "{limit}");
        assert!((tangent + 1.5).abs() < 0.3, "{tangent}");
    }
}
