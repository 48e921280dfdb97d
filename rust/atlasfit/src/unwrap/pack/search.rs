//! One page, filled as far as possible: the order in which charts are placed is searched for.
//!
//! Charts go, largest first, to the lowest free place over several rotations, into a strip as wide as the page. Orders
//! are then changed a little at a time, each into a page a little smaller than the best so far: most fail early.

use super::boxes::one_page_of_boxes;
use super::mask::{Pose, bounds, poses};
use super::strip::Strip;
use super::tighten::tighten;
use super::{EXPECTED_FILL, Goal, Place, largest_first};
use crate::error::Result;
use crate::numeric::rng::Rng;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use rayon::prelude::*;
use std::collections::HashMap;

/// Cells across the page while its size is estimated, and while orders are searched for.
const ROUGH: f64 = 256.0;
pub(super) const CELLS: f64 = 512.0;
/// The page is aimed to be this much smaller than `CELLS`: padding in whole cells must not come out too small.
const ROOM: f64 = 0.985;
/// Strip widths tried one after the other.
const WIDTHS: usize = 4;
/// Orders tried at once, and rounds of trying; with many charts only `ORDER_WORK` / charts rounds.
const ORDERS: usize = 2;
const ORDER_ROUNDS: usize = 30;
const ORDER_WORK: usize = 2000;
/// The charts of a mesh of this many faces take about as long to find as their page, searched for that many rounds. Larger meshes are searched for
/// more rounds in proportion, up to `MOST_EFFORT` times: that costs them little.
const EFFORT_FACES: f64 = 16_000.0;
const MOST_EFFORT: f64 = 8.0;
/// Rounds without success before the page shrinks by half as much at a time, and how often it does so.
const PATIENCE: usize = 6;
const HALVINGS: usize = 2;
/// The page shrinks by this share of its side at a time, at first.
const SHRINK: f64 = 0.02;
/// Masks of at most this many cells each way count as alike if their boxes are.
const SMALL: usize = 8;
/// Charts above this share of the area are tried at more rotations.
const TURN_MORE: f64 = 0.001;
/// Rotations, in quarters, of the large charts and of the others.
const TURNS: (usize, usize) = (6, 2);

/// A chart's pose and the lower left cell of its grown mask.
#[derive(Clone, Copy, Default)]
pub(super) struct Spot {
    pub pose: usize,
    pub x: usize,
    pub y: usize,
}

/// Charts as cells, for a page of one shape.
pub(super) struct Board {
    pub cell: f64,
    pub grow: usize,
    pub poses: Vec<Vec<Pose>>,
    /// Height of the page over its width.
    aspect: f64,
    /// No page is narrower, in cells.
    narrowest: usize,
    /// Factor on the rounds of the search.
    effort: f64,
}

/// A filled page.
#[derive(Clone)]
struct Filled {
    /// Side in cells of the page's width that it needs.
    size: usize,
    order: Vec<usize>,
    spots: Vec<Spot>,
}

impl Board {
    fn new(
        charts: &[Chart],
        upright: &[[f64; 2]],
        goal: &Goal,
        side: f64,
        cells: f64,
        turns: (usize, usize),
    ) -> Self {
        let aspect = f64::from(goal.page[1]) / f64::from(goal.page[0]);
        let cell = side * aspect.max(1.0) / cells;
        let grow = grow(goal, cells);
        let area: f64 = charts.iter().map(|c| c.area).sum();
        let poses: Vec<Vec<Pose>> = (charts.par_iter().zip(upright))
            .map(|(c, &r)| poses(c, r, cell, grow, if c.area > TURN_MORE * area { turns.0 } else { turns.1 }))
            .collect();
        let narrowest =
            poses.iter().map(|p| p.iter().map(|q| q.grown.width).min().unwrap_or(0)).max().unwrap_or(0);
        let faces: usize = charts.iter().map(|c| c.faces.len()).sum();
        let effort = (faces as f64 / EFFORT_FACES).clamp(1.0, MOST_EFFORT);
        Self { cell, grow, poses, aspect, narrowest, effort }
    }

    /// Rows of a page of some width.
    fn rows(&self, width: usize) -> usize {
        (width as f64 * self.aspect) as usize
    }

    /// Fills a strip in some order. Gives its height and the spots, or the chart that does not fit below `limit`.
    fn fill(
        &self,
        order: &[usize],
        width: usize,
        limit: usize,
        top_counts: bool,
    ) -> std::result::Result<(usize, Vec<Spot>), usize> {
        match width.div_ceil(64) {
            0..=4 => self.fill_words::<4>(order, width, limit, top_counts),
            5..=8 => self.fill_words::<8>(order, width, limit, top_counts),
            9..=16 => self.fill_words::<16>(order, width, limit, top_counts),
            17..=32 => self.fill_words::<32>(order, width, limit, top_counts),
            _ => self.fill_words::<128>(order, width.min(128 * 64), limit, top_counts),
        }
    }

    fn fill_words<const W: usize>(
        &self,
        order: &[usize],
        width: usize,
        limit: usize,
        top_counts: bool,
    ) -> std::result::Result<(usize, Vec<Spot>), usize> {
        let mut strip = Strip::<W>::new(width);
        let mut top = 0;
        let mut spots = vec![Spot::default(); self.poses.len()];
        // Where masks of a size were last put: below that there is no room for small ones of the same size.
        let mut lowest: HashMap<(usize, usize), usize> = HashMap::new();
        for &c in order {
            let poses = &self.poses[c];
            let tallest = poses.iter().map(|p| p.grown.height).max().unwrap_or(0);
            let mut found: Option<Spot> = None;
            let mut best = usize::MAX / 4;
            for (i, pose) in poses.iter().enumerate() {
                // A place counts by how high its middle or its top lies: twice that, to stay whole.
                let height = pose.grown.height;
                let own = if top_counts { 2 * height } else { height };
                let room = (top + tallest).min(limit).min((best - own.min(best)) / 2 + height);
                let size = (pose.grown.width, height);
                let from = if size.0.max(size.1) <= SMALL { *lowest.get(&size).unwrap_or(&0) } else { 0 };
                if let Some((x, y)) = strip.find(&pose.grown, from, room) {
                    lowest.insert(size, y);
                    if 2 * y + own < best {
                        best = 2 * y + own;
                        found = Some(Spot { pose: i, x, y });
                    }
                }
            }
            let Some(spot) = found else { return Err(c) };
            let pose = &poses[spot.pose];
            strip.put(&pose.tight, spot.x + self.grow, spot.y + self.grow);
            top = top.max(spot.y + pose.grown.height);
            if top > limit {
                return Err(c);
            }
            spots[c] = spot;
        }
        Ok((top, spots))
    }

    /// Strips of several widths; the one that makes the smallest page.
    fn first(&self, width: usize, widths: usize, ctx: &Context<'_>) -> Result<Option<Filled>> {
        let order = largest_first(&self.poses);
        let mut best: Option<Filled> = None;
        let mut width = width;
        for _ in 0..widths {
            ctx.check()?;
            width = width.max(self.narrowest);
            let limit = best.as_ref().map_or(usize::MAX / 4, |b| self.rows(b.size));
            let Ok((top, spots)) = self.fill(&order, width, limit, false) else { break };
            let top = (top as f64 / self.aspect).ceil() as usize;
            let size = top.max(width);
            if best.as_ref().is_none_or(|b| size < b.size) {
                best = Some(Filled { size, order: order.clone(), spots });
            }
            let next = if top > width {
                ((top * width) as f64).sqrt() as usize
            } else {
                width - (width - top).div_ceil(2)
            };
            if next == width || top == width || width == self.narrowest && top < width {
                break;
            }
            width = next;
        }
        Ok(best)
    }

    /// Changes the order as long as that makes the page smaller.
    fn improve(&self, mut best: Filled, seed: u64, ctx: &Context<'_>) -> Result<Filled> {
        // Many charts fill the gaps anyway, and each try costs more.
        let times = |n: usize| (n as f64 * self.effort) as usize;
        let rounds = (ORDER_WORK / self.poses.len().max(1)).min(times(ORDER_ROUNDS)) as u64;
        let patience = times(PATIENCE);
        let (mut failures, mut halvings) = (0, 0);
        let mut shrink = SHRINK;
        // Charts that did not fit are moved to the front.
        let mut urgent: Vec<usize> = Vec::new();
        for round in 0..rounds {
            ctx.check()?;
            let target = best.size - ((best.size as f64 * shrink) as usize).max(1);
            if target < self.narrowest {
                break;
            }
            let tries: Vec<_> = (0..ORDERS as u64)
                .into_par_iter()
                .map(|v| {
                    let mut random = Rng::stream(seed, round << 8 | v);
                    let mut order = best.order.clone();
                    if let Some(&c) = urgent.get(v as usize) {
                        advance(&mut order, c, &mut random);
                    }
                    let c = order[random.below(order.len())];
                    advance(&mut order, c, &mut random);
                    let filled = self.fill(&order, target, self.rows(target), v % 2 == 1);
                    (order, filled)
                })
                .collect();
            urgent.clear();
            let mut better: Option<(usize, Filled)> = None;
            for (order, filled) in tries {
                match filled {
                    Ok((top, spots)) => {
                        if better.as_ref().is_none_or(|b| top < b.0) {
                            better = Some((top, Filled { size: target, order, spots }));
                        }
                    }
                    Err(c) => urgent.push(c),
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
                        if halvings == HALVINGS {
                            break;
                        }
                        (failures, halvings, shrink) = (0, halvings + 1, shrink * 0.5);
                    }
                }
            }
        }
        Ok(best)
    }
}

/// Cells of padding, where the page has `cells` cells along its longer side.
pub(super) fn grow(goal: &Goal, cells: f64) -> usize {
    let texels = f64::from(goal.page[0].max(goal.page[1]));
    ((f64::from(goal.padding) * cells / texels).ceil() as usize).max(1)
}

/// Moves a chart some way to the front of the order.
fn advance(order: &mut Vec<usize>, c: usize, random: &mut Rng) {
    if let Some(at) = order.iter().position(|&x| x == c) {
        order.remove(at);
        order.insert(random.below(at + 1), c);
    }
}

/// Fills one page as far as possible. Gives the places and texels per unit.
pub(super) fn one_page(
    charts: &[Chart],
    upright: &[[f64; 2]],
    goal: &Goal,
    ctx: &Context<'_>,
) -> Result<(Vec<Place>, f64)> {
    let area: f64 = charts.iter().map(|c| c.area).sum();
    let aspect = f64::from(goal.page[1]) / f64::from(goal.page[0]);
    // A chart far longer than the page's expected side decides the page, and so the cells.
    let longest = charts
        .iter()
        .map(|c| {
            let (lo, hi) = bounds(&c.uv);
            (hi[0] - lo[0]).hypot(hi[1] - lo[1])
        })
        .fold(0.0, f64::max);
    let many = charts.len() > ORDER_WORK;
    let mut side = (area / EXPECTED_FILL / aspect).sqrt().max(longest * 0.8 / aspect.max(1.0));
    if !many {
        let rough = Board::new(charts, upright, goal, side, ROUGH, (1, 1));
        let width = (area / 0.8 / aspect).sqrt() / rough.cell;
        if let Some(filled) = rough.first(width as usize, WIDTHS, ctx)? {
            side = filled.size as f64 * rough.cell / ROOM;
        }
    }
    let board = Board::new(charts, upright, goal, side, CELLS, TURNS);
    let width = (side * ROOM / board.cell) as usize;
    let Some(first) = board.first(width, if many { 1 } else { 2 }, ctx)? else {
        return Ok(one_page_of_boxes(charts, upright, goal));
    };
    let filled = board.improve(first, goal.seed, ctx)?;
    let places: Vec<Place> = (filled.spots.iter().zip(&board.poses))
        .map(|(s, p)| p[s.pose].at(s.x + board.grow, s.y + board.grow, board.cell))
        .collect();
    let density = f64::from(goal.page[0]) / (filled.size as f64 * board.cell);
    Ok(tighten(charts, &places, density, goal, ctx)?.unwrap_or((places, density)))
}
