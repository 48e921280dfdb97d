//! The eigenfunctions of the prior on a chart's height: its Karhunen-Loève expansion on the unit disk.
//!
//! Out: their spline coefficients and prior precisions, made once and shared by all charts.

use super::constants::{FREE, MODES, PRIOR};
use super::evidence::Problem;
use crate::numeric::spline::{COEFFS, GAUSS, INTERVALS, SIDE, locate, spline, spline_d1, spline_d2};
use nalgebra::{DMatrix, SymmetricEigen};
use std::sync::LazyLock;

/// Columns of a row: eigenfunctions, height, and what fills the last vector.
pub const WIDTH: usize = Problem::width(MODES);

/// The expansion shared by all charts.
pub struct Basis {
    /// Spline coefficients of each eigenfunction: COEFFS rows of MODES, filled up to WIDTH.
    pub modes: Vec<f64>,
    /// Prior precision of each eigenfunction, up to one scale; 0 for the affine ones.
    pub precision: Vec<f64>,
}

/// The expansion, made once.
pub static BASIS: LazyLock<Basis> = LazyLock::new(make_basis);

fn make_basis() -> Basis {
    let n = COEFFS;
    let (mut energy, mut mass) = (DMatrix::<f64>::zeros(n, n), DMatrix::<f64>::zeros(n, n));
    let scale = INTERVALS as f64 * 0.5;
    let width = 2.0 / INTERVALS as f64;
    for i in 0..INTERVALS {
        for j in 0..INTERVALS {
            for (s, ws) in GAUSS {
                for (t, wt) in GAUSS {
                    let u = (i as f64 + s) * width - 1.0;
                    let v = (j as f64 + t) * width - 1.0;
                    // The data lie in the disk. Outside, a little energy and next to no mass: a function that
                    // lives in the corners costs much and is left out of the expansion.
                    let inside = u * u + v * v <= 1.1;
                    let area = ws * wt * width * width;
                    let (we, wm) = if inside { (area, area) } else { (0.02 * area, 1e-4 * area) };
                    let (a, b) = (spline(s), spline(t));
                    let (da, db) = (spline_d1(s), spline_d1(t));
                    let (dda, ddb) = (spline_d2(s), spline_d2(t));
                    let mut f = [(0usize, 0.0, 0.0, 0.0, 0.0); 16];
                    for k in 0..4 {
                        for l in 0..4 {
                            f[k * 4 + l] = (
                                (i + k) * SIDE + j + l,
                                a[k] * b[l],
                                dda[k] * b[l] * scale * scale,
                                da[k] * db[l] * scale * scale,
                                a[k] * ddb[l] * scale * scale,
                            );
                        }
                    }
                    for p in &f {
                        for q in &f {
                            mass[(p.0, q.0)] += wm * p.1 * q.1;
                            energy[(p.0, q.0)] += we * (p.2 * q.2 + 2.0 * p.3 * q.3 + p.4 * q.4);
                        }
                    }
                }
            }
        }
    }
    let factor = mass.cholesky().expect("the mass matrix of B-splines is positive definite").l();
    let half = factor.solve_lower_triangular(&energy).expect("a Cholesky factor is invertible");
    let reduced = factor.solve_lower_triangular(&half.transpose()).expect("a Cholesky factor is invertible");
    let eigen = SymmetricEigen::new((&reduced + reduced.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let mut basis = Basis { modes: vec![0.0; COEFFS * WIDTH], precision: vec![0.0; MODES] };
    for (m, &k) in order.iter().take(MODES).enumerate() {
        let vector = eigen.eigenvectors.column(k).into_owned();
        let coeffs =
            factor.transpose().solve_upper_triangular(&vector).expect("a Cholesky factor is invertible");
        for c in 0..COEFFS {
            basis.modes[c * WIDTH + m] = coeffs[c];
        }
        if m >= FREE {
            basis.precision[m] = eigen.eigenvalues[k].powf(PRIOR.order);
        }
    }
    basis
}

/// Spline coefficients of a weighted sum of eigenfunctions.
#[must_use]
pub fn spline_coefficients(basis: &Basis, modes: &[f64]) -> [f32; COEFFS] {
    let mut out = [0f32; COEFFS];
    for (o, row) in out.iter_mut().zip(basis.modes.chunks_exact(WIDTH)) {
        *o = row.iter().zip(modes).map(|(a, b)| a * b).sum::<f64>() as f32;
    }
    out
}

/// Adds `factor` times the values of the eigenfunctions at a place of [-1, 1]^2; as many as `values` takes.
pub fn add_values(basis: &Basis, at: [f64; 2], factor: f64, values: &mut [f64]) {
    let ((i, s), (j, t)) = (locate(at[0]), locate(at[1]));
    let (a, b) = (spline(s), spline(t));
    for (k, a) in a.iter().enumerate() {
        for (l, b) in b.iter().enumerate() {
            let (row, c) = (&basis.modes[((i + k) * SIDE + j + l) * WIDTH..], factor * a * b);
            values.iter_mut().zip(row).for_each(|(x, m)| *x += c * m);
        }
    }
}
