//! Whether points lie as densely as the surface about them.
//!
//! In: points, of which some lie on charts that stand. Out: how dense others are beside these, and the
//! evidence, in nats, that those of a chart belong to a surface as dense.

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
/// Densities of a chart that are tried in each standard deviation of the scatter.
const STEPS: i32 = 2;

/// How dense points are beside the surface about them.
pub(super) struct Densities {
    /// For each point that was asked for, the logarithm of its spacing over that of the surface there.
    pub relative: Vec<f64>,
    /// Standard deviation of the same on the surface.
    scatter: f64,
}

/// How dense the points `asked` are beside those that are `known`.
pub(super) fn relative(cut: &Cut<'_>, known: &[u32], asked: &[u32], ctx: &Context<'_>) -> Result<Densities> {
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
    let mut relative: Vec<f64> = own.iter().zip(&near).map(|(own, near)| own - median_of(near)).collect();
    let sampled = all.len() - asked.len();
    let mut off: Vec<f64> = relative[..sampled].iter().map(|r| r.abs()).collect();
    let scatter = (SCATTER_OF_MEDIAN * median(&mut off)).max(STRAYS.least_scatter);
    Ok(Densities { relative: relative.split_off(sampled), scatter })
}

impl Densities {
    /// The evidence that the points of a chart belong to the surface, from their `relative` spacings, of
    /// which each `counts` so much. They have one density, with the scatter of the surface about it: strays
    /// may have any, the surface that of its neighbours, or, at odd places, any too.
    pub(super) fn evidence(&self, relative: &[f64], counts: f64) -> f64 {
        let (s, range) = (self.scatter, STRAYS.stray_range);
        let normal = |x: f64| (-0.5 * (x / s).powi(2)).exp() / (TAU.sqrt() * s);
        let of_point = |x: f64| ((1.0 - STRAYS.odd) * normal(x) + STRAYS.odd / range).ln();
        let (mut surface, mut strays) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let steps = (range / s).ceil() as i32 * STEPS;
        for k in -steps..=steps {
            let at = f64::from(k) * s / f64::from(STEPS);
            let data = counts * relative.iter().map(|r| of_point(r - at)).sum::<f64>();
            surface = ln_sum(surface, data - 0.5 * (at / s).powi(2) - (TAU.sqrt() * s).ln());
            strays = ln_sum(strays, data - (2.0 * range).ln());
        }
        ((1.0 - STRAYS.odd) * (surface - strays).exp() + STRAYS.odd).ln()
    }
}

/// The logarithm of the sum of two numbers of which the logarithms are given.
fn ln_sum(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    if most == f64::NEG_INFINITY { most } else { most + ((a - most).exp() + (b - most).exp()).ln() }
}

/// What `of` says of each, in parallel.
pub(super) fn each<T: Send>(
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strays_share_one_density_so_that_many_say_little_more_than_one() {
        let densities = Densities { relative: Vec::new(), scatter: 0.25 };
        let [few, many] = [9, 900].map(|n| densities.evidence(&vec![0.0; n], 1.0 / 9.0));
        assert!(few > 0.5 && many > few && many < 4.0, "{few} {many}");
        let [near, far] = [1.0, 3.0].map(|r| densities.evidence(&vec![r; 90], 1.0 / 9.0));
        // Odd densities are rare, but surface may have them.
        assert!(near < 0.0 && far >= STRAYS.odd.ln() - 1e-9, "{near} {far}");
    }
}
