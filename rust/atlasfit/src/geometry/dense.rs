//! Small dense symmetric systems: the Cholesky factorisation that every chart's solve runs on, principal axes.
//!
//! Matrices are row-major slices of n*n; only the upper triangle is read and written.

use super::vec3::{Vec3, mul_add, scale, sub};

/// Factors the symmetric positive definite `a` (n x n, upper triangle) as Uᵀ U in place. False if a pivot is not positive: the matrix
/// is not numerically positive definite and its content is then meaningless.
///
/// Right-looking by rows, [`ROWS`] pivots at a time: every inner loop runs along a row and has no carried sum, so it vectorises, and an entry is loaded and
/// stored once for several pivots.
#[must_use]
pub fn cholesky(a: &mut [f64], n: usize) -> bool {
    let mut k = 0;
    while k < n {
        let end = (k + ROWS).min(n);
        let (upper, lower) = a.split_at_mut(end * n);
        for p in k..end {
            let (above, row) = upper.split_at_mut(p * n);
            let row = &mut row[p..n];
            for done in above[k * n..].chunks_exact(n) {
                let f = done[p];
                for (t, r) in row.iter_mut().zip(&done[p..]) {
                    *t -= f * r;
                }
            }
            let pivot = row[0];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            let inverse = 1.0 / pivot.sqrt();
            for x in row.iter_mut() {
                *x *= inverse;
            }
        }
        // Rows are left only below a whole block.
        let mut rows = upper[k * n..].chunks_exact(n);
        if let [Some(p), Some(q), Some(r), Some(s)] = [0; ROWS].map(|_| rows.next()) {
            for (i, row) in (end..n).zip(lower.chunks_exact_mut(n)) {
                let f = [p[i], q[i], r[i], s[i]];
                let of = p[i..].iter().zip(&q[i..]).zip(r[i..].iter().zip(&s[i..]));
                for (t, ((p, q), (r, s))) in row[i..].iter_mut().zip(of) {
                    *t = *t - f[0] * p - f[1] * q - f[2] * r - f[3] * s;
                }
            }
        }
        k = end;
    }
    true
}

/// Pivots that [`cholesky`] takes at a time: what fits into the registers of any 64-bit processor.
const ROWS: usize = 4;

/// Solves Uᵀ U x = b in place for a factor made by [`cholesky`].
pub fn cholesky_solve(u: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let row = &u[i * n + i..(i + 1) * n];
        let x = b[i] / row[0];
        b[i] = x;
        for (t, r) in b[i + 1..n].iter_mut().zip(&row[1..]) {
            *t -= x * r;
        }
    }
    for i in (0..n).rev() {
        let row = &u[i * n + i..(i + 1) * n];
        let s: f64 = row[1..].iter().zip(&b[i + 1..n]).map(|(a, x)| a * x).sum();
        b[i] = (b[i] - s) / row[0];
    }
}

/// log det of Uᵀ U.
#[must_use]
pub fn cholesky_log_det(u: &[f64], n: usize) -> f64 {
    2.0 * (0..n).map(|i| u[i * n + i].ln()).sum::<f64>()
}

/// Eigenvalues (ascending) and unit eigenvectors of the symmetric 3 x 3 matrix with entries
/// xx, xy, xz, yy, yz, zz. Jacobi rotations: exact to rounding, also for repeated eigenvalues.
#[must_use]
pub fn eigen3(m: [f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut a = [[m[0], m[1], m[2]], [m[1], m[3], m[4]], [m[2], m[4], m[5]]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..32 {
        let off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
        let scale = a[0][0] * a[0][0] + a[1][1] * a[1][1] + a[2][2] * a[2][2];
        if off <= 1e-30 * scale {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let t = if theta == 0.0 { 1.0 } else { t };
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                let (x, y) = (row[p], row[q]);
                row[p] = c * x - s * y;
                row[q] = s * x + c * y;
            }
            let (x, y) = (a[p], a[q]);
            a[p] = [0, 1, 2].map(|k| c * x[k] - s * y[k]);
            a[q] = [0, 1, 2].map(|k| s * x[k] + c * y[k]);
            for row in &mut v {
                let (x, y) = (row[p], row[q]);
                row[p] = c * x - s * y;
                row[q] = s * x + c * y;
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let column = |i: usize| [v[0][i], v[1][i], v[2][i]];
    (order.map(|i| a[i][i]), order.map(column))
}

/// Weighted mean, principal variances (ascending) and principal axes of points; `None` without weight.
#[must_use]
pub fn principal(points: impl Iterator<Item = (Vec3, f64)> + Clone) -> Option<(Vec3, [f64; 3], [Vec3; 3])> {
    let (mut total, mut mean) = (0.0, [0.0; 3]);
    for (p, w) in points.clone() {
        total += w;
        mean = mul_add(mean, p, w);
    }
    if total <= 0.0 {
        return None;
    }
    let mean = scale(mean, 1.0 / total);
    let mut m = [0.0; 6];
    for (p, w) in points {
        let d = sub(p, mean);
        for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            m[k] += w * d[i] * d[j];
        }
    }
    let (variances, axes) = eigen3(m.map(|x| x / total));
    Some((mean, variances, axes))
}
