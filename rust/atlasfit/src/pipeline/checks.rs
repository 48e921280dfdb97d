//! What a scan must be to have a surface.
//!
//! In: its points, spacing or size. Out: nothing, or an error that says what is wrong and what to do.

use super::constants::PIPELINE;
use crate::error::{Error, Result};
use crate::numeric::dense::principal;
use crate::numeric::vec3::Vec3;

/// The least number of distinct points that make a surface.
pub const MIN_POINTS: usize = 12;

/// Fails where no position is finite.
pub(super) fn any(points: &[Vec3], given: usize, not_finite: usize) -> Result<()> {
    if given == 0 {
        return Err(Error::empty(
            "the scan has no points",
            "Give a file with at least a few hundred points on a surface",
        ));
    }
    if points.is_empty() {
        return Err(Error::empty(
            format!("none of the {not_finite} points has finite coordinates"),
            "Check the file's columns and units",
        ));
    }
    Ok(())
}

/// Fails where the given noise is as large as the scan; both are in the user's unit.
pub(super) fn given_noise(given: Option<f64>, scale: f64) -> Result<()> {
    match given {
        Some(noise) if noise > PIPELINE.most_noise * scale => Err(Error::invalid(
            format!("noise is {noise}, but the scan is only {scale} long"),
            "Give the noise in the scan's unit, or none to estimate it",
        )),
        _ => Ok(()),
    }
}

/// Fails where the `usual` spacing is as good as none.
pub(super) fn spacing(usual: f64) -> Result<()> {
    if usual < PIPELINE.least_spacing {
        return Err(Error::degenerate(
            "most points all but coincide beside the scan's extent",
            "Cut away what lies far off, or give points that lie on a surface",
        ));
    }
    Ok(())
}

/// Fails on points that span no surface: too few, or all on a line.
///
/// # Errors
/// [`Error::Degenerate`].
pub(crate) fn surface(points: &[Vec3]) -> Result<()> {
    let degenerate = |what: String| {
        Err(Error::degenerate(what, "Give points that lie on a surface, a few hundred at least"))
    };
    if points.len() < MIN_POINTS {
        return degenerate(format!("only {} distinct points", points.len()));
    }
    let spread = principal(points.iter().map(|&p| (p, 1.0)));
    if spread.is_none_or(|s| s.variances[1] <= 1e-14 * s.variances[2]) {
        return degenerate("the points lie on a line".into());
    }
    Ok(())
}
