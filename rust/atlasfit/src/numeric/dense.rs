//! Small dense symmetric systems: the elimination that every chart's solve runs on, principal axes.
//!
//! Matrices are row-major slices of n*n; only the upper triangle counts.

use super::vec3::Vec3;
use pulp::{Arch, Scalar, Simd, WithSimd};

/// Factors the symmetric positive definite `a` (n x n, upper triangle) as Uᵀ U in place. False if a pivot is
/// not positive: the matrix is not numerically positive definite and its content is then meaningless. For a
/// handful of unknowns; [`eliminate`] is for dozens.
///
/// ```
/// use atlasfit::numeric::dense::{cholesky, cholesky_solve};
/// let (mut a, mut b) = ([4.0, 2.0, 0.0, 5.0], [8.0, 12.0]);
/// assert!(cholesky(&mut a, 2));
/// cholesky_solve(&a, 2, &mut b);
/// assert_eq!(b, [1.0, 2.0]);
/// ```
#[must_use]
pub fn cholesky(a: &mut [f64], n: usize) -> bool {
    for p in 0..n {
        let (above, row) = a.split_at_mut(p * n);
        let row = &mut row[p..n];
        for done in above.chunks_exact(n) {
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
    true
}

/// Rows that [`eliminate`] finishes at a time: with three vectors of each they fill the registers of any
/// 64-bit processor.
const ROWS: usize = 4;
/// Numbers in the widest vector that the kernels here and of the fits are run with; rows and columns are
/// filled up to a multiple of it.
pub const LANES: usize = 4;

/// Eliminates the first `pivots` rows of the symmetric `a` (`width` x `width`, upper triangle, `width` a
/// multiple of [`LANES`]) from those below: they become rows of the factor U, and the rest what they leave of
/// it (the Schur complement). False if a pivot is not positive.
///
/// Left-looking, `ROWS` rows at a time: what all rows above take from a few vectors of them is summed up in
/// registers, so that an entry is loaded and stored once. Vectors are chosen at run time and whole: the
/// entries of a row just left of its diagonal change too.
///
/// ```
/// use atlasfit::numeric::dense::{LANES, eliminate};
/// let mut a = vec![0.0; LANES * LANES];
/// (0..LANES).for_each(|i| a[i * LANES + i] = 4.0);
/// a[1] = 2.0;
/// assert!(eliminate(&mut a, LANES, 1));
/// // The first row of U, and what it leaves of the second: 4 - 2^2 / 4.
/// assert_eq!((a[0], a[1], a[LANES + 1]), (2.0, 1.0, 3.0));
/// ```
#[must_use]
pub fn eliminate(a: &mut [f64], width: usize, pivots: usize) -> bool {
    assert!(width.is_multiple_of(LANES) && a.len() == width * width && pivots <= width);
    Arch::new().dispatch(Eliminate { a, width, pivots })
}

/// How many `f64` the vector instructions that this processor has and that are used take at once; 1 = none.
///
/// ```
/// assert!(atlasfit::numeric::dense::lanes_here() >= 1);
/// ```
#[must_use]
pub fn lanes_here() -> usize {
    Arch::new().dispatch(LanesHere)
}

struct LanesHere;

impl WithSimd for LanesHere {
    type Output = usize;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        if S::F64_LANES > LANES { 1 } else { S::F64_LANES }
    }
}

struct Eliminate<'a> {
    a: &'a mut [f64],
    width: usize,
    pivots: usize,
}

impl WithSimd for Eliminate<'_> {
    type Output = bool;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        // Wider ones exist only where another crate has turned them on in pulp.
        if S::F64_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let Self { a, width: n, pivots } = self;
        for first in (0..n).step_by(ROWS) {
            let (above, rows) = a.split_at_mut(first * n);
            let above = &above[..first.min(pivots) * n];
            let rows = &mut rows[..ROWS * n];
            let mut from = first / S::F64_LANES;
            while from < n / S::F64_LANES {
                from += match n / S::F64_LANES - from {
                    1 => take_above::<S, 1>(simd, above, rows, n, [first, from]),
                    2 => take_above::<S, 2>(simd, above, rows, n, [first, from]),
                    _ => take_above::<S, 3>(simd, above, rows, n, [first, from]),
                };
            }
            for p in first..(first + ROWS).min(pivots) {
                let (done, below) = rows.split_at_mut((p - first + 1) * n);
                let row = &mut done[(p - first) * n..];
                let pivot = row[p];
                if !(pivot > 0.0 && pivot.is_finite()) {
                    return false;
                }
                let from = first / S::F64_LANES;
                let inverse = simd.splat_f64s(1.0 / pivot.sqrt());
                for x in &mut S::as_mut_simd_f64s(row).0[from..] {
                    *x = simd.mul_f64s(*x, inverse);
                }
                for (i, below) in (p + 1..).zip(below.chunks_exact_mut(n)) {
                    let f = simd.splat_f64s(row[i]);
                    let row = &S::as_simd_f64s(row).0[from..];
                    for (t, r) in S::as_mut_simd_f64s(below).0[from..].iter_mut().zip(row) {
                        *t = simd.negate_mul_add_e_f64s(f, *r, *t);
                    }
                }
            }
        }
        true
    }
}

/// Takes from `V` vectors of each of the rows from row `first`, from vector `from` on, what the finished rows
/// above eliminate of them. Returns `V`.
#[inline(always)]
fn take_above<S: Simd, const V: usize>(
    simd: S,
    above: &[f64],
    rows: &mut [f64],
    n: usize,
    [first, from]: [usize; 2],
) -> usize {
    let vectors = n / S::F64_LANES;
    let rows = S::as_mut_simd_f64s(rows).0;
    // Loops, not closures: those would not be compiled for the wider vectors.
    let mut sums = [[simd.splat_f64s(0.0); V]; ROWS];
    for r in 0..ROWS {
        sums[r].copy_from_slice(&rows[r * vectors + from..][..V]);
    }
    for (done, factors) in S::as_simd_f64s(above).0.chunks_exact(vectors).zip(above.chunks_exact(n)) {
        let (done, factors) = (&done[from..from + V], &factors[first..first + ROWS]);
        for r in 0..ROWS {
            let f = simd.splat_f64s(factors[r]);
            for v in 0..V {
                sums[r][v] = simd.negate_mul_add_e_f64s(f, done[v], sums[r][v]);
            }
        }
    }
    for r in 0..ROWS {
        rows[r * vectors + from..][..V].copy_from_slice(&sums[r]);
    }
    V
}

/// Solves Uᵀ U x = b in place for a factor made by [`cholesky`].
///
/// ```
/// use atlasfit::numeric::dense::cholesky_solve;
/// let mut b = [8.0];
/// cholesky_solve(&[2.0], 1, &mut b);
/// assert_eq!(b, [2.0]);
/// ```
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

/// Eigenvalues (ascending) and unit eigenvectors of the symmetric 3 x 3 matrix with entries
/// xx, xy, xz, yy, yz, zz. Jacobi rotations: exact to rounding, also for repeated eigenvalues.
///
/// ```
/// let (values, vectors) = atlasfit::numeric::dense::eigen3([2.0, 0.0, 0.0, 3.0, 0.0, 1.0]);
/// assert_eq!((values, vectors[0][2].abs()), ([1.0, 2.0, 3.0], 1.0));
/// ```
#[must_use]
pub fn eigen3(m: [f64; 6]) -> ([f64; 3], [Vec3; 3]) {
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
    let column = |i: usize| Vec3([v[0][i], v[1][i], v[2][i]]);
    (order.map(|i| a[i][i]), order.map(column))
}

/// Where points lie and how they spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// Their weighted mean.
    pub mean: Vec3,
    /// Their principal variances, ascending.
    pub variances: [f64; 3],
    /// Their principal axes, unit vectors in the same order.
    pub axes: [Vec3; 3],
}

/// Weighted mean, principal variances (ascending) and principal axes of points; `None` without weight.
///
/// ```
/// use atlasfit::{Vec3, numeric::dense::principal};
/// let points = [-1.0, 3.0].map(|x| (Vec3([x, 0.0, 0.0]), 1.0));
/// let found = principal(points.into_iter()).unwrap();
/// assert_eq!((found.mean[0], found.variances[2], found.axes[2][0].abs()), (1.0, 4.0, 1.0));
/// assert_eq!(principal(std::iter::empty()), None);
/// ```
#[must_use]
pub fn principal(points: impl Iterator<Item = (Vec3, f64)> + Clone) -> Option<Principal> {
    let (mut total, mut mean) = (0.0, Vec3::ZERO);
    for (p, w) in points.clone() {
        total += w;
        mean += p * w;
    }
    if total <= 0.0 {
        return None;
    }
    let mean = mean * (1.0 / total);
    let m = second_moments(points.map(|(p, w)| (p - mean, w)));
    let (variances, axes) = eigen3(m.map(|x| x / total));
    Some(Principal { mean, variances, axes })
}

/// Weighted sums of the products of coordinates: xx, xy, xz, yy, yz, zz.
pub(crate) fn second_moments(vectors: impl Iterator<Item = (Vec3, f64)>) -> [f64; 6] {
    let mut m = [0.0; 6];
    for (d, w) in vectors {
        for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            m[k] += w * d[i] * d[j];
        }
    }
    m
}
