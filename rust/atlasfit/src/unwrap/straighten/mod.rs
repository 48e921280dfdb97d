//! Charts laid straight where a person would straighten them.
//!
//! In: flattened charts. Out: the same charts; strips and tubes that are cut open are rectangles (`corners`,
//! `rectangle`), rings are cut across and are so too (`ring`), and the long sides of others are straight
//! lines (`sides`), as far as the bound on the stretch allows. All of these lie along the axes.

mod border;
mod constants;
mod corners;
mod flat;
mod goal;
mod rectangle;
mod ring;
mod sides;

use super::bounded::judge;
use super::chart::Chart;
use super::options::{Straighten, UnwrapOptions};
use super::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use border::loops;
use constants::STRAIGHT;
use corners::corners;
use goal::Goal;
use rayon::prelude::*;
use rectangle::rectangle;
use ring::opened;
use sides::with_straight_sides;

/// Straightens the charts that are not straight yet. `bound` is that of the stretch; all charts together
/// hold it as they did before.
pub(crate) fn straighten(
    s: &Surface,
    mut list: Vec<Chart>,
    options: &UnwrapOptions,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    if options.straighten == Straighten::Off {
        return Ok(list);
    }
    let goal = Goal { bound, energy: options.max_energy };
    let held = judge(s, &mut list, bound, ctx)?;
    let over: Vec<f64> = list.iter().map(|c| c.over).collect();
    let made: Vec<Option<Chart>> = (list.par_iter())
        .map(|c| {
            ctx.check()?;
            let made = if c.straight { None } else { straightened(s, c, goal, ctx) };
            ctx.check().map(|()| made)
        })
        .collect::<Result<_>>()?;
    let mut old: Vec<Option<Chart>> = Vec::with_capacity(list.len());
    let mut now: Vec<Chart> = Vec::with_capacity(list.len());
    for (c, made) in list.into_iter().zip(made) {
        let (c, before) = if let Some(made) = made { (made, Some(c)) } else { (c, None) };
        now.push(c);
        old.push(before);
    }
    if options.max_energy.is_none() {
        give_back(s, &mut now, old, held, &over, bound, ctx)?;
    }
    Ok(now)
}

/// Puts back old charts, those first whose new ones stretch most beyond the bound, until all charts together
/// hold what they `held`. `over` is what each was stretched beyond the bound before.
fn give_back(
    s: &Surface,
    now: &mut [Chart],
    mut old: Vec<Option<Chart>>,
    held: f64,
    over: &[f64],
    bound: f64,
    ctx: &Context<'_>,
) -> Result<()> {
    let mut new: Vec<usize> = (0..now.len()).filter(|&i| old[i].is_some()).collect();
    let mut batch = 1;
    while !new.is_empty() && judge(s, now, bound, ctx)? > held {
        let worse = |i: usize| now[i].over - over[i];
        new.sort_by(|&i, &j| worse(i).total_cmp(&worse(j)).then(j.cmp(&i)));
        for i in new.split_off(new.len().saturating_sub(batch)) {
            if let Some(c) = old[i].take() {
                now[i] = c;
            }
        }
        batch *= 2;
    }
    Ok(())
}

/// The chart straightened; `None` where it stays as it is, also when the run is to stop: the caller checks.
fn straightened(s: &Surface, c: &Chart, goal: Goal, ctx: &Context<'_>) -> Option<Chart> {
    if c.faces.len() > STRAIGHT.most_faces {
        return None;
    }
    let loops = loops(c)?;
    if let [border] = &loops[..] {
        let made = corners(border, &c.uv).into_iter().find_map(|at| rectangle(s, c, border, at, goal, ctx));
        if made.is_some() {
            return made;
        }
    } else if let [a, b] = &loops[..]
        && let Some(open) = opened(s, c, [a, b], ctx)
        && let Some(made) = rectangle(s, &open.chart, &open.border, open.corners, goal, ctx)
    {
        return Some(made);
    }
    ctx.check().ok()?;
    with_straight_sides(s, c, &loops, goal, ctx)
}
