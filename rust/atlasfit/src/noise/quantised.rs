//! Depth in steps: whether a scan's points lie on a stack of parallel planes, as a depth camera's rounding
//! puts them.
//!
//! In: points and their search tree. Out: the standard deviation of the rounding at each point, a step over
//! the root of twelve. Steps are wider than neighbourhoods, so that these look like clean planes: an
//! estimate from neighbourhoods finds no noise, and the surface becomes stairs.

use super::constants::NOISE;
use crate::error::Result;
use crate::numeric::dense::principal;
use crate::numeric::sort::sort_by;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use rayon::prelude::*;

/// The rounding of each point, standard deviation; nothing where the points are not on a stack of planes.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn rounding(points: &[Vec3], tree: &Neighbours, ctx: &Context<'_>) -> Result<Option<Vec<f32>>> {
    let Some(direction) = common_normal(points, tree, ctx)? else { return Ok(None) };
    let mut order: Vec<(f64, u32)> = points.iter().map(|p| p.dot(direction)).zip(0..).collect();
    sort_by(&mut order, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)), ctx)?;
    let extent = order.last().map_or(0.0, |l| l.0) - order.first().map_or(0.0, |f| f.0);
    let levels: Vec<&[(f64, u32)]> =
        order.chunk_by(|a, b| b.0 - a.0 <= NOISE.level_thickness * extent).collect();
    if levels.len() < NOISE.levels || points.len() < NOISE.points_a_level * levels.len() {
        return Ok(None);
    }
    let steps: Vec<f64> = levels.windows(2).map(|l| l[1][0].0 - l[0][l[0].len() - 1].0).collect();
    let mut sigma = vec![0f32; points.len()];
    for (k, level) in levels.iter().enumerate() {
        ctx.check()?;
        // Levels that no point has make a step look double; the usual step about a level is its own.
        let near = k.saturating_sub(NOISE.steps_around)..(k + NOISE.steps_around).min(steps.len());
        let step = median(&mut steps[near].to_vec());
        level.iter().for_each(|&(_, i)| sigma[i as usize] = (step / 12f64.sqrt()) as f32);
    }
    Ok(Some(sigma))
}

/// The normal that nearly all neighbourhoods have that are flat to the last digit, if there are such.
fn common_normal(points: &[Vec3], tree: &Neighbours, ctx: &Context<'_>) -> Result<Option<Vec3>> {
    let step = points.len().div_ceil(NOISE.samples).max(1);
    let seeds: Vec<usize> = (0..points.len()).step_by(step).collect();
    let normals: Vec<Vec3> = seeds
        .par_iter()
        .map(|&i| {
            ctx.check()?;
            let mut found = Vec::new();
            tree.nearest(points[i], NOISE.scales[0].0, &mut found);
            let spread = principal(found.iter().map(|f| (points[f.index as usize], 1.0)));
            Ok(spread
                .filter(|s| s.variances[0] <= NOISE.exactly_flat.powi(2) * s.variances[1])
                .map(|s| s.axes[0]))
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    if (normals.len() as f64) < NOISE.flat_share * seeds.len() as f64 {
        return Ok(None);
    }
    // The mean axis: the first principal direction of the normals and their opposites.
    let both = normals.iter().flat_map(|&n| [(n, 1.0), (-n, 1.0)]);
    let Some(axis) = principal(both).map(|s| s.axes[2]) else { return Ok(None) };
    let along: Vec<Vec3> = normals
        .iter()
        .filter(|n| n.dot(axis).abs() > NOISE.along)
        .map(|&n| n * n.dot(axis).signum())
        .collect();
    if (along.len() as f64) < NOISE.flat_along * normals.len() as f64 {
        return Ok(None);
    }
    // Most agree to the last digit; the median leaves out those that do not.
    let middle = |k: usize| median(&mut along.iter().map(|n| n[k]).collect::<Vec<_>>());
    Ok(Some(Vec3([middle(0), middle(1), middle(2)]).normalized()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use crate::run::Run;

    fn of(points: &[Vec3]) -> Option<Vec<f32>> {
        Run::default()
            .execute(|ctx| {
                let tree = Neighbours::build(points, ctx)?;
                rounding(points, &tree, ctx)
            })
            .unwrap()
    }
    /// A slanted wavy sheet seen along `axis`, its depth rounded to `step` if there is one.
    fn sheet(axis: Vec3, step: Option<f64>) -> Vec<Vec3> {
        let (u, v) = axis.tangents();
        let mut rng = Rng::new(5);
        (0..8000)
            .map(|_| {
                let (x, y) = (rng.uniform(), rng.uniform());
                let z = 0.5 * x + 0.1 * (5.0 * y).sin();
                let z = step.map_or(z, |s| (z / s).round() * s);
                u * x + v * y + axis * z
            })
            .collect()
    }

    #[test]
    fn rounded_depth_is_known_by_its_step_whatever_the_direction() {
        for axis in [Vec3([0.0, 0.0, 1.0]), Vec3([0.3, -0.5, 0.8]).normalized()] {
            let sigma = of(&sheet(axis, Some(0.02))).expect("rounded");
            let expected = 0.02 / 12f64.sqrt();
            assert!(sigma.iter().all(|&s| (f64::from(s) / expected - 1.0).abs() < 0.01), "{axis:?}");
        }
    }
    #[test]
    fn clean_sheets_and_boxes_are_not_rounded() {
        assert!(of(&sheet(Vec3([0.3, -0.5, 0.8]).normalized(), None)).is_none());
        let mut rng = Rng::new(6);
        let cube: Vec<Vec3> = (0..6000)
            .map(|i| {
                let mut p = Vec3::from_fn(|_| rng.uniform());
                p.0[i % 3] = f64::from(i as u32 / 3 % 2);
                p
            })
            .collect();
        assert!(of(&cube).is_none());
    }
}
