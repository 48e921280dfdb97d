//! A Gaussian process as a prior on one chart's height over its base plane.
//!
//! It has the smoothness order of the limit of the paper's networks, and no more of it: a fully connected
//! ReLU network, untrained and without batch norm, tends to a Gaussian process as it grows wide (paper,
//! section 4; Cho and Saul 2009), whose spectrum in two dimensions falls as frequency^-5, at every depth: a
//! Sobolev prior of order 5/2. The paper's networks are charts from the square to space; here it is heights
//! over a plane. The Karhunen-Loève expansion on the chart's domain is used: the eigenfunctions of the
//! bending energy (the neighbour of order 2), with eigenvalues raised from order 2 to order 5/2. Smooth
//! functions come first, so a few dozen of them carry every patch that a handful of points can show, and one
//! fit is one small solve. `atlasfit gp report` says how near the expansion and its posteriors are to the
//! exact process.
//!
//! In: points over the unit disk with heights and weights. Out: spline coefficients of the height, the
//! smoothness and the noise that the data supports.

use super::basis::{Basis, WIDTH};
use super::constants::{FREE, MODES, PRIOR};
use super::evidence::{Problem, Solution, Work};
use super::normal_equations::NormalEquations;
use super::posterior::Posterior;

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

/// The posterior of the weights of the eigenfunctions at a given smoothness.
pub(crate) fn posterior(basis: &Basis, data: &NormalEquations, log_kappa: f64) -> Option<Posterior> {
    let mut system = vec![0.0; data.matrix.len()];
    penalised(basis, data, log_kappa.exp(), &mut system);
    Posterior::new(system, WIDTH, MODES)
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
