//! Packers that are no part of the library.
//!
//! In: flattened charts at a density. Out: what the packer says, checked. It places charts at a given size on pages of a
//! given size; which density fills the pages is found by the caller.

use super::mask::{bounds, rotated};
use super::{Goal, Place};
use crate::error::{Error, Result};
use crate::run::Context;
use crate::unwrap::chart::Chart;
use rayon::prelude::*;

/// A chart as a packer gets it: flat, free of flips and overlaps, its bounding box of nearly the least area there is.
#[derive(Debug)]
pub struct FlatChart<'a> {
    /// Position per vertex in texels. The least coordinates are 0.
    pub uv: Vec<[f64; 2]>,
    /// Counter-clockwise triangles.
    pub triangles: &'a [[u32; 3]],
}

/// The pages to fill.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pages {
    /// Width and height of each in texels.
    pub size: [u32; 2],
    /// Most pages.
    pub most: u32,
    /// Texels to leave free between charts and at a page's border.
    pub padding: u32,
}

/// Where a chart goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Page, counted from 0.
    pub page: u32,
    /// Where on it the origin of the chart's positions lies, in texels.
    pub at: [f64; 2],
}

/// Puts charts on pages; see [`unwrap_with`](crate::unwrap::unwrap_with).
pub trait PagePacker: Sync {
    /// A spot for every chart, shifted but neither turned nor scaled, or `None` where they do not fit. No two charts
    /// may overlap or be nearer each other than the padding. The same charts must get the same spots.
    ///
    /// # Errors
    /// Where it cannot pack for such pages at all; those of [`Context::check`].
    fn fill(&self, charts: &[FlatChart<'_>], pages: Pages, ctx: &Context<'_>) -> Result<Option<Vec<Spot>>>;
}

/// Has the packer place the charts at a density.
pub(super) fn fill_outside(
    packer: &dyn PagePacker,
    charts: &[Chart],
    upright: &[[f64; 2]],
    goal: &Goal,
    density: f64,
    ctx: &Context<'_>,
) -> Result<Option<Vec<Place>>> {
    let (flat, boxes): (Vec<FlatChart>, Vec<_>) = (charts.par_iter().zip(upright))
        .map(|(c, &r)| {
            let mut uv = rotated(&c.uv, r);
            let (lo, hi) = bounds(&uv);
            uv.iter_mut().for_each(|p| *p = [0, 1].map(|k| (p[k] - lo[k]) * density));
            (FlatChart { uv, triangles: &c.tris }, (lo, hi))
        })
        .unzip();
    let pages = Pages { size: goal.page, most: goal.pages, padding: goal.padding };
    let Some(spots) = packer.fill(&flat, pages, ctx)? else { return Ok(None) };
    // A hundredth of a texel for rounding.
    let (least, most) =
        (f64::from(goal.padding) - 0.01, goal.page.map(|p| f64::from(p - goal.padding) + 0.01));
    let inside = |spot: &Spot, (lo, hi): ([f64; 2], [f64; 2])| {
        spot.page < goal.pages
            && (0..2).all(|k| spot.at[k] >= least && spot.at[k] + (hi[k] - lo[k]) * density <= most[k])
    };
    if spots.len() != charts.len() || !spots.iter().zip(&boxes).all(|(spot, &b)| inside(spot, b)) {
        return Err(Error::internal("the packer put a chart off its page"));
    }
    let place = |((spot, (lo, _)), &rotation): ((&Spot, &([f64; 2], _)), _)| Place {
        page: spot.page,
        rotation,
        shift: [0, 1].map(|k| spot.at[k] / density - lo[k]),
        ..Place::default()
    };
    Ok(Some(spots.iter().zip(&boxes).zip(upright).map(place).collect()))
}
