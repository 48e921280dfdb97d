//! What is still uncertain of a fit: the posterior covariance of its unknowns (Wahba 1983; Rasmussen and
//! Williams 2006, section 2.2).
//!
//! In: the penalised normal equations of a fit. Out: for any linear function of the unknowns a vector; the
//! scalar products of such vectors are the covariances, in units of the noise's variance.

use crate::numeric::dense::eliminate;

/// The posterior of a fit's unknowns.
pub(crate) struct Posterior {
    /// U of the system UᵀU, upper triangle, `width` columns.
    factor: Vec<f64>,
    width: usize,
    unknowns: usize,
}

impl Posterior {
    /// Of a system of `width` columns, upper triangle; nothing where it is not positive definite.
    pub(crate) fn new(mut system: Vec<f64>, width: usize, unknowns: usize) -> Option<Self> {
        eliminate(&mut system, width, unknowns).then_some(Self { factor: system, width, unknowns })
    }

    /// Replaces a linear function of the unknowns by the vector that stands for it.
    pub(crate) fn whiten(&self, row: &mut [f64]) {
        for (i, u) in self.factor.chunks_exact(self.width).enumerate().take(self.unknowns) {
            let (done, rest) = row.split_at_mut(i + 1);
            let x = done[i] / u[i];
            done[i] = x;
            rest.iter_mut().zip(&u[i + 1..self.unknowns]).for_each(|(r, u)| *r -= x * u);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::dense::LANES;

    #[test]
    fn scalar_products_of_whitened_functions_are_those_of_the_inverse() {
        // [[4, 2], [2, 3]]: its inverse is [[3, -2], [-2, 4]] / 8.
        let mut system = vec![0.0; LANES * LANES];
        (system[0], system[1], system[LANES + 1]) = (4.0, 2.0, 3.0);
        let posterior = Posterior::new(system, LANES, 2).expect("positive definite");
        let mut rows = [[1.0, 0.0], [0.0, 1.0]];
        rows.iter_mut().for_each(|r| posterior.whiten(r));
        let product = |a: usize, b: usize| rows[a].iter().zip(&rows[b]).map(|(x, y)| x * y).sum::<f64>();
        for (is, should) in [(product(0, 0), 0.375), (product(0, 1), -0.25), (product(1, 1), 0.5)] {
            assert!((is - should).abs() < 1e-15, "{is} {should}");
        }
    }
}
