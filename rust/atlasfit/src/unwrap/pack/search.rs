//! One page, filled as far as possible: the order in which charts are placed is searched for.
//!
//! Charts go, largest first, to the lowest free place over several rotations, into a strip as wide as the
//! page. Orders are then changed a little at a time, each into a page a little smaller than the best so far:
//! most fail early.

use super::board::{Board, Fill, Filled, Grid, Order};
use super::constants::{CELLS, PACK};
use super::mask::largest_first;
use super::placement::{PackJob, Packed, Placement};
use super::tighten::tighten;
use crate::error::Result;
use crate::numeric::rng::Rng;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::planar::bounds;
use rayon::prelude::*;

/// Fills one page as far as possible. Gives the places and texels per unit; `None` where the padding leaves
/// too few texels to the charts.
pub(crate) fn one_page(
    charts: &[Chart],
    upright: &[[f64; 2]],
    job: &PackJob<'_>,
    ctx: &Context<'_>,
) -> Result<Option<Packed>> {
    let many = charts.len() > PACK.order_work;
    let mut side = rough_side(charts, upright, job, ctx)?;
    for tried in 0..PACK.pages_tried {
        let density = f64::from(job.page[0]) / side;
        if density < job.least_density(charts) || !Board::has_cells_for(charts.len(), job) {
            break;
        }
        let grid = Grid { side, cells: CELLS, turns: [PACK.turns, PACK.turns_small] };
        let board = Board::new(charts, upright, job, grid, ctx)?;
        let width = (side * PACK.room / board.cell) as usize;
        let Some(mut filled) = first(&board, width, if many { 1 } else { 2 }, ctx)? else { break };
        let padding = |size: usize| board.grow as f64 * f64::from(job.page[0]) / size as f64;
        let near = if tried == 0 { PACK.padding_near } else { 1.0 };
        if padding(filled.size) >= near * f64::from(job.padding) {
            filled = improve(&board, filled, job.seed, ctx)?;
            let placements: Vec<Placement> = (filled.placements.iter().zip(&board.poses))
                .map(|(s, p)| p[s.pose].at(s.x + board.grow, s.y + board.grow, board.cell))
                .collect();
            let density = f64::from(job.page[0]) / (filled.size as f64 * board.cell);
            let packed = Packed { placements, density, padding: job.padding };
            if let Some(tight) = tighten(charts, &packed, job, ctx)? {
                return Ok(Some(tight));
            }
            if padding(filled.size) >= (1.0 - PACK.rounding) * f64::from(job.padding) {
                return Ok(Some(packed));
            }
        }
        // All cells of this page, and the padding in proportion.
        side = filled.size as f64 * board.cell / PACK.room;
    }
    Ok(None)
}

/// The width of the page in units of the surface, about.
fn rough_side(charts: &[Chart], upright: &[[f64; 2]], job: &PackJob<'_>, ctx: &Context<'_>) -> Result<f64> {
    let area: f64 = charts.iter().map(|c| c.area).sum();
    let aspect = f64::from(job.page[1]) / f64::from(job.page[0]);
    // A chart far longer than the page's expected side decides the page, and so the cells.
    let longest = charts
        .iter()
        .map(|c| {
            let (lo, hi) = bounds(&c.uv);
            (hi[0] - lo[0]).hypot(hi[1] - lo[1])
        })
        .fold(0.0, f64::max);
    let side = (area / PACK.expected_fill / aspect).sqrt().max(longest * PACK.decisive / aspect.max(1.0));
    if charts.len() > PACK.order_work {
        return Ok(side);
    }
    let rough = Board::new(charts, upright, job, Grid { side, cells: PACK.rough, turns: [1, 1] }, ctx)?;
    let width = (area / PACK.rough_fill / aspect).sqrt() / rough.cell;
    let filled = first(&rough, width as usize, PACK.widths, ctx)?;
    Ok(filled.map_or(side, |f| f.size as f64 * rough.cell / PACK.room))
}

/// Strips of several widths; the one that makes the smallest page.
fn first(board: &Board, width: usize, widths: usize, ctx: &Context<'_>) -> Result<Option<Filled>> {
    let order = largest_first(&board.poses);
    let mut best: Option<Filled> = None;
    let mut width = width;
    for _ in 0..widths {
        ctx.check()?;
        width = width.max(board.narrowest);
        let limit = best.as_ref().map_or(usize::MAX / 4, |b| board.rows(b.size));
        let strip = Order { charts: &order, width, limit, top_counts: false };
        let Fill { height, placements, left_out } = board.fill(strip, ctx)?;
        if left_out.is_some() {
            break;
        }
        let top = (height as f64 / board.aspect).ceil() as usize;
        let size = top.max(width);
        if best.as_ref().is_none_or(|b| size < b.size) {
            best = Some(Filled { size, order: order.clone(), placements });
        }
        let next = if top > width {
            ((top * width) as f64).sqrt() as usize
        } else {
            width - (width - top).div_ceil(2)
        };
        if next == width || top == width || width == board.narrowest && top < width {
            break;
        }
        width = next;
    }
    Ok(best)
}

/// Changes the order as long as that makes the page smaller.
fn improve(board: &Board, mut best: Filled, seed: u64, ctx: &Context<'_>) -> Result<Filled> {
    // Many charts fill the gaps anyway, and each try costs more.
    let times = |n: usize| (n as f64 * board.effort) as usize;
    let rounds = (PACK.order_work / board.poses.len().max(1)).min(times(PACK.order_rounds)) as u64;
    let patience = times(PACK.patience);
    let (mut failures, mut halvings) = (0, 0);
    let mut shrink = PACK.shrink;
    // Charts that did not fit are moved to the front.
    let mut urgent: Vec<usize> = Vec::new();
    for round in 0..rounds {
        ctx.check()?;
        let target = best.size - ((best.size as f64 * shrink) as usize).max(1);
        if target < board.narrowest {
            break;
        }
        let tries: Vec<_> = (0..PACK.orders as u64)
            .into_par_iter()
            .map(|v| {
                let mut random = Rng::stream(seed, round << 8 | v);
                let mut order = best.order.clone();
                if let Some(&c) = urgent.get(v as usize) {
                    advance(&mut order, c, &mut random);
                }
                let c = order[random.below(order.len())];
                advance(&mut order, c, &mut random);
                let limit = board.rows(target);
                let strip = Order { charts: &order, width: target, limit, top_counts: v % 2 == 1 };
                let filled = board.fill(strip, ctx)?;
                Ok((order, filled))
            })
            .collect::<Result<_>>()?;
        urgent.clear();
        let mut better: Option<(usize, Filled)> = None;
        for (order, filled) in tries {
            let Fill { height: top, placements, left_out } = filled;
            if let Some(chart) = left_out {
                urgent.push(chart);
            } else if better.as_ref().is_none_or(|b| top < b.0) {
                better = Some((top, Filled { size: target, order, placements }));
            }
        }
        match better {
            Some((_, filled)) => {
                best = filled;
                failures = 0;
            }
            None => {
                failures += 1;
                if failures == patience {
                    if halvings == PACK.halvings {
                        break;
                    }
                    (failures, halvings, shrink) = (0, halvings + 1, shrink * 0.5);
                }
            }
        }
    }
    Ok(best)
}

/// Moves a chart some way to the front of the order.
fn advance(order: &mut Vec<usize>, c: usize, random: &mut Rng) {
    if let Some(at) = order.iter().position(|&x| x == c) {
        order.remove(at);
        order.insert(random.below(at + 1), c);
    }
}
