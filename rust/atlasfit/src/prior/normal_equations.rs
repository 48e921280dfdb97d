//! The normal equations of one chart's fit, gathered with vector instructions (chosen at run time by pulp).
//!
//! In: observations of a function that is a weighted sum of the eigenfunctions. Out: its least squares
//! system. The heights are one more column beside the eigenfunctions, so that matrix, right-hand side and sum
//! of squares are one matrix.
//!
//! One observation costs 800 multiplications and additions for its row and 1,300 for the matrix; eight at a
//! time keep loads and stores below the arithmetic.

use super::basis::{Basis, WIDTH};
use super::constants::{BLOCK, MODES};
use crate::numeric::spline::{SIDE, locate, spline};
use pulp::{Arch, Scalar, Simd, WithSimd};

/// A height observations at a place of the domain.
#[derive(Debug, Clone, Copy, Default)]
pub struct Observation {
    /// Where, in [-1, 1]^2.
    pub at: [f64; 2],
    /// The height.
    pub height: f64,
    /// Scales the observation's precision.
    pub weight: f64,
    /// How much of a point it is: its robust weight.
    pub count: f64,
}

/// The normal equations of one chart's fit: what the solve and the choice of smoothness need of the data.
pub struct NormalEquations {
    /// (A y)ᵀ W (A y), WIDTH x WIDTH, upper triangle; below it, what vectors that begin there leave.
    pub matrix: Vec<f64>,
    /// Sum of counts: the effective number of points.
    pub count: f64,
}

impl Default for NormalEquations {
    fn default() -> Self {
        Self { matrix: vec![0.0; WIDTH * WIDTH], count: 0.0 }
    }
}

impl NormalEquations {
    /// Forgets the data.
    pub fn clear(&mut self) {
        self.matrix.fill(0.0);
        self.count = 0.0;
    }
    /// Adds observations.
    pub fn observe(&mut self, basis: &Basis, observations: &[Observation]) {
        self.count += observations.iter().map(|o| o.count).sum::<f64>();
        Arch::new().dispatch(Observe { basis, matrix: &mut self.matrix, observations });
    }
}

struct Observe<'a> {
    basis: &'a Basis,
    matrix: &'a mut [f64],
    observations: &'a [Observation],
}

impl WithSimd for Observe<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match S::F64_LANES {
            4 => self.run::<S, { WIDTH / 4 }>(simd),
            2 => self.run::<S, { WIDTH / 2 }>(simd),
            1 => self.run::<S, WIDTH>(simd),
            // Only where another crate has turned them on in pulp.
            _ => self.with_simd(Scalar::new()),
        }
    }
}

impl Observe<'_> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let modes = S::as_simd_f64s(&self.basis.modes).0.as_chunks::<V>().0;
        let mut rows = [[0.0; WIDTH]; BLOCK];
        for block in self.observations.chunks(BLOCK) {
            let mut weights = [0.0; BLOCK];
            for ((o, row), weight) in block.iter().zip(&mut rows).zip(&mut weights) {
                values::<S, V>(simd, modes, o, row);
                *weight = o.weight;
            }
            // Loops, not closures: those would not be compiled for the wider vectors.
            let mut columns: [&[S::f64s]; BLOCK] = [&[]; BLOCK];
            for (c, row) in columns.iter_mut().zip(&rows) {
                *c = S::as_simd_f64s(row).0;
            }
            let out = S::as_mut_simd_f64s(self.matrix).0.as_chunks_mut::<V>().0;
            for (i, out) in out.iter_mut().enumerate().take(MODES + 1) {
                // Rows of earlier blocks beyond this one's end have no weight.
                let mut factors = [simd.splat_f64s(0.0); BLOCK];
                for b in 0..BLOCK {
                    factors[b] = simd.splat_f64s(weights[b] * rows[b][i]);
                }
                for v in i / S::F64_LANES..V {
                    let mut sum = out[v];
                    for b in 0..BLOCK {
                        sum = simd.mul_add_e_f64s(factors[b], columns[b][v], sum);
                    }
                    out[v] = sum;
                }
            }
        }
    }
}

/// Values of all eigenfunctions where `o` was observations, and its height.
#[inline(always)]
fn values<S: Simd, const V: usize>(simd: S, modes: &[[S::f64s; V]], o: &Observation, row: &mut [f64; WIDTH]) {
    let ((i, s), (j, t)) = (locate(o.at[0]), locate(o.at[1]));
    let (a, b) = (spline(s), spline(t));
    let mut sums = [simd.splat_f64s(0.0); V];
    for (k, ak) in a.iter().enumerate() {
        let at = (i + k) * SIDE + j;
        for (bl, modes) in b.iter().zip(&modes[at..at + 4]) {
            let c = simd.splat_f64s(ak * bl);
            for v in 0..V {
                sums[v] = simd.mul_add_e_f64s(c, modes[v], sums[v]);
            }
        }
    }
    S::as_mut_simd_f64s(row).0.copy_from_slice(&sums);
    row[MODES] = o.height;
}
