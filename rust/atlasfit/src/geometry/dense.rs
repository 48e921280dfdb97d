//! Small dense symmetric systems: the Cholesky factorisation that every chart's solve runs on.
//!
//! Matrices are row-major slices of n*n; only the lower triangle is read and written.

/// Factors the symmetric positive definite `a` (n x n, lower triangle) as L Lᵀ in place. False if a pivot is not
/// positive: the matrix is not numerically positive definite and its content is then meaningless.
#[must_use]
pub fn cholesky(a: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        let (above, rest) = a.split_at_mut(j * n);
        let row_j = &mut rest[..n];
        // Row j of L: each entry needs the rows above it only.
        for k in 0..j {
            let row_k = &above[k * n..k * n + k + 1];
            let mut s = row_j[k];
            for (x, y) in row_j[..k].iter().zip(&row_k[..k]) {
                s -= x * y;
            }
            row_j[k] = s / row_k[k];
        }
        let mut d = row_j[j];
        for x in &row_j[..j] {
            d -= x * x;
        }
        if !(d > 0.0 && d.is_finite()) {
            return false;
        }
        row_j[j] = d.sqrt();
    }
    true
}

/// Solves L Lᵀ x = b in place for a factor made by [`cholesky`].
pub fn cholesky_solve(l: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let row = &l[i * n..i * n + i + 1];
        let s: f64 = row[..i].iter().zip(b.iter()).map(|(a, x)| a * x).sum();
        b[i] = (b[i] - s) / row[i];
    }
    for i in (0..n).rev() {
        b[i] /= l[i * n + i];
        let x = b[i];
        for (k, v) in b[..i].iter_mut().enumerate() {
            *v -= l[i * n + k] * x;
        }
    }
}

/// log det of L Lᵀ.
#[must_use]
pub fn cholesky_log_det(l: &[f64], n: usize) -> f64 {
    2.0 * (0..n).map(|i| l[i * n + i].ln()).sum::<f64>()
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
            for k in 0..3 {
                let (x, y) = (a[p][k], a[q][k]);
                a[p][k] = c * x - s * y;
                a[q][k] = s * x + c * y;
            }
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
