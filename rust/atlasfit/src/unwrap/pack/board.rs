//! Charts as cells for a page of one shape, and pages filled with them in some order.

use super::constants::{CELLS, PACK};
use super::mask::{Pose, poses};
use super::placement::PackJob;
use super::strip::Strip;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use rayon::prelude::*;
use std::collections::HashMap;

/// A chart's pose and the lower left cell of its grown mask.
#[derive(Clone, Copy, Default)]
pub(crate) struct CellPlacement {
    pub pose: usize,
    pub x: usize,
    pub y: usize,
}

/// How fine a board is.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    /// Width of the page in units of the surface.
    pub side: f64,
    /// Cells along the page's longer side.
    pub cells: f64,
    /// Rotations, in quarters, of the large charts and of the others.
    pub turns: [usize; 2],
}

/// An order in which charts are placed on a strip, and the strip's bounds.
#[derive(Clone, Copy)]
pub(super) struct Order<'a> {
    pub charts: &'a [usize],
    /// Cells across.
    pub width: usize,
    /// Most rows.
    pub limit: usize,
    /// Whether a place counts by how high a chart's top lies there, not its middle.
    pub top_counts: bool,
}

/// A filled strip.
pub(super) struct Fill {
    /// Rows that it takes.
    pub height: usize,
    pub placements: Vec<CellPlacement>,
    /// The chart that does not fit below the limit: then the strip is not filled to its end.
    pub left_out: Option<usize>,
}

/// Charts as cells, for a page of one shape.
pub(crate) struct Board {
    /// Side of a cell in units of the surface.
    pub cell: f64,
    /// Cells of padding.
    pub grow: usize,
    /// The rotations of each chart.
    pub poses: Vec<Vec<Pose>>,
    /// Height of the page over its width.
    pub aspect: f64,
    /// No page is narrower, in cells.
    pub narrowest: usize,
    /// Factor on the rounds of the search.
    pub effort: f64,
}

/// A filled page.
#[derive(Clone)]
pub(super) struct Filled {
    /// Side in cells of the page's width that it needs.
    pub size: usize,
    /// The order of placing.
    pub order: Vec<usize>,
    pub placements: Vec<CellPlacement>,
}

impl Board {
    /// Makes the charts' masks. `upright` holds their upright rotations.
    pub(super) fn new(
        charts: &[Chart],
        upright: &[[f64; 2]],
        job: &PackJob<'_>,
        grid: Grid,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let Grid { side, cells, turns } = grid;
        let aspect = f64::from(job.page[1]) / f64::from(job.page[0]);
        let cell = side * aspect.max(1.0) / cells;
        let grow = grow(job, cells);
        let area: f64 = charts.iter().map(|c| c.area).sum();
        let poses: Vec<Vec<Pose>> = (charts.par_iter().zip(upright))
            .map(|(c, &r)| {
                ctx.check()?;
                let turns = if c.straight { 1 } else { turns[usize::from(c.area <= PACK.turn_more * area)] };
                Ok(poses(c, r, cell, grow, turns))
            })
            .collect::<Result<_>>()?;
        let narrowest =
            poses.iter().map(|p| p.iter().map(|q| q.grown.width).min().unwrap_or(0)).max().unwrap_or(0);
        let faces: usize = charts.iter().map(|c| c.faces.len()).sum();
        let effort = (faces as f64 / PACK.effort_faces).clamp(1.0, PACK.most_effort);
        Ok(Self { cell, grow, poses, aspect, narrowest, effort })
    }

    /// Whether a page holds so many charts of one cell each, with the padding round them.
    pub(super) fn has_cells_for(charts: usize, job: &PackJob<'_>) -> bool {
        let longer = f64::from(job.page[0].max(job.page[1]));
        let cells = job.texels() * (CELLS / longer).powi(2);
        charts as f64 * (1.0 + grow(job, CELLS) as f64).powi(2) <= cells
    }

    /// Rows of a page of some width.
    pub(super) fn rows(&self, width: usize) -> usize {
        (width as f64 * self.aspect) as usize
    }

    /// Fills a strip, as far as its limit allows.
    pub(super) fn fill(&self, order: Order<'_>, ctx: &Context<'_>) -> Result<Fill> {
        match order.width.div_ceil(64) {
            0..=4 => self.fill_words::<4>(order, ctx),
            5..=8 => self.fill_words::<8>(order, ctx),
            9..=16 => self.fill_words::<16>(order, ctx),
            17..=32 => self.fill_words::<32>(order, ctx),
            _ => self.fill_words::<128>(Order { width: order.width.min(128 * 64), ..order }, ctx),
        }
    }

    fn fill_words<const W: usize>(&self, order: Order<'_>, ctx: &Context<'_>) -> Result<Fill> {
        let Order { charts, width, limit, top_counts } = order;
        let mut strip = Strip::<W>::new(width);
        let mut top = 0;
        let mut placements = vec![CellPlacement::default(); self.poses.len()];
        // Where masks of a size were last put: below that there is no room for small ones of the same size.
        let mut lowest: HashMap<(usize, usize), usize> = HashMap::new();
        for &c in charts {
            ctx.check()?;
            let poses = &self.poses[c];
            let tallest = poses.iter().map(|p| p.grown.height).max().unwrap_or(0);
            let mut found: Option<CellPlacement> = None;
            let mut best = usize::MAX / 4;
            for (i, pose) in poses.iter().enumerate() {
                // A place counts by how high its middle or its top lies: twice that, to stay whole.
                let height = pose.grown.height;
                let own = if top_counts { 2 * height } else { height };
                let room = (top + tallest).min(limit).min((best - own.min(best)) / 2 + height);
                let size = (pose.grown.width, height);
                let from =
                    if size.0.max(size.1) <= PACK.small { *lowest.get(&size).unwrap_or(&0) } else { 0 };
                if let Some((x, y)) = strip.find(&pose.grown, from, room) {
                    lowest.insert(size, y);
                    if 2 * y + own < best {
                        best = 2 * y + own;
                        found = Some(CellPlacement { pose: i, x, y });
                    }
                }
            }
            let Some(place) = found else { return Ok(Fill { height: top, placements, left_out: Some(c) }) };
            let pose = &poses[place.pose];
            strip.put(&pose.tight, place.x + self.grow, place.y + self.grow);
            top = top.max(place.y + pose.grown.height);
            if top > limit {
                return Ok(Fill { height: top, placements, left_out: Some(c) });
            }
            placements[c] = place;
        }
        Ok(Fill { height: top, placements, left_out: None })
    }
}

/// Cells of padding, where the page has `cells` cells along its longer side.
pub(crate) fn grow(job: &PackJob<'_>, cells: f64) -> usize {
    let texels = f64::from(job.page[0].max(job.page[1]));
    ((f64::from(job.padding) * cells / texels).ceil() as usize).max(1)
}
