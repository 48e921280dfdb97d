//! Packing by an external packer.
//!
//! In: flattened charts at a density. Out: what the packer says, checked.

use super::constants::PACK;
use super::packer::{ChartPosition, FlatChart, PagePacker, Pages};
use super::placement::{PackJob, Placement};
use crate::error::{Error, Result};
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::planar::{bounds, rotated};
use rayon::prelude::*;

/// Has the packer place the charts at a density.
pub(crate) fn fill_external(
    packer: &dyn PagePacker,
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    density: f64,
    ctx: &Context<'_>,
) -> Result<Option<Vec<Placement>>> {
    let (flat, boxes): (Vec<FlatChart>, Vec<_>) = (charts.par_iter().zip(upright))
        .map(|(c, &r)| {
            let mut uv = rotated(&c.uv, r);
            let (lo, hi) = bounds(&uv);
            uv.iter_mut().for_each(|p| *p = [0, 1].map(|k| (p[k] - lo[k]) * density));
            (FlatChart { uv, triangles: &c.tris }, (lo, hi))
        })
        .unzip();
    let pages = Pages { size: job.page, most: job.pages, padding: job.padding };
    let Some(positions) = packer.fill(&flat, pages, ctx)? else { return Ok(None) };
    let (least, most) = (
        f64::from(job.padding) - PACK.off_page,
        job.page.map(|p| f64::from(p - job.padding) + PACK.off_page),
    );
    let inside = |position: &ChartPosition, (lo, hi): ([f64; 2], [f64; 2])| {
        position.page < job.pages
            && (0..2)
                .all(|k| position.at[k] >= least && position.at[k] + (hi[k] - lo[k]) * density <= most[k])
    };
    if positions.len() != charts.len()
        || !positions.iter().zip(&boxes).all(|(position, &b)| inside(position, b))
    {
        return Err(Error::internal("the packer put a chart off its page"));
    }
    let place = |((position, (lo, _)), &rotation): ((&ChartPosition, &([f64; 2], _)), _)| Placement {
        page: position.page,
        rotation,
        shift: [0, 1].map(|k| position.at[k] / density - lo[k]),
        ..Placement::default()
    };
    Ok(Some(positions.iter().zip(&boxes).zip(upright).map(place).collect()))
}
