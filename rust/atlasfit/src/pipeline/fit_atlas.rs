//! The first atlas: tubes where the scan is thin, patches elsewhere, a chart for each.
//!
//! In: a prepared scan. Out: fitted charts, not yet oriented; the scan's noise as they know it.

use super::prepare::Scan;
use crate::atlas::{FittedChart, Membership};
use crate::blend::membership;
use crate::error::{Error, Result};
use crate::fit;
use crate::noise::learn::{self, Learned};
use crate::noise::{NoiseModel, NoiseSource, places};
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
    let patches = partition::partition(&cut, &tubes.covered, None, true, ctx)?;
    ctx.stage(Stage::Fit, patches.len());
    let mut fitted = fit::fit(&scan.points, &patches, ctx)?;
    fitted.extend(tubes.fitted);
    let on_walls = of_two_sheets(&fitted, scan.points.len());
    drop_strays(&cut, &mut fitted, ctx)?;
    cover_again(&cut, on_walls, &mut fitted, ctx)?;
    if fitted.is_empty() {
        return Err(Error::degenerate(
            "no part of the points looks like a surface",
            "Give a denser scan, or set the noise by hand",
        ));
    }
    Ok(FirstAtlas { fitted, on_tubes: tubes.covered, size })
}

/// Which points lie on charts of two sheets.
fn of_two_sheets(fitted: &[FittedChart], points: usize) -> Vec<bool> {
    let mut on = vec![false; points];
    let members = fitted.iter().filter(|f| f.of_two).flat_map(|f| &f.members);
    members.for_each(|&(m, _)| on[m as usize] = true);
    on
}

/// Covers with single sheets what lay on the sides of thin walls (`on_walls`) and on no chart now: where they
/// did not stand they were no walls, but something that is narrow, a horn for example.
fn cover_again(
    cut: &Cut<'_>,
    on_walls: Vec<bool>,
    fitted: &mut Vec<FittedChart>,
    ctx: &Context<'_>,
) -> Result<()> {
    let mut done: Vec<bool> = on_walls.into_iter().map(|on| !on).collect();
    fitted.iter().flat_map(|f| &f.members).for_each(|&(m, _)| done[m as usize] = true);
    if done.iter().all(|d| *d) {
        return Ok(());
    }
    let patches = partition::partition(cut, &done, None, false, ctx)?;
    ctx.stage(Stage::Fit, patches.len());
    fitted.extend(fit::fit(cut.points, &patches, ctx)?);
    drop_strays(cut, fitted, ctx)
}

/// Finds the tubes. Where they hold most of the scan they know its noise, better than neighbourhoods, which
/// hold both sides of a tube, and where it differs.
pub(super) fn find_tubes(scan: &mut Scan, size: PatchSize, ctx: &Context<'_>) -> Result<Tubes> {
    let mut tubes = tubes::find(&cut(scan, size), scan.noise.is_settled(), ctx)?;
    if let Some(sigma) = tubes.sigma {
        scan.noise = NoiseModel { sigma, source: NoiseSource::Tubes, ..scan.noise };
        scan.relative_noise = std::mem::take(&mut tubes.relative);
    }
    Ok(tubes)
}

/// Mends the scan's noise by what a sample of charts sees of it, or by what a tile was told.
pub(super) fn learn_noise(scan: &mut Scan, size: PatchSize, tubes: &Tubes, ctx: &Context<'_>) -> Result<()> {
    if let Some(told) = &scan.told {
        scan.noise.sigma = told.noise;
    } else if !scan.noise.is_settled() {
        let first = scan.noise.for_charts();
        let Learned { noise, noisier } =
            learn::from_charts(&cut(scan, size), scan.noise, &tubes.covered, ctx)?;
        scan.noise = noise;
        places::ease(&mut scan.relative_noise, noise.for_charts() / first, noisier);
    }
    Ok(())
}

/// Takes out the charts that were laid through strays.
pub(super) fn drop_strays(cut: &Cut<'_>, fitted: &mut Vec<FittedChart>, ctx: &Context<'_>) -> Result<()> {
    drop_strays_from(0, cut, fitted, ctx)
}

/// As [`drop_strays`]; charts before the one numbered `first` are witnesses only, and stay.
pub(super) fn drop_strays_from(
    first: usize,
    cut: &Cut<'_>,
    fitted: &mut Vec<FittedChart>,
    ctx: &Context<'_>,
) -> Result<()> {
    if first == fitted.len() {
        return Ok(());
    }
    let members = membership::of_points(cut.rows, fitted, ctx)?;
    let stands = strays::standing(&Charted { cut: *cut, fitted, members: &members }, ctx)?;
    let mut stand = (0..).zip(stands);
    fitted.retain(|_| stand.next().is_some_and(|(k, stands)| k < first || stands));
    Ok(())
}

/// Takes out parts that are clumps of strays, once all of the surface has its charts. Whether there were any.
pub(super) fn drop_clumps(
    cut: &Cut<'_>,
    fitted: &mut Vec<FittedChart>,
    members: &Membership,
    ctx: &Context<'_>,
) -> Result<bool> {
    let stands = strays::standing_at_last(&Charted { cut: *cut, fitted, members }, ctx)?;
    let mut stand = stands.iter();
    fitted.retain(|_| stand.next().is_some_and(|stands| *stands));
    Ok(fitted.len() < stands.len())
}
