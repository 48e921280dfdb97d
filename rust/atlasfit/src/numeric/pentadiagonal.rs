//! Symmetric positive definite matrices with two diagonals beside the main one: what smoothness along a line
//! makes.

/// A matrix: for each row its diagonal entry and the next two of the row.
pub(crate) struct Pentadiagonal(pub(crate) Vec<[f64; 3]>);

/// The factor of a matrix: L D Lᵀ, for each column the pivot and the two entries of L below it.
pub(crate) struct Factor(Vec<[f64; 3]>);

impl Pentadiagonal {
    /// Factors the matrix; nothing where a pivot is not positive.
    pub(crate) fn factor(mut self) -> Option<Factor> {
        let a = &mut self.0;
        for i in 0..a.len() {
            let [pivot, b, c] = a[i];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            let (l1, l2) = (b / pivot, c / pivot);
            if let Some(row) = a.get_mut(i + 1) {
                row[0] -= l1 * b;
                row[1] -= l1 * c;
            }
            if let Some(row) = a.get_mut(i + 2) {
                row[0] -= l2 * c;
            }
            a[i] = [pivot, l1, l2];
        }
        Some(Factor(self.0))
    }
}

impl Factor {
    /// Solves for the right side `x`, in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let n = self.0.len();
        for i in 0..n {
            let [_, l1, l2] = self.0[i];
            let at = x[i];
            if i + 1 < n {
                x[i + 1] -= l1 * at;
            }
            if i + 2 < n {
                x[i + 2] -= l2 * at;
            }
        }
        for i in (0..n).rev() {
            let [pivot, l1, l2] = self.0[i];
            let below = |k: usize| x.get(i + k).copied().unwrap_or(0.0);
            x[i] = x[i] / pivot - l1 * below(1) - l2 * below(2);
        }
    }
    /// Logarithm of the determinant.
    pub(crate) fn ln_determinant(&self) -> f64 {
        self.0.iter().map(|p| p[0].ln()).sum()
    }
    /// The diagonal of the inverse (Takahashi, Fagan and Chin 1973).
    pub(crate) fn inverse_diagonal(&self) -> Vec<f64> {
        let n = self.0.len();
        // Of each row of the inverse the diagonal entry and the next two.
        let mut z = vec![[0.0; 3]; n + 2];
        for i in (0..n).rev() {
            let [pivot, l1, l2] = self.0[i];
            let [next, after] = [z[i + 1], z[i + 2]];
            let one = -l1 * next[0] - l2 * next[1];
            let two = -l1 * next[1] - l2 * after[0];
            z[i] = [1.0 / pivot - l1 * one - l2 * two, one, two];
        }
        z.truncate(n);
        z.into_iter().map(|row| row[0]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    proptest! {
        /// As dense algebra has it.
        #[test]
        fn solutions_determinant_and_inverse_are_those_of_the_dense_matrix(
            rows in proptest::collection::vec(([-1.0..1.0f64, -1.0..1.0], -5.0..5.0f64), 1..9)
        ) {
            let n = rows.len();
            let entry = |i: usize, j: usize| match j.abs_diff(i) {
                0 => 4.5,
                k if k < 3 => rows[i.min(j)].0[k - 1],
                _ => 0.0,
            };
            let dense = DMatrix::from_fn(n, n, entry);
            let matrix = (0..n).map(|i| [0, 1, 2].map(|k| if i + k < n { entry(i, i + k) } else { 0.0 }));
            let factor = Pentadiagonal(matrix.collect()).factor().expect("its diagonal dominates");
            let mut x: Vec<f64> = rows.iter().map(|r| r.1).collect();
            let b = DMatrix::from_column_slice(n, 1, &x);
            factor.solve(&mut x);
            let off = &dense * DMatrix::from_column_slice(n, 1, &x) - b;
            prop_assert!(off.amax() < 1e-9);
            let inverse = dense.clone().try_inverse().expect("its diagonal dominates");
            for (i, z) in factor.inverse_diagonal().into_iter().enumerate() {
                prop_assert!((z - inverse[(i, i)]).abs() < 1e-9);
            }
            prop_assert!((factor.ln_determinant() - dense.determinant().ln()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_has_no_factor() {
        assert!(Pentadiagonal(vec![[1.0, 2.0, 0.0], [1.0, 0.0, 0.0]]).factor().is_none());
    }
}
