//! Packing: where each chart lies on its page.
//!
//! In: flattened charts, page size and padding in texels. Out: page, rotation and position per chart. Charts
//! are rasterised to bit masks (`bitmap`, `mask`) in several rotations and put at the lowest free place
//! (`strip`). For one page, the order of placing is searched for (`search` on a `board`), then the charts are
//! pushed together (`tighten`, by their `contacts`). Several pages, or a given density, are pages of fixed
//! size filled one after the other (`fixed`), as is a page of which a part is occupied. `boxes` is the fast
//! way, and the last one where charts are very many; `external` asks a packer that is no part of the library,
//! a `packer`. Where the padding asked for leaves hardly any texels to the charts, it is lowered.

mod bitmap;
mod board;
mod boxes;
mod constants;
mod contacts;
mod external;
mod fixed;
mod mask;
mod packer;
mod placement;
mod search;
mod strip;
mod tighten;

pub(crate) use constants::PACK;
pub(crate) use fixed::room;
pub use packer::{ChartPosition, FlatChart, PagePacker, Pages};
pub(crate) use placement::{PackJob, Packed, Packing};

use super::chart::Chart;
use super::options::Packer;
use super::planar::{along_x, upright};
use crate::error::{Error, Result};
use crate::numeric::wording::counted;
use crate::run::Context;
use boxes::{crumbs, one_page_of_boxes};
use fixed::several_pages;
use rayon::prelude::*;
use search::one_page;

/// Packs the charts. The padding is that of the job or, where charts would be too small with it, half of it
/// or less; see [`PACK`].
///
/// # Errors
/// Those of an external packer, also where it packs at no density; those of [`Context::check`].
pub(crate) fn pack(charts: &[Chart], job: &PackJob<'_>, ctx: &Context<'_>) -> Result<Packed> {
    if charts.is_empty() {
        return Ok(Packed { placements: Vec::new(), density: 1.0, padding: job.padding });
    }
    let pose = |c: &Chart| if c.straight { along_x(&c.uv) } else { upright(&c.outline()) };
    let upright: Vec<[f64; 2]> =
        (charts.par_iter()).map(|c| ctx.check().map(|()| pose(c))).collect::<Result<_>>()?;
    let mut job = *job;
    if !job.occupied.is_empty() && matches!(job.packer, Packing::External(_)) {
        return Err(Error::invalid(
            "occupied is given with a packer that is no part of the library, which knows nothing of it",
            "Use a packer of the library, or give nothing occupied",
        ));
    }
    let mut packed = loop {
        if let Some(packed) = pack_padded(charts, &upright, &job, ctx)? {
            break packed;
        }
        if job.padding > 0 {
            job.padding /= 2;
        } else {
            match job.packer {
                Packing::Own(_) if job.occupied.is_empty() => break crumbs(charts, &upright, &job, ctx)?,
                Packing::Own(_) => return Err(no_room(charts, &job, "less that is occupied")),
                Packing::External(_) => return Err(no_room(charts, &job, "another packer")),
            }
        }
    };
    for p in &mut packed.placements {
        p.scale = job.page.map(|texels| packed.density / f64::from(texels));
    }
    Ok(packed)
}

/// The error where charts fit at no density; `or` says what may help besides larger pages.
fn no_room(charts: &[Chart], job: &PackJob<'_>, or: &str) -> Error {
    let [width, height] = job.page;
    Error::invalid(
        format!(
            "there is no room for {} on {} of {width} by {height} texels",
            counted(charts.len(), "chart"),
            counted(job.pages as usize, "page"),
        ),
        format!("Give larger pages or more of them, or {or}"),
    )
}

/// Packs with just the padding of the job; `None` where that leaves too few texels to the charts.
fn pack_padded(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    ctx: &Context<'_>,
) -> Result<Option<Packed>> {
    if job.is_hopeless(charts) {
        return Ok(None);
    }
    let fills_one = job.density.is_none() && job.pages == 1;
    if !job.occupied.is_empty() {
        // Boxes know of no shapes that charts could lie beside.
        return several_pages(
            charts,
            upright,
            &PackJob { packer: Packing::Own(Packer::Shapes), ..*job },
            ctx,
        );
    }
    let packed = match job.packer {
        Packing::Own(Packer::Boxes) if fills_one => one_page_of_boxes(charts, upright, job, ctx)?,
        Packing::Own(Packer::Shapes) if fills_one => one_page(charts, upright, job, ctx)?,
        _ => several_pages(charts, upright, job, ctx)?,
    };
    match job.packer {
        // Shapes are packed in whole cells; boxes have no such grain.
        Packing::Own(Packer::Shapes) if packed.is_none() => {
            pack_padded(charts, upright, &PackJob { packer: Packing::Own(Packer::Boxes), ..*job }, ctx)
        }
        _ => Ok(packed),
    }
}

#[cfg(test)]
mod tests;
