//! Training that has left the finite numbers.
//!
//! In: numbers of one step. Out: nothing, or the error that says so.

use atlasfit::error::{Error, Result};

/// Fails where one of the numbers of training step `step` is not finite.
///
/// # Errors
/// [`Error::Diverged`].
pub(crate) fn check_finite(numbers: impl IntoIterator<Item = f64>, step: usize) -> Result<()> {
    match numbers.into_iter().find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(x) => Err(Error::Diverged {
            what: format!("a network gives {x} after {step} steps of training"),
            advice: "Lower the learning rate, or the weight of the stretch".into(),
        }),
    }
}
