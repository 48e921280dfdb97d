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
//! The smoothest of them are bends. Whether they follow the spectrum or are freer is chosen once for a chart,
//! as the smoothness is: by the likelihood of its points.
//!
//! In: points over the unit disk with heights and weights. Out: spline coefficients of the height, the
//! smoothness and the noise that the data supports.

use super::basis::{Basis, WIDTH};
use super::constants::{BENDS, FREE, MODES, PRIOR};
use super::evidence::{Problem, Solution, Work};
use super::normal_equations::NormalEquations;
use super::posterior::Posterior;
use crate::atlas::Smoothness;

/// A fit of one chart.
pub struct Fit {
    /// Weights of the eigenfunctions.
    pub weights: Vec<f64>,
    /// Standard deviation of the noise.
    pub sigma: f64,
    /// The smoothness it was made with.
    pub smoothness: Smoothness,
}

/// Chooses smoothness and noise by restricted marginal likelihood and solves for the weights of the
/// eigenfunctions.
///
/// `expected` is the noise expected beforehand and how many points that is worth; `near` what was chosen when
/// the chart was fitted before: its bends stay.
#[must_use]
pub fn fit(
    basis: &Basis,
    data: &NormalEquations,
    expected: (f64, f64),
    near: Option<Smoothness>,
    work: &mut Work,
) -> Option<Fit> {
    let problem = problem(data, expected);
    let mut climb = |from: f64, bends: f64| {
        problem.solve(from, work, |kappa, system| penalised(basis, data, kappa, bends, system))
    };
    if let Some(Smoothness { log_kappa, bends }) = near {
        return Some(made(climb(log_kappa, bends)?, bends));
    }
    let spectral = climb(PRIOR.likely, 1.0)?;
    let freer = climb(spectral.log_kappa, PRIOR.bends)?;
    let likelier = score(&freer, PRIOR.bends) < score(&spectral, 1.0);
    Some(if likelier { made(freer, PRIOR.bends) } else { made(spectral, 1.0) })
}

/// [`fit`] at a given smoothness.
#[must_use]
pub fn fit_at(
    basis: &Basis,
    data: &NormalEquations,
    expected: (f64, f64),
    smoothness: Smoothness,
    work: &mut Work,
) -> Option<Fit> {
    let Smoothness { log_kappa, bends } = smoothness;
    let solution = problem(data, expected)
        .at(log_kappa, work, |kappa, system| penalised(basis, data, kappa, bends, system))?;
    Some(made(solution, bends))
}

/// The posterior of the weights of the eigenfunctions at a given smoothness.
pub(crate) fn posterior(
    basis: &Basis,
    data: &NormalEquations,
    Smoothness { log_kappa, bends }: Smoothness,
) -> Option<Posterior> {
    let mut system = vec![0.0; data.matrix.len()];
    penalised(basis, data, log_kappa.exp(), bends, &mut system);
    Posterior::new(system, WIDTH, MODES)
}

fn problem(data: &NormalEquations, expected: (f64, f64)) -> Problem {
    Problem { unknowns: MODES, free: FREE, count: data.count, expected, range: PRIOR.log_kappa }
}

/// Twice the negative log likelihood: what the solution says, less the logarithm of the bends' precision,
/// which it does not know.
fn score(solution: &Solution, bends: f64) -> f64 {
    solution.score - (BENDS - FREE) as f64 * bends.ln()
}

fn made(solution: Solution, bends: f64) -> Fit {
    let Solution { weights, sigma, log_kappa, .. } = solution;
    Fit { weights, sigma, smoothness: Smoothness { log_kappa, bends } }
}

/// The normal equations with the prior's precision.
fn penalised(basis: &Basis, data: &NormalEquations, kappa: f64, bends: f64, system: &mut [f64]) {
    system.copy_from_slice(&data.matrix);
    for (m, (x, p)) in system.iter_mut().step_by(WIDTH + 1).zip(&basis.precision).enumerate() {
        let share = if m < BENDS { bends } else { 1.0 };
        // The last term keeps the affine part solvable when few points carry it.
        *x += kappa * share * p + 1e-9;
    }
}
