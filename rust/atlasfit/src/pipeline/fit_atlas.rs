//! The first atlas: tubes where the scan is thin, patches elsewhere, a chart for each.
//!
//! In: a prepared scan. Out: fitted charts, not yet oriented; the scan's noise as they know it.

use super::prepare::Scan;
use crate::atlas::FittedChart;
use crate::blend::membership;
use crate::error::{Error, Result};
use crate::fit;
use crate::noise::{NoiseModel, NoiseSource, learn};
use crate::partition::{self, Cut, PatchSize, tubes};
use crate::run::{Context, Stage};
use crate::strays::{self, Charted};

/// An atlas whose charts do not know of each other yet.
pub(super) struct FirstAtlas {
    /// The charts.
    pub fitted: Vec<FittedChart>,
    /// Points that lie on tubes and need no other chart.
    pub on_tubes: Vec<bool>,
    /// How large patches are.
    pub size: PatchSize,
}

/// What patches are cut from.
pub(super) fn cut(scan: &Scan, size: PatchSize) -> Cut<'_> {
    Cut {
        points: &scan.points,
        tree: &scan.tree,
        sampling: &scan.sampling,
        sigma: scan.noise.for_charts(),
        relative: &scan.relative_noise,
        size,
    }
}

/// Cuts the scan and fits a chart to each piece, about `charts` in all where that is given. Mends the scan's
/// noise by what tubes and a sample of charts see of it.
pub(super) fn fit_atlas(scan: &mut Scan, charts: Option<usize>, ctx: &Context<'_>) -> Result<FirstAtlas> {
    let size = match charts {
        None => PatchSize::default(),
        Some(charts) => PatchSize::default().for_count(charts, scan.points.len()),
    };
    let tubes = tubes::find(&cut(scan, size), scan.noise.is_settled(), ctx)?;
    if let Some(sigma) = tubes.sigma {
        scan.noise = NoiseModel { sigma, source: NoiseSource::Tubes, ..scan.noise };
    }
    if !scan.noise.is_settled() {
        let learned = learn::from_charts(&cut(scan, size), scan.noise, &tubes.covered, ctx)?;
        scan.noise = learned;
    }
    let cut = cut(scan, size);
    let patches = partition::partition(&cut, &tubes.covered, None, ctx)?;
    ctx.stage(Stage::Fit, patches.len());
    let mut fitted = fit::fit(&scan.points, &patches, ctx)?;
    fitted.extend(tubes.fitted);
    drop_strays(&cut, &mut fitted, ctx)?;
    if fitted.is_empty() {
        return Err(Error::degenerate(
            "no part of the points looks like a surface",
            "Give a denser scan, or set the noise by hand",
        ));
    }
    Ok(FirstAtlas { fitted, on_tubes: tubes.covered, size })
}

/// Takes out the charts that were laid through strays.
pub(super) fn drop_strays(cut: &Cut<'_>, fitted: &mut Vec<FittedChart>, ctx: &Context<'_>) -> Result<()> {
    let members = membership::of_points(cut.points.len(), fitted, ctx)?;
    let stands = strays::standing(&Charted { cut: *cut, fitted, members: &members }, ctx)?;
    let mut stand = stands.iter();
    fitted.retain(|_| stand.next().is_some_and(|s| *s));
    Ok(())
}
