//! Packing: where each chart lies on its page.
//!
//! In: flattened charts, page size and padding in texels. Out: page, rotation and position per chart. Charts
//! are rasterised to bit masks (`bitmap`, `mask`) in several rotations and put at the lowest free place
//! (`strip`). For one page, the order of placing is searched for (`search` on a `board`), then the charts are
//! pushed together (`tighten`, by their `contacts`). Several pages, or a given density, are pages of fixed
//! size filled one after the other (`fixed`). `boxes` is the fast way; `external` asks a packer that is no
//! part of the library, a `packer`.

mod bitmap;
mod board;
mod boxes;
mod contacts;
mod external;
mod fixed;
mod mask;
mod packer;
mod placement;
mod search;
mod strip;
mod tighten;

pub use packer::{ChartPosition, FlatChart, PagePacker, Pages};
pub(crate) use placement::{EXPECTED_FILL, PackJob, Packed, Packing};

use super::chart::Chart;
use super::options::Packer;
use super::planar::upright;
use crate::error::Result;
use crate::run::Context;
use boxes::one_page_of_boxes;
use fixed::several_pages;
use rayon::prelude::*;
use search::one_page;

/// Packs the charts.
pub(crate) fn pack(charts: &[Chart], job: &PackJob<'_>, ctx: &Context<'_>) -> Result<Packed> {
    if charts.is_empty() {
        return Ok(Packed { placements: Vec::new(), density: 1.0 });
    }
    let upright: Vec<[f64; 2]> = charts.par_iter().map(|c| upright(&c.outline())).collect();
    let mut packed = match (job.density, job.pages, job.packer) {
        (None, 1, Packing::Own(Packer::Boxes)) => one_page_of_boxes(charts, &upright, job),
        (None, 1, Packing::Own(Packer::Shapes)) => one_page(charts, &upright, job, ctx)?,
        _ => several_pages(charts, &upright, job, ctx)?,
    };
    for p in &mut packed.placements {
        p.scale = job.page.map(|texels| packed.density / f64::from(texels));
    }
    Ok(packed)
}
