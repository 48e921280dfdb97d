//! The charts of each point, from the points of each chart.
//!
//! In: the charts' members; the points' names, which choose those that are looked at where charts are
//! compared: the same in a scan and in a tile of it. Out: a row for each point.

use super::constants::BLEND;
use crate::atlas::{FittedChart, Membership};
use crate::error::Result;
use crate::numeric::scatter::one_in;
use crate::run::Context;

/// Turns the charts' member lists into per-point lists (charts ascending). There is one of `names` for each
/// point.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn of_points(names: &[u64], fitted: &[FittedChart], ctx: &Context<'_>) -> Result<Membership> {
    let points = names.len();
    let mut start = vec![0u32; points + 1];
    for (c, f) in fitted.iter().enumerate() {
        if c % BLEND.check_charts == 0 {
            ctx.check()?;
        }
        for &(m, _) in &f.members {
            start[m as usize + 1] += 1;
        }
    }
    for i in 0..points {
        start[i + 1] += start[i];
    }
    let mut fill = start.clone();
    let mut entries = vec![(0u32, 0f32); start[points] as usize];
    for (c, f) in fitted.iter().enumerate() {
        if c % BLEND.check_charts == 0 {
            ctx.check()?;
        }
        for &(m, w) in &f.members {
            entries[fill[m as usize] as usize] = (c as u32, w);
            fill[m as usize] += 1;
        }
    }
    let share: Vec<u16> = (fitted.iter())
        .map(|f| (f.members.len() / BLEND.compared).clamp(1, usize::from(u16::MAX)) as u16)
        .collect();
    let mut stands_for = vec![0; points];
    for (i, (stands_for, &name)) in stands_for.iter_mut().zip(names).enumerate() {
        ctx.check_at(i)?;
        let row = &entries[start[i] as usize..start[i + 1] as usize];
        let share = row.iter().map(|&(c, _)| share[c as usize]).min().unwrap_or(1);
        *stands_for = if one_in(share.into(), name, 0) { share } else { 0 };
    }
    Ok(Membership { start, entries, stands_for })
}
