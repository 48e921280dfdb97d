//! Stacks of parallel planes, as a depth camera's rounding puts a scan's points on.
//!
//! In: points and their search tree. Out: the directions that planes are across, one for each view of a
//! merged scan, with the planes across them; how far apart the planes across one are at each point.

use super::constants::NOISE;
use crate::error::Result;
use crate::numeric::dense::principal;
use crate::numeric::sort::sort_by;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use rayon::prelude::*;

/// How far apart the planes across a direction are about each point; nothing where the points are not on such
/// planes.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn steps(points: &[Vec3], direction: Vec3, ctx: &Context<'_>) -> Result<Option<Vec<f64>>> {
    let order = along(points, direction, ctx)?;
    let extent = order.last().map_or(0.0, |l| l.0) - order.first().map_or(0.0, |f| f.0);
    let levels: Vec<&[(f64, u32)]> =
        order.chunk_by(|a, b| b.0 - a.0 <= NOISE.level_thickness * extent).collect();
    let crowded: usize = levels.iter().map(|l| l.len()).filter(|&n| n >= NOISE.points_a_level).sum();
    if levels.len() < NOISE.levels || 2 * crowded < points.len() {
        return Ok(None);
    }
    let between: Vec<f64> = levels.windows(2).map(|l| l[1][0].0 - l[0][l[0].len() - 1].0).collect();
    let mut steps = vec![0.0; points.len()];
    for (k, level) in levels.iter().enumerate() {
        ctx.check()?;
        // Levels that no point has make a step look double; the usual step about a level is its own.
        let step = usual_step(&between, k);
        level.iter().for_each(|&(_, i)| steps[i as usize] = step);
    }
    Ok(Some(steps))
}

/// Where the points are along a direction, in that order.
fn along(points: &[Vec3], direction: Vec3, ctx: &Context<'_>) -> Result<Vec<(f64, u32)>> {
    let mut order: Vec<(f64, u32)> = points.iter().map(|p| p.dot(direction)).zip(0..).collect();
    sort_by(&mut order, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)), ctx)?;
    Ok(order)
}

/// The usual one of the steps about a level.
pub(super) fn usual_step(steps: &[f64], level: usize) -> f64 {
    let near = level.saturating_sub(NOISE.steps_around)..(level + NOISE.steps_around).min(steps.len());
    median(&mut steps[near].to_vec())
}

/// The points on a plane of a stack, and where it is along the stack's direction.
pub(super) struct Level {
    pub at: f64,
    pub points: Vec<u32>,
}

/// The planes across a direction that many points are on, among points of other views that are not; none
/// where there are too few for a stack. In the order along it.
///
/// # Errors
/// Cancelled or out of time.
fn levels(points: &[Vec3], direction: Vec3, ctx: &Context<'_>) -> Result<Vec<Level>> {
    let order = along(points, direction, ctx)?;
    let thick = NOISE.level_thickness * Aabb::of(points).longest_side();
    let mut levels: Vec<Level> = Vec::new();
    let (mut from, mut end) = (0, 0);
    while from < order.len() {
        ctx.check_at(from)?;
        while end < order.len() && order[end].0 - order[from].0 <= thick {
            end += 1;
        }
        if end - from < NOISE.points_a_level {
            from += 1;
            continue;
        }
        let at = order[(from + end) / 2].0;
        let points = order[from..end].iter().map(|o| o.1);
        match levels.last_mut() {
            Some(last) if at - last.at <= 2.0 * thick => last.points.extend(points),
            _ => levels.push(Level { at, points: points.collect() }),
        }
        from = end;
    }
    Ok(if levels.len() < NOISE.levels_with_ends { Vec::new() } else { levels })
}

/// The planes that points are on.
pub(super) struct Stacks {
    /// The direction across which most neighbourhoods have a plane that some of their points are exactly on.
    pub most: Vec3,
    /// The directions that many such planes are across, with these.
    pub levels: Vec<(Vec3, Vec<Level>)>,
}

/// Looks for the directions that planes are across which points are exactly on; nothing where few
/// neighbourhoods have such planes.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn find(points: &[Vec3], tree: &Neighbours, ctx: &Context<'_>) -> Result<Option<Stacks>> {
    // Points within this of a plane are on it.
    let exact = NOISE.level_thickness * Aabb::of(points).longest_side();
    let apart = points.len().div_ceil(NOISE.planes).max(1);
    let seeds: Vec<usize> = (0..points.len()).step_by(apart).collect();
    let planes = |found: &mut Vec<Neighbour>, &seed: &usize| {
        ctx.check()?;
        tree.nearest(points[seed], NOISE.coplanar_among, found);
        let near: Vec<Vec3> = found.iter().map(|f| points[f.index as usize]).collect();
        Ok(exact_planes(&near, exact).into_iter().map(|n| (seed, n)).collect())
    };
    let planes: Vec<Vec<(usize, Vec3)>> =
        seeds.par_iter().map_init(Vec::new, planes).collect::<Result<_>>()?;
    let mut planes = planes.concat();
    let wider = |found: &mut Vec<Neighbour>, &&(seed, n): &&(usize, Vec3)| {
        widened(points, tree, seed, n, exact, found, ctx)
    };
    let mut stacks: Option<Stacks> = None;
    let mut without = 0;
    while without < NOISE.without_levels {
        ctx.check()?;
        // Rows of pixels lie on planes too, which all hold the camera: their normals differ.
        let shared: Vec<usize> =
            planes.par_iter().map(|a| planes.iter().filter(|b| same(a.1, b.1)).count()).collect();
        let most = (0..planes.len()).max_by_key(|&k| (shared[k], std::cmp::Reverse(k)));
        let least = if stacks.is_none() { NOISE.flat_share * seeds.len() as f64 } else { NOISE.agreeing };
        let Some(most) = most.filter(|&k| shared[k] as f64 >= least) else { break };
        let axis = planes[most].1;
        let (along, others): (Vec<_>, Vec<_>) = planes.into_iter().partition(|p| same(p.1, axis));
        let few = along.len().div_ceil(NOISE.widened).max(1);
        let sample: Vec<&(usize, Vec3)> = along.iter().step_by(few).collect();
        let wide: Vec<Vec3> = sample.par_iter().map_init(Vec::new, wider).collect::<Result<_>>()?;
        let wide: Vec<Vec3> = wide.into_iter().map(|n| n * n.dot(axis).signum()).collect();
        // Most agree to the last digit; the median leaves out those that do not.
        let middle = |k: usize| median(&mut wide.iter().map(|n| n[k]).collect::<Vec<_>>());
        let direction = Vec3([middle(0), middle(1), middle(2)]).normalized();
        let stacks = stacks.get_or_insert(Stacks { most: direction, levels: Vec::new() });
        let levels = levels(points, direction, ctx)?;
        if levels.is_empty() {
            without += 1;
        } else {
            stacks.levels.push((direction, levels));
        }
        planes = others;
    }
    Ok(stacks)
}

/// Whether two planes' normals are the same.
fn same(a: Vec3, b: Vec3) -> bool {
    a.dot(b).abs() > NOISE.along
}

/// The normals of the planes through the first of some points that more of the others are exactly on than by
/// chance.
fn exact_planes(near: &[Vec3], exact: f64) -> Vec<Vec3> {
    let mut planes: Vec<Vec3> = Vec::new();
    let Some((first, others)) = near.split_first() else { return planes };
    let from: Vec<Vec3> = others.iter().map(|&p| p - *first).collect();
    for (i, &a) in from.iter().enumerate() {
        for &b in &from[..i] {
            let across = a.cross(b);
            if across.norm2() < NOISE.slender * a.norm2() * b.norm2() {
                continue;
            }
            let n = across.normalized();
            let on = 1 + from.iter().filter(|d| d.dot(n).abs() <= exact).count();
            if on >= NOISE.coplanar && !planes.iter().any(|&p| same(p, n)) {
                planes.push(n);
            }
        }
    }
    planes
}

/// The normal of a plane through a point, known better from points on it farther and farther away.
fn widened(
    points: &[Vec3],
    tree: &Neighbours,
    seed: usize,
    mut normal: Vec3,
    exact: f64,
    found: &mut Vec<Neighbour>,
    ctx: &Context<'_>,
) -> Result<Vec3> {
    let origin = points[seed];
    tree.nearest(origin, NOISE.coplanar_among, found);
    let mut radius = found.last().map_or(0.0, |f| f.dist2.sqrt());
    for _ in 0..NOISE.widenings {
        ctx.check()?;
        if found.len() >= NOISE.largest.min(points.len()) {
            break;
        }
        radius *= NOISE.wider;
        tree.within(origin, radius, found);
        let on = found.iter().map(|f| points[f.index as usize]);
        let on = on.filter(|&p| (p - origin).dot(normal).abs() <= exact).map(|p| (p, 1.0));
        let plane = principal(on).filter(|s| s.variances[1] > NOISE.slender * s.variances[2]);
        normal = plane.map_or(normal, |s| s.axes[0] * s.axes[0].dot(normal).signum());
    }
    Ok(normal)
}
