//! How strongly to denoise: charts fitted again, smoother or rougher than the scan asks for.
//!
//! In: an oriented atlas. Out: the same charts, facing the same way, of the same points, with other heights,
//! and where they now put the points. What lies on which sheet, and what is an outlier, does not depend on
//! the strength.

use super::options::DenoiseOptions;
use super::prepare::Scan;
use super::sheets::OrientedAtlas;
use crate::blend::project;
use crate::error::Result;
use crate::fit;
use crate::partition::tubes;
use crate::prior::smoothing::Smoothing;
use crate::run::{Context, Stage};

/// Applies the strength and the noise that the user gave. `guided` says that a guide has followed the scan
/// and has left little of that noise.
pub(super) fn apply(
    scan: &Scan,
    atlas: &mut OrientedAtlas,
    options: &DenoiseOptions,
    guided: bool,
    ctx: &Context<'_>,
) -> Result<()> {
    let given = options.noise.filter(|_| !guided);
    let smoothing = Smoothing {
        strength: options.strength,
        noise: given.map(|noise| scan.input.noise_of_points(noise / scan.frame.scale)),
    };
    if smoothing.is_usual() {
        return Ok(());
    }
    ctx.stage(Stage::Fit, atlas.fitted.len());
    tubes::refit(&scan.points, &mut atlas.fitted, smoothing, ctx)?;
    fit::refit(&scan.points, &mut atlas.fitted, smoothing, ctx)?;
    atlas.projected = project::project_members(&scan.points, &atlas.fitted, &atlas.members, ctx)?;
    Ok(())
}
