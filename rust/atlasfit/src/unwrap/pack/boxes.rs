//! Packing by bounding boxes, in rows.

use super::constants::BOXES;
use super::placement::{PackJob, Packed, Placement};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::planar::{bounds, rotated};

/// The charts' upright bounding boxes.
struct Boxes<'a> {
    /// Least and greatest coordinates of each.
    ends: Vec<[[f64; 2]; 2]>,
    /// Highest first.
    order: Vec<usize>,
    upright: &'a [[f64; 2]],
}

impl<'a> Boxes<'a> {
    fn new(charts: &[Chart], upright: &'a [[f64; 2]], ctx: &Context<'_>) -> Result<Self> {
        let mut ends: Vec<[[f64; 2]; 2]> = Vec::with_capacity(charts.len());
        for (c, &r) in charts.iter().zip(upright) {
            ctx.check()?;
            let (lo, hi) = bounds(&rotated(&c.outline(), r));
            ends.push([lo, hi]);
        }
        let height = |c: usize| ends[c][1][1] - ends[c][0][1];
        let mut order: Vec<usize> = (0..ends.len()).collect();
        order.sort_by(|&a, &b| height(b).total_cmp(&height(a)).then(a.cmp(&b)));
        Ok(Self { ends, order, upright })
    }

    /// Rows of the boxes at a density, `gap` texels apart and from the border.
    fn rows(&self, job: &PackJob<'_>, gap: f64, density: f64) -> Option<Vec<Placement>> {
        let [width, height] = job.page.map(|p| f64::from(p) / density);
        let gap = gap / density;
        let (mut page, mut x, mut y, mut row) = (0, gap, gap, 0f64);
        let mut out = vec![Placement::default(); self.ends.len()];
        for &c in &self.order {
            let [lo, hi] = self.ends[c];
            let [w, h] = [0, 1].map(|k| hi[k] - lo[k]);
            if x + w + gap > width {
                (x, y, row) = (gap, y + row + gap, 0.0);
            }
            if y + h + gap > height {
                (page, x, y, row) = (page + 1, gap, gap, 0.0);
            }
            if page == job.pages || x + w + gap > width || y + h + gap > height {
                return None;
            }
            out[c] = Placement {
                page,
                rotation: self.upright[c],
                shift: [x - lo[0], y - lo[1]],
                ..Placement::default()
            };
            x += w + gap;
            row = row.max(h);
        }
        Some(out)
    }
}

/// The density at which the charts' area is that of all pages.
fn full(charts: &[Chart], job: &PackJob<'_>) -> f64 {
    (job.texels() * f64::from(job.pages) / charts.iter().map(|c| c.area).sum::<f64>()).sqrt()
}

/// One page of rows of bounding boxes; `None` where they do not fit with the padding.
pub(super) fn one_page_of_boxes(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    ctx: &Context<'_>,
) -> Result<Option<Packed>> {
    let boxes = Boxes::new(charts, upright, ctx)?;
    let least = job.least_density(charts);
    let mut density = full(charts, job);
    while density >= least {
        ctx.check()?;
        if let Some(placements) = boxes.rows(job, f64::from(job.padding).max(BOXES.least_gap), density) {
            return Ok(Some(Packed { placements, density, padding: job.padding }));
        }
        density *= BOXES.less;
    }
    Ok(None)
}

/// Places the charts at a density on at most as many pages as allowed, in rows.
pub(super) fn fill_boxes(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    density: f64,
    ctx: &Context<'_>,
) -> Result<Option<Vec<Placement>>> {
    let boxes = Boxes::new(charts, upright, ctx)?;
    Ok(boxes.rows(job, f64::from(job.padding).max(BOXES.least_gap), density))
}

/// Charts that have hardly a texel each: in rows, apart by a share of that. They fit at some density: ten by
/// ten gaps for each chart leave room for points, and boxes shrink to points.
pub(super) fn crumbs(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    ctx: &Context<'_>,
) -> Result<Packed> {
    let boxes = Boxes::new(charts, upright, ctx)?;
    let [width, height] = job.page.map(f64::from);
    let square = (job.texels() * f64::from(job.pages) / charts.len() as f64).sqrt();
    let gap = (BOXES.crumbs_gap * square.min(width).min(height)).min(BOXES.least_gap);
    let full = full(charts, job);
    let mut density = job.density.map_or(full, |d| d.min(full));
    loop {
        ctx.check()?;
        if let Some(placements) = boxes.rows(job, gap, density) {
            return Ok(Packed { placements, density, padding: 0 });
        }
        density *= BOXES.less_for_crumbs;
    }
}
