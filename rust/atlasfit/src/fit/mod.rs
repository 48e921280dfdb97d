//! Fitting the charts: alternate foot points and one small solve per chart.
//!
//! In: points and patches. Out: charts. For fixed foot points the data term (distance along the normal, the
//! part of the Chamfer distance that a chart can change) and the prior are quadratic in the chart's
//! coefficients, so each round is one solve (the paper's loss, with the prior in its Gaussian-process limit
//! in place of the network). Robust weights keep stray points and other sheets out.

mod bias;
pub(crate) mod constants;
pub(crate) mod leverage;
mod refit;
mod sheet;
#[cfg(test)]
mod tests;
mod two_sheets;

use crate::atlas::mask::Mask;
use crate::atlas::{Chart, FittedChart, Map, Patch};
use crate::error::Result;
use crate::numeric::robust::{TUKEY, tukey};
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::run::Context;
use constants::FIT;
use rayon::prelude::*;
pub(crate) use refit::refit;
pub(crate) use sheet::Tools;
use sheet::{DomainPoint, FootPoints, Sheet, residuals, solve};
use two_sheets::two_sheets;

/// Fits every patch, a step of the running stage each. A patch that turns out to hold two sheets gives two
/// charts.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn fit(points: &[Vec3], patches: &[Patch], ctx: &Context<'_>) -> Result<Vec<FittedChart>> {
    let fitted = patches
        .par_iter()
        .map_init(Tools::default, |tools, patch| {
            ctx.check()?;
            let mut out = Vec::new();
            fit_patch(points, patch, tools, &mut out);
            ctx.advance(1);
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(fitted.into_iter().flatten().collect())
}

fn fit_patch(points: &[Vec3], patch: &Patch, tools: &mut Tools, out: &mut Vec<FittedChart>) {
    let sigma = patch.sigma;
    let full: Vec<DomainPoint> = patch
        .members
        .iter()
        .map(|&m| {
            let d = points[m as usize] - patch.center;
            [
                d.dot(patch.axes[0]) / patch.radii[0],
                d.dot(patch.axes[1]) / patch.radii[1],
                d.dot(patch.axes[2]),
            ]
        })
        .collect();
    // A few thousand points tell as much as a clump of a hundred thousand.
    let step = full.len().div_ceil(FIT.max_data).max(1);
    let few: Vec<DomainPoint> = full.iter().step_by(step).copied().collect();
    let rough: Vec<DomainPoint> =
        few.iter().step_by(few.len().div_ceil(FIT.rough_data).max(1)).copied().collect();
    let q = &patch.quadric;
    let mut weights: Vec<f64> = rough
        .iter()
        .map(|&[u, v, z]| {
            let e = z - (q[0] + q[1] * u + q[2] * v + q[3] * u * u + q[4] * u * v + q[5] * v * v);
            tukey(e, TUKEY * sigma + 1e-12)
        })
        .collect();
    let mut sheet = Sheet::empty(patch, sigma);
    for round in 0..FIT.rounds {
        let data = if round + 1 < FIT.rounds { &rough } else { &few };
        if round > 0 {
            let limit = TUKEY * sheet.sigma;
            weights = residuals(&sheet.map, data).map(|e| tukey(e, limit)).collect();
        }
        if solve(&mut sheet, data, &weights, FootPoints::of_round(round), sigma, tools).is_none() {
            return;
        }
    }
    let sheets = match two_sheets(&sheet.map, &few, patch, sigma, tools) {
        Some(pair) => pair.into(),
        None => vec![sheet],
    };
    let errors: Vec<Vec<f64>> = sheets.iter().map(|s| residuals(&s.map, &full).collect()).collect();
    for (k, sheet) in sheets.into_iter().enumerate() {
        // A point belongs to the sheet that explains it better.
        let limit = TUKEY * sheet.sigma;
        let weights: Vec<f64> = (0..full.len())
            .map(|i| {
                let e = errors[k][i];
                if errors.iter().all(|other| e.abs() <= other[i].abs()) { tukey(e, limit) } else { 0.0 }
            })
            .collect();
        out.extend(finish(sheet, &full, &weights, patch));
    }
}

/// The chart of a sheet, with its mask and its members; nothing without members.
fn finish(mut sheet: Sheet, points: &[DomainPoint], weights: &[f64], patch: &Patch) -> Option<FittedChart> {
    let inside: Vec<[f64; 2]> =
        points.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(l, _)| [l[0], l[1]]).collect();
    sheet.map.mask = Mask::build(&inside, sheet.map.radii, patch.spacing, sheet.sigma);
    bias::sharpen(&mut sheet.map, sheet.sigma);
    let members = patch
        .members
        .iter()
        .zip(points.iter().zip(weights))
        .filter(|(_, (l, w))| l[0] * l[0] + l[1] * l[1] < PARTITION.rim * PARTITION.rim && **w > 0.0)
        .map(|(&m, (_, &w))| (m, w as f32))
        .collect::<Vec<_>>();
    let Sheet { map, sigma, support, smoothness } = sheet;
    let chart = Chart { map: Map::Monge(map), sigma, sign: 1.0, support };
    (!members.is_empty()).then_some(FittedChart {
        chart,
        members,
        expected: patch.sigma,
        smoothness,
        of_two: patch.of_two,
    })
}
