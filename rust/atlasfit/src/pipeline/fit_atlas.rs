//! The first atlas: tubes where the scan is thin, patches elsewhere, a chart for each.
//!
//! In: a prepared scan. Out: fitted charts, not yet oriented; the scan's noise as they know it.

use super::prepare::Scan;
use crate::atlas::FittedChart;
use crate::blend::membership;
use crate::error::{Error, Result};
use crate::fit;
use crate::noise::{NoiseModel, NoiseSource, learn};
use crate::partition::tubes::{self, Tubes};
use crate::partition::{self, Cut, PatchSize};
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
        rows: &scan.rows,
        whole: scan.whole,
    }
}

/// Cuts the scan and fits a chart to each piece, about `charts` in all where that is given. Mends the scan's
/// noise by what tubes and a sample of charts see of it.
pub(super) fn fit_atlas(scan: &mut Scan, charts: Option<usize>, ctx: &Context<'_>) -> Result<FirstAtlas> {
    let size = match charts {
        None => PatchSize::default(),
        Some(charts) => PatchSize::default().for_count(charts, scan.points.len()),
    };
    let tubes = find_tubes(scan, size, ctx)?;
    learn_noise(scan, size, &tubes, ctx)?;
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

/// Finds the tubes. Where they hold most of the scan they know its noise.
pub(super) fn find_tubes(scan: &mut Scan, size: PatchSize, ctx: &Context<'_>) -> Result<Tubes> {
    let tubes = tubes::find(&cut(scan, size), scan.noise.is_settled(), ctx)?;
    if let Some(sigma) = tubes.sigma {
        scan.noise = NoiseModel { sigma, source: NoiseSource::Tubes, ..scan.noise };
    }
    Ok(tubes)
}

/// Mends the scan's noise by what a sample of charts sees of it, or by what a tile was told.
pub(super) fn learn_noise(scan: &mut Scan, size: PatchSize, tubes: &Tubes, ctx: &Context<'_>) -> Result<()> {
    if let Some(told) = &scan.told {
        scan.noise.sigma = told.noise;
    } else if !scan.noise.is_settled() {
        scan.noise = learn::from_charts(&cut(scan, size), scan.noise, &tubes.covered, ctx)?;
    }
    Ok(())
}

/// Takes out the charts that were laid through strays.
pub(super) fn drop_strays(cut: &Cut<'_>, fitted: &mut Vec<FittedChart>, ctx: &Context<'_>) -> Result<()> {
    let members = membership::of_points(cut.rows, fitted, ctx)?;
    let stands = strays::standing(&Charted { cut: *cut, fitted, members: &members }, ctx)?;
    let mut stand = stands.iter();
    fitted.retain(|_| stand.next().is_some_and(|s| *s));
    Ok(())
}
