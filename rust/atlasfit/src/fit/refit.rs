//! Charts fitted again, smoother or rougher than the data say.
//!
//! In: fitted charts with their members. Out: the same charts with other heights. Members, weights and domain
//! stay, so that nothing else about the atlas changes, and what two solves of the same data differ by is
//! added to the heights: a little more smoothing changes little, and more never follows the points more
//! closely.

use super::constants::FIT;
use super::sheet::{DomainPoint, Sheet, Tools, change, shift};
use crate::atlas::{FittedChart, Map};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::prior::smoothing::Smoothing;
use crate::run::Context;
use rayon::prelude::*;

/// Fits the charts over planes again, a step of the running stage each. One that cannot be fitted so stays as
/// it was.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn refit(
    points: &[Vec3],
    fitted: &mut [FittedChart],
    smoothing: Smoothing,
    ctx: &Context<'_>,
) -> Result<()> {
    fitted
        .par_chunks_mut(8)
        .map(|chunk| {
            let mut tools = Tools::default();
            for f in chunk.iter_mut() {
                ctx.check()?;
                refit_chart(points, f, smoothing, &mut tools);
            }
            ctx.advance(chunk.len());
            Ok(())
        })
        .collect()
}

fn refit_chart(points: &[Vec3], f: &mut FittedChart, smoothing: Smoothing, tools: &mut Tools) {
    let Map::Monge(map) = &mut f.chart.map else { return };
    let step = f.members.len().div_ceil(FIT.max_data).max(1);
    let (few, weights): (Vec<DomainPoint>, Vec<f64>) = (f.members.iter().step_by(step))
        .map(|&(m, w)| {
            let l = map.local(points[m as usize]);
            ([l.u, l.v, l.z], f64::from(w))
        })
        .unzip();
    let mut sheet = Sheet::of_chart(map.clone(), f.expected);
    let Some(to) = shift(&sheet, &few, &weights, smoothing, tools) else { return };
    let mut sigma = f.chart.sigma;
    for _ in 0..FIT.refits {
        let Some(change) = change(&sheet, &few, &weights, &to, tools) else { return };
        for ((new, old), change) in sheet.map.coeffs.iter_mut().zip(map.coeffs.iter()).zip(&change.coeffs) {
            *new = old + change;
        }
        sigma = change.sigma;
    }
    f.smoothness = Some(to.wanted);
    // Points that a smoother chart leaves farther off are still its own.
    f.chart.sigma = f.chart.sigma.max(sigma);
    *map = sheet.map;
}
