//! The Gaussian-process limit of the paper's networks, as a prior on one chart's height over its base plane.
//!
//! A fully connected ReLU network tends to a Gaussian process with the order-1 arc-cosine kernel as it grows
//! wide (paper, section 4; Cho and Saul 2009). In two dimensions that kernel is a Sobolev prior of order 5/2. Its
//! Karhunen-Loève expansion on the chart's domain is used here: the eigenfunctions of the bending energy (its
//! neighbour of order 2), with eigenvalues raised from order 2 to order 5/2. Smooth functions come first, so a few
//! dozen of them carry every patch that a handful of points can show, and one fit is one small solve.
//!
//! In: points over the unit disk with heights and weights. Out: spline coefficients of the height, the smoothness and
//! the noise that the data supports.

use super::evidence::{Problem, Solution, Work};
use super::normal::{Normal, WIDTH};
use nalgebra::{DMatrix, SymmetricEigen};
use std::sync::LazyLock;

/// Spline intervals across the chart's domain [-1, 1]. Eight intervals resolve a quarter of the chart's radius, about the
/// point spacing when a chart holds a hundred points.
pub const INTERVALS: usize = 8;
/// Cubic B-spline coefficients along one axis.
pub const SIDE: usize = INTERVALS + 3;
/// Coefficients of one chart.
pub const COEFFS: usize = SIDE * SIDE;
/// Eigenfunctions kept. Half the number of points in a typical chart; more only fit noise, and the cost of a fit grows with
/// the cube.
pub const MODES: usize = 50;
/// The affine functions: no bending, hence no prior on them.
const FREE: usize = 3;
/// Eigenvalues of the bending energy grow like frequency^4; the arc-cosine kernel's precision like frequency^5.
const ORDER: f64 = 5.0 / 4.0;

/// The expansion shared by all charts.
pub struct Basis {
    /// Spline coefficients of each eigenfunction: COEFFS rows of MODES, filled up to WIDTH.
    pub modes: Vec<f64>,
    /// Prior precision of each eigenfunction, up to one scale; 0 for the affine ones.
    pub precision: Vec<f64>,
}

/// The expansion, made once.
pub static BASIS: LazyLock<Basis> = LazyLock::new(make_basis);

/// Values (or derivatives) of the four cubic B-splines that live on one interval, at t in [0, 1].
#[inline]
pub(crate) fn spline(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    let (t2, t3) = (t * t, t * t * t);
    [
        s * s * s / 6.0,
        (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0,
        (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0,
        t3 / 6.0,
    ]
}
#[inline]
pub(crate) fn spline_d1(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-s * s / 2.0, (3.0 * t * t - 4.0 * t) / 2.0, (-3.0 * t * t + 2.0 * t + 1.0) / 2.0, t * t / 2.0]
}
#[inline]
pub(crate) fn spline_d2(t: f64) -> [f64; 4] {
    [1.0 - t, 3.0 * t - 2.0, 1.0 - 3.0 * t, t]
}
/// Interval and offset of coordinate `x` in [-1, 1]; clamped outside.
#[inline]
pub(crate) fn locate(x: f64) -> (usize, f64) {
    let g = ((x + 1.0) * (INTERVALS as f64 * 0.5)).clamp(0.0, INTERVALS as f64 * (1.0 - 1e-12));
    let i = g as usize;
    (i, g - i as f64)
}

/// Height at (u, v) in the domain [-1, 1]^2.
#[inline]
#[must_use]
pub fn value(coeffs: &[f32; COEFFS], u: f64, v: f64) -> f64 {
    let ((i, s), (j, t)) = (locate(u), locate(v));
    let (a, b) = (spline(s), spline(t));
    let mut sum = 0.0;
    for (k, ak) in a.iter().enumerate() {
        let row = &coeffs[(i + k) * SIDE + j..(i + k) * SIDE + j + 4];
        sum += ak
            * (b[0] * f64::from(row[0])
                + b[1] * f64::from(row[1])
                + b[2] * f64::from(row[2])
                + b[3] * f64::from(row[3]));
    }
    sum
}

/// Height and its two derivatives at (u, v) in the domain [-1, 1]^2.
#[inline]
#[must_use]
pub fn value_gradient(coeffs: &[f32; COEFFS], u: f64, v: f64) -> (f64, f64, f64) {
    let ((i, s), (j, t)) = (locate(u), locate(v));
    let (a, b, da, db) = (spline(s), spline(t), spline_d1(s), spline_d1(t));
    let (mut h, mut hu, mut hv) = (0.0, 0.0, 0.0);
    for k in 0..4 {
        let row = &coeffs[(i + k) * SIDE + j..(i + k) * SIDE + j + 4];
        let r = [f64::from(row[0]), f64::from(row[1]), f64::from(row[2]), f64::from(row[3])];
        let p = b[0] * r[0] + b[1] * r[1] + b[2] * r[2] + b[3] * r[3];
        h += a[k] * p;
        hu += da[k] * p;
        hv += a[k] * (db[0] * r[0] + db[1] * r[1] + db[2] * r[2] + db[3] * r[3]);
    }
    let scale = INTERVALS as f64 * 0.5;
    (h, hu * scale, hv * scale)
}

/// Second derivatives (uu, uv, vv) of the height at (u, v) in the domain.
#[must_use]
pub fn hessian(coeffs: &[f32; COEFFS], u: f64, v: f64) -> (f64, f64, f64) {
    let ((i, s), (j, t)) = (locate(u), locate(v));
    let (a, b, da, db) = (spline(s), spline(t), spline_d1(s), spline_d1(t));
    let (dda, ddb) = (spline_d2(s), spline_d2(t));
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    for k in 0..4 {
        for l in 0..4 {
            let c = f64::from(coeffs[(i + k) * SIDE + j + l]);
            uu += dda[k] * b[l] * c;
            uv += da[k] * db[l] * c;
            vv += a[k] * ddb[l] * c;
        }
    }
    let scale = (INTERVALS as f64 * 0.5).powi(2);
    (uu * scale, uv * scale, vv * scale)
}

/// Gauss-Legendre nodes and weights on [0, 1], 4 points: exact for products of cubics.
pub(crate) const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_727),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273),
    (0.930_568_155_797_026_3, 0.173_927_422_568_727),
];

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
                    // The data lie in the disk. Outside, a little energy and next to no mass: a function that lives in
                    // the corners costs much and is left out of the expansion.
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
            basis.precision[m] = eigen.eigenvalues[k].powf(ORDER);
        }
    }
    basis
}

/// The range in which smoothness is chosen, natural logarithm of kappa: from interpolation to a plane.
const LOG_KAPPA: (f64, f64) = (-23.0, 4.5);
/// Where the search begins: what most charts of a scan have, or a step beside it.
const LIKELY: f64 = -2.0;

/// Chooses smoothness and noise by restricted marginal likelihood and solves for the weights of the eigenfunctions.
///
/// `expected` is the noise expected beforehand and how many points that is worth; `near` a value of log kappa that is likely.
#[must_use]
pub fn fit(
    basis: &Basis,
    data: &Normal,
    expected: (f64, f64),
    near: Option<f64>,
    work: &mut Work,
) -> Option<Solution> {
    let problem = Problem { unknowns: MODES, free: FREE, count: data.count, expected, range: LOG_KAPPA };
    problem.solve(near.unwrap_or(LIKELY), work, |kappa, system| {
        system.copy_from_slice(&data.matrix);
        for (x, p) in system.iter_mut().step_by(WIDTH + 1).zip(&basis.precision) {
            // The last term keeps the affine part solvable when few points carry it.
            *x += kappa * p + 1e-9;
        }
    })
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
