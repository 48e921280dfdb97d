//! Pages of fixed size, filled one after the other: at the density asked for, or the highest at which all
//! charts fit.

use super::bitmap::Bitmap;
use super::boxes::fill_boxes;
use super::constants::{CELLS, PACK};
use super::external::fill_external;
use super::mask::{Mask, Pose, largest_first, poses};
use super::placement::{PackJob, Packed, Packing, Placement};
use super::strip::Strip;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::options::Packer;
use crate::unwrap::planar::bounds;
use rayon::prelude::*;

/// Words of a page's row.
const WORDS: usize = CELLS as usize / 64;

/// Fills pages of fixed size: at the density asked for, or the highest at which all fit. `None` where that
/// would be less than the least at which the padding is kept.
pub(super) fn several_pages(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    ctx: &Context<'_>,
) -> Result<Option<Packed>> {
    let area: f64 = charts.iter().map(|c| c.area).sum();
    let occupied = if job.occupied.is_empty() { None } else { Some(occupied(job, ctx)?) };
    let least = job.least_density(charts);
    let padding = job.padding;
    let try_at = |density: f64| match job.packer {
        Packing::Own(Packer::Shapes) => fill_shapes(charts, upright, job, occupied.as_ref(), density, ctx),
        Packing::Own(Packer::Boxes) => fill_boxes(charts, upright, job, density, ctx),
        Packing::External(packer) => fill_external(packer, charts, upright, job, density, ctx),
    };
    let full = |fill: f64| {
        let texels = job.texels() * f64::from(job.pages);
        (texels * fill / area).sqrt()
    };
    // Too high a density cannot fit; the highest that does lies between these.
    let (mut low, mut high): (Option<Packed>, f64) = (None, full(1.0));
    let mut at = job.density.unwrap_or_else(|| full(PACK.expected_fill)).min(high);
    for _ in 0..PACK.scales {
        if at < least {
            break;
        }
        ctx.check()?;
        match try_at(at)? {
            Some(placements) if job.density.is_some_and(|d| at >= d) => {
                return Ok(Some(Packed { placements, density: at, padding }));
            }
            Some(placements) => low = Some(Packed { placements, density: at, padding }),
            None => high = at,
        }
        at = match &low {
            Some(found) if high / found.density < PACK.close => break,
            Some(found) => (found.density * high).sqrt(),
            None => at * PACK.less,
        };
    }
    while low.is_none() && at >= least {
        ctx.check()?;
        low = try_at(at)?.map(|placements| Packed { placements, density: at, padding });
        at *= PACK.much_less;
    }
    Ok(low)
}

/// Texels per cell of a page.
fn texels_per_cell(page: [u32; 2]) -> f64 {
    (f64::from(page[0].max(page[1])) / CELLS).max(1.0)
}

/// Cells round a chart that are kept free of others.
fn margin(padding: u32, texels: f64) -> usize {
    ((f64::from(padding) / texels).ceil() as usize).max(1)
}

/// Texels of the largest chart that finds room on an empty page: the margin lies on both sides, and a chart
/// covers up to two cells more than its length.
pub(crate) fn room(page: [u32; 2], padding: u32) -> [f64; 2] {
    let texels = texels_per_cell(page);
    let around = 2.0 * margin(padding, texels) as f64 + 2.0;
    page.map(|p| ((f64::from(p) / texels).floor() - around).max(1.0) * texels)
}

/// The cells of a page.
fn cells(page: [u32; 2]) -> [usize; 2] {
    let texels = texels_per_cell(page);
    page.map(|p| (f64::from(p) / texels) as usize)
}

/// The cells of the first page that are not free.
fn occupied(job: &PackJob<'_>, ctx: &Context<'_>) -> Result<Mask> {
    let texels = texels_per_cell(job.page);
    let in_cells = |uv: [f32; 2]| [0, 1].map(|k| f64::from(uv[k]) * f64::from(job.page[k]) / texels);
    let [width, height] = cells(job.page);
    let mut page = Bitmap::new(width, height);
    for (i, t) in job.occupied.iter().enumerate() {
        ctx.check_at(i)?;
        page.touch(t.map(in_cells));
    }
    Ok(Mask::of(&page))
}

/// Places the charts at a density on at most as many pages as allowed, by shape.
fn fill_shapes(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    occupied: Option<&Mask>,
    density: f64,
    ctx: &Context<'_>,
) -> Result<Option<Vec<Placement>>> {
    ctx.check()?;
    let texels = texels_per_cell(job.page);
    let cell = texels / density;
    let [width, height] = cells(job.page);
    // What is larger than a page fits on none: found before its mask takes memory.
    let longest = cell * (width as f64).hypot(height as f64);
    let too_large = |c: &Chart| {
        let (lo, hi) = bounds(&c.uv);
        (hi[0] - lo[0]).hypot(hi[1] - lo[1]) > longest * std::f64::consts::SQRT_2
    };
    if charts.iter().any(too_large) {
        return Ok(None);
    }
    let grow = margin(job.padding, texels);
    let poses: Vec<Vec<Pose>> = (charts.par_iter().zip(upright))
        .map(|(c, &r)| {
            ctx.check()?;
            Ok(poses(c, r, cell, grow, if c.straight { 1 } else { PACK.turns_fixed }))
        })
        .collect::<Result<_>>()?;
    let mut pages: Vec<Strip<WORDS>> = Vec::new();
    if let Some(occupied) = occupied {
        let mut first = Strip::new(width);
        first.put(occupied, 0, 0);
        pages.push(first);
    }
    let mut placements = vec![Placement::default(); charts.len()];
    'charts: for c in largest_first(&poses) {
        ctx.check()?;
        for page in 0..job.pages as usize {
            if page == pages.len() {
                pages.push(Strip::new(width));
            }
            let best = (poses[c].iter())
                .filter_map(|p| {
                    pages[page].find(&p.grown, 0, height).map(|at| (2 * at.1 + p.grown.height, at, p))
                })
                .min_by_key(|b| b.0);
            if let Some((_, (x, y), pose)) = best {
                pages[page].put(&pose.tight, x + grow, y + grow);
                placements[c] = Placement { page: page as u32, ..pose.at(x + grow, y + grow, cell) };
                continue 'charts;
            }
            if pages[page].is_empty() {
                return Ok(None);
            }
        }
        return Ok(None);
    }
    Ok(Some(placements))
}
