//! The default prior on a chart's height, as others may look at it.
//!
//! In: a place of the unit disk. Out: the prior's eigenfunctions there, and their precisions.

use super::basis::{BASIS, add_values};
use super::constants::{BENDS, MODES, PRIOR};

/// The values at (u, v) in [-1, 1]^2 of the functions whose weights the prior believes independent, the
/// smoothest first.
///
/// ```
/// use atlasfit::prior::{eigenfunctions, precisions};
/// let values = eigenfunctions(0.3, -0.5);
/// assert_eq!(values.len(), precisions().len());
/// // Nothing is believed of a plane's height and slopes, and bending costs more the finer it is.
/// assert!(precisions()[..3] == [0.0; 3] && precisions()[3..].is_sorted());
/// ```
#[must_use]
pub fn eigenfunctions(u: f64, v: f64) -> Vec<f64> {
    let mut values = vec![0.0; MODES];
    add_values(&BASIS, [u, v], 1.0, &mut values);
    values
}

/// The precisions of the weights, all up to one factor; 0 where nothing is believed.
#[must_use]
pub fn precisions() -> &'static [f64] {
    &BASIS.precision
}

/// The same where a chart's points say that it bends more freely than the spectrum tells: of [`precisions`]
/// and these a chart takes the likelier.
#[must_use]
pub fn freer_precisions() -> Vec<f64> {
    let share = |m: usize| if m < BENDS { PRIOR.bends } else { 1.0 };
    BASIS.precision.iter().enumerate().map(|(m, p)| share(m) * p).collect()
}
