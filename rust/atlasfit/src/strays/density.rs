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
    let step = known.len().div_ceil(STRAYS.scatter_samples).max(1);
    let sample = known.iter().step_by(step);
    let all: Vec<u32> = sample.chain(asked).copied().collect();
    // The known points about each. Most are about several: their spacing is looked at once.
    let near: Vec<Vec<u32>> = each(&all, ctx, |i, found| {
        around.nearest(points[i as usize], STRAYS.around, found);
        found.iter().map(|f| f.index).collect()
    })?;
    let mut wanted = vec![false; known.len()];
    near.iter().flatten().for_each(|&k| wanted[k as usize] = true);
    let wanted: Vec<u32> = (0..known.len() as u32).filter(|&k| wanted[k as usize]).collect();
    let mut usual = vec![0.0; known.len()];
    let spacings = each(&wanted, ctx, |k, found| log_spacing(places[k as usize], tree, found))?;
    wanted.iter().zip(spacings).for_each(|(&k, s)| usual[k as usize] = s);
    // The logarithm of the spacing at a point, less the median of the known ones about it.
    let own = each(&all, ctx, |i, found| log_spacing(points[i as usize], tree, found))?;
    let median_of = |near: &[u32]| median(&mut near.iter().map(|&k| usual[k as usize]).collect::<Vec<_>>());
    let relative: Vec<f64> = own.iter().zip(&near).map(|(own, near)| own - median_of(near)).collect();
    let (sample, asked) = relative.split_at(all.len() - asked.len());
    let mut off: Vec<f64> = sample.iter().map(|r| r.abs()).collect();
    let scatter = (SCATTER_OF_MEDIAN * median(&mut off)).max(STRAYS.least_scatter);
    let even = 1.0 / STRAYS.stray_range;
    let log_ratio = |r: f64| {
        let surface = (-0.5 * (r / scatter).powi(2)).exp() / (TAU.sqrt() * scatter);
        (((1.0 - STRAYS.odd) * surface + STRAYS.odd * even) / even).ln()
    };
    Ok(asked.iter().copied().map(log_ratio).collect())
}

/// What `of` says of each, in parallel.
fn each<T: Send>(
    all: &[u32],
    ctx: &Context<'_>,
    of: impl Fn(u32, &mut Vec<Neighbour>) -> T + Sync,
) -> Result<Vec<T>> {
    let chunks: Vec<Vec<T>> = all
        .par_chunks(64)
        .map(|chunk| {
            ctx.check()?;
            let mut found = Vec::new();
            Ok(chunk.iter().map(|&i| of(i, &mut found)).collect())
        })
        .collect::<Result<_>>()?;
    Ok(chunks.into_iter().flatten().collect())
}

/// The logarithm of the distance to a near neighbour.
fn log_spacing(at: Vec3, tree: &Neighbours, found: &mut Vec<Neighbour>) -> f64 {
    tree.nearest(at, STRAYS.density_k + 1, found);
    found.last().map_or(0.0, |f| 0.5 * f.dist2.max(1e-300).ln())
}
