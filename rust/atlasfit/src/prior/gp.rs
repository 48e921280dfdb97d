//! The Gaussian-process limit of the paper's networks, as a prior on one chart's height over its base plane.
//!
//! A fully connected ReLU network tends to a Gaussian process with the order-1 arc-cosine kernel as it grows
//! wide (paper, section 4; Cho and Saul 2009). In two dimensions that kernel is a Sobolev prior of order 5/2.
//! Its Karhunen-Loève expansion on the chart's domain is used here: the eigenfunctions of the bending energy
//! (its neighbour of order 2), with eigenvalues raised from order 2 to order 5/2. Smooth functions come
//! first, so a few dozen of them carry every patch that a handful of points can show, and one fit is one
//! small solve.
//!
//! In: points over the unit disk with heights and weights. Out: spline coefficients of the height, the
//! smoothness and the noise that the data supports.

use super::basis::{Basis, WIDTH};
use super::constants::{FREE, MODES, PRIOR};
use super::evidence::{Problem, Solution, Work};
use super::normal_equations::NormalEquations;

/// Chooses smoothness and noise by restricted marginal likelihood and solves for the weights of the
/// eigenfunctions.
///
/// `expected` is the noise expected beforehand and how many points that is worth; `near` a value of log kappa
/// that is likely.
#[must_use]
pub fn fit(
    basis: &Basis,
    data: &NormalEquations,
    expected: (f64, f64),
    near: Option<f64>,
    work: &mut Work,
) -> Option<Solution> {
    problem(data, expected).solve(near.unwrap_or(PRIOR.likely), work, |kappa, system| {
        penalised(basis, data, kappa, system);
    })
}

/// [`fit`] at a given smoothness.
#[must_use]
pub fn fit_at(
    basis: &Basis,
    data: &NormalEquations,
    expected: (f64, f64),
    log_kappa: f64,
    work: &mut Work,
) -> Option<Solution> {
    problem(data, expected).at(log_kappa, work, |kappa, system| penalised(basis, data, kappa, system))
}

fn problem(data: &NormalEquations, expected: (f64, f64)) -> Problem {
    Problem { unknowns: MODES, free: FREE, count: data.count, expected, range: PRIOR.log_kappa }
}

/// The normal equations with the prior's precision.
fn penalised(basis: &Basis, data: &NormalEquations, kappa: f64, system: &mut [f64]) {
    system.copy_from_slice(&data.matrix);
    for (x, p) in system.iter_mut().step_by(WIDTH + 1).zip(&basis.precision) {
        // The last term keeps the affine part solvable when few points carry it.
        *x += kappa * p + 1e-9;
    }
}
