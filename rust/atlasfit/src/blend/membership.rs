//! The charts of each point, from the points of each chart.

use super::constants::BLEND;
use crate::atlas::{FittedChart, Membership};
use crate::error::Result;
use crate::run::Context;

/// Turns the charts' member lists into per-point lists (charts ascending).
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn of_points(points: usize, fitted: &[FittedChart], ctx: &Context<'_>) -> Result<Membership> {
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
    Ok(Membership { start, entries })
}
