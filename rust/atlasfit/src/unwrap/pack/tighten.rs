//! The last cells of a packing: charts are pushed together on a finer grid.
//!
//! In: places on one page. Out: places that are closer together, with exactly the padding asked for. Charts are dropped
//! downward, lowest first, then to the left, leftmost first, and so on.

use super::mask::{Mask, Pose, pose, set_range};
use super::search::grow;
use super::{Goal, Place};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use rayon::prelude::*;

/// Cells along the page's longer side.
const FINE: f64 = 2048.0;
/// How far a chart moves in one sweep at most, in cells: down, and up again where rounding made it touch.
const DROP: usize = 48;
const LIFT: usize = 16;
/// Sweeps down and to the left.
const SWEEPS: usize = 3;
/// More charts than this leave little to gain.
const MOST: usize = 1000;

/// A bitmap of the page.
struct Plane {
    words: usize,
    on: Vec<u64>,
}

impl Plane {
    fn is_free(&self, m: &Mask, x: usize, y: usize) -> bool {
        m.runs.iter().all(|&(r, from, to)| {
            let row = (y + r as usize) * self.words;
            let Some(row) = self.on.get(row..row + self.words) else { return true };
            let (from, to) = (x + from as usize, x + to as usize);
            let (a, b) = (from / 64, (to - 1) / 64);
            let (head, tail) = (u64::MAX << (from % 64), u64::MAX >> (63 - (to - 1) % 64));
            if a == b {
                return row[a] & head & tail == 0;
            }
            row[a] & head == 0 && row[b] & tail == 0 && row[a + 1..b].iter().all(|&w| w == 0)
        })
    }
    fn put(&mut self, m: &Mask, x: usize, y: usize) {
        let need = (y + m.height) * self.words;
        if self.on.len() < need {
            self.on.resize(need, 0);
        }
        for &(r, from, to) in &m.runs {
            let row = (y + r as usize) * self.words;
            set_range(&mut self.on[row..row + self.words], x + from as usize, x + to as usize);
        }
    }
}

/// Pushes the charts together; `None` where that gains nothing.
pub(super) fn tighten(
    charts: &[Chart],
    places: &[Place],
    density: f64,
    goal: &Goal,
    ctx: &Context<'_>,
) -> Result<Option<(Vec<Place>, f64)>> {
    if charts.len() > MOST {
        return Ok(None);
    }
    let cell = f64::from(goal.page[0].max(goal.page[1])) / density / FINE;
    let grow = grow(goal, FINE);
    let poses: Vec<Pose> =
        charts.par_iter().zip(places).map(|(c, p)| pose(c, p.rotation, cell, grow)).collect();
    ctx.check()?;
    // Cells of the lower left corner of each grown mask.
    let mut at: Vec<[usize; 2]> = (poses.iter().zip(places))
        .map(|(pose, p)| {
            [0, 1].map(|k| (((pose.origin[k] + p.shift[k]) / cell).round() as usize).saturating_sub(grow))
        })
        .collect();
    let room = (2.0 * FINE) as usize;
    let mut order: Vec<usize> = (0..charts.len()).collect();
    for sweep in 0..2 * SWEEPS {
        ctx.check()?;
        let axis = 1 - sweep % 2;
        order.sort_by_key(|&c| (at[c][axis], at[c][1 - axis], c));
        let mut plane = Plane { words: (room + 2 * DROP).div_ceil(64), on: Vec::new() };
        let mut moved = false;
        for &c in &order {
            let mut p = at[c];
            let from = at[c][axis].saturating_sub(DROP);
            let Some(free) = (from..=at[c][axis] + LIFT).find(|&t| {
                p[axis] = t;
                p[0] + poses[c].grown.width < room && plane.is_free(&poses[c].grown, p[0], p[1])
            }) else {
                return Ok(None);
            };
            moved |= free != at[c][axis];
            at[c][axis] = free;
            plane.put(&poses[c].tight, at[c][0] + grow, at[c][1] + grow);
        }
        if !moved && sweep > 0 {
            break;
        }
    }
    let extent = |k: usize, size: fn(&Mask) -> usize| {
        at.iter().zip(&poses).map(|(a, p)| a[k] + size(&p.grown)).max().unwrap_or(1) as f64
    };
    let (width, height) = (extent(0, |m| m.width), extent(1, |m| m.height));
    let tight = (f64::from(goal.page[0]) / (width * cell)).min(f64::from(goal.page[1]) / (height * cell));
    if tight <= density {
        return Ok(None);
    }
    let places = at.iter().zip(&poses).map(|(a, p)| p.at(a[0] + grow, a[1] + grow, cell)).collect();
    Ok(Some((places, tight)))
}
