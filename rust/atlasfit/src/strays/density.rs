//! Whether points lie as densely as the surface about them.
//!
//! In: points, of which some lie on charts that stand. Out: for each other point the evidence, in nats, that
//! it belongs to a surface as dense as theirs.

use super::constants::STRAYS;
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::partition::Cut;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::neighbours::Neighbour;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// The scatter of a Gaussian over the median distance from its middle.
const SCATTER_OF_MEDIAN: f64 = 1.4826;

/// The evidence at each of the points `asked` from those that are `known`.
pub(super) fn evidence(cut: &Cut<'_>, known: &[u32], asked: &[u32], ctx: &Context<'_>) -> Result<Vec<f64>> {
    let Cut { points, tree, .. } = *cut;
    let places: Vec<Vec3> = known.iter().map(|&i| points[i as usize]).collect();
    let around = Neighbours::build(&places, ctx)?;
    // The logarithm of the spacing at a point, less the median of the known ones about it.
    let relative = |point: u32, found: &mut Vec<Neighbour>| {
        let at = points[point as usize];
        let own = log_spacing(at, tree, found);
        around.nearest(at, STRAYS.around, found);
        let near: Vec<Vec3> = found.iter().map(|f| places[f.index as usize]).collect();
        let mut usual: Vec<f64> = near.into_iter().map(|p| log_spacing(p, tree, found)).collect();
        own - median(&mut usual)
    };
    let of = |some: &[u32]| -> Result<Vec<f64>> {
        some.par_chunks(64)
            .map(|chunk| {
                ctx.check()?;
                let mut found = Vec::new();
                Ok(chunk.iter().map(|&i| relative(i, &mut found)).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()
            .map(|v| v.concat())
    };
    let step = known.len().div_ceil(STRAYS.scatter_samples).max(1);
    let sample: Vec<u32> = known.iter().step_by(step).copied().collect();
    let mut off: Vec<f64> = of(&sample)?.into_iter().map(f64::abs).collect();
    let scatter = (SCATTER_OF_MEDIAN * median(&mut off)).max(STRAYS.least_scatter);
    let even = 1.0 / STRAYS.stray_range;
    let log_ratio = |r: f64| {
        let surface = (-0.5 * (r / scatter).powi(2)).exp() / (TAU.sqrt() * scatter);
        (((1.0 - STRAYS.odd) * surface + STRAYS.odd * even) / even).ln()
    };
    Ok(of(asked)?.into_iter().map(log_ratio).collect())
}

/// The logarithm of the distance to a near neighbour.
fn log_spacing(at: Vec3, tree: &Neighbours, found: &mut Vec<Neighbour>) -> f64 {
    tree.nearest(at, STRAYS.density_k + 1, found);
    found.last().map_or(0.0, |f| 0.5 * f.dist2.max(1e-300).ln())
}
