//! The mesh moved with its boundary.
//!
//! In: a surface, where vertices of its boundary belong, the charts. Out: the surface with its boundary
//! there, and the vertices near it moved along the surface, less the farther they are, so that triangles
//! keep their shape.

use super::constants::RIM;
use crate::atlas::Chart;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::lists::Lists;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// Stands for a vertex that no ring about the boundary holds.
const FAR: u8 = u8::MAX;

/// Moves vertices of the boundary to their `targets`, and those near by with them.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn follow(
    s: &mut Surface,
    targets: &[(u32, Vec3)],
    charts: &[Chart],
    ctx: &Context<'_>,
) -> Result<()> {
    let mut step = ctx.filled(Vec3::ZERO, s.positions.len())?;
    let mut ring = ctx.filled(FAR, s.positions.len())?;
    for &(v, to) in targets {
        let v = v as usize;
        // Along the surface: across it the charts know better.
        let way = to - s.positions[v];
        step[v] = way - s.normals[v] * s.normals[v].dot(way);
        ring[v] = 0;
    }
    let around = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    spread(s, &around, &mut ring, &mut step, ctx)?;
    let moves = |v: u32| ring[v as usize] != FAR;
    let areas: Vec<Vec3> = s.triangles.par_iter().map(|t| area(s, t)).collect();
    let mut changed: Vec<u32> = (0..s.positions.len() as u32).filter(|v| moves(*v)).collect();
    let before: Vec<(Vec3, Vec3)> =
        changed.iter().map(|&v| (s.positions[v as usize], s.normals[v as usize])).collect();
    let mut slot = ctx.filled(u32::MAX, s.positions.len())?;
    changed.iter().zip(0..).for_each(|(&v, k)| slot[v as usize] = k);
    let mut share = ctx.filled(1.0, s.positions.len())?;
    // Where a triangle would turn over, its corners go half as far, until none does.
    loop {
        ctx.check()?;
        let placed: Vec<(Vec3, Vec3)> = changed
            .par_iter()
            .map(|&v| {
                let v = v as usize;
                along(charts.get(s.chart[v] as usize), before[slot[v] as usize], step[v] * share[v])
            })
            .collect();
        for (&v, (p, n)) in changed.iter().zip(placed) {
            (s.positions[v as usize], s.normals[v as usize]) = (p, n);
        }
        let goes = |v: u32| moves(v) && share[v as usize] > 0.0;
        let mut turned: Vec<u32> = (changed.par_iter())
            .flat_map_iter(|&v| around.of(v))
            .filter(|&&f| s.triangles[f as usize].iter().any(|&v| goes(v)) && turns(s, f, &areas))
            .flat_map_iter(|&f| s.triangles[f as usize])
            .collect();
        if turned.is_empty() {
            return Ok(());
        }
        turned.sort_unstable();
        turned.dedup();
        for &v in &turned {
            let share = &mut share[v as usize];
            *share = if *share > RIM.least_share { 0.5 * *share } else { 0.0 };
        }
        turned.retain(|v| moves(*v));
        changed = turned;
    }
}

fn area(s: &Surface, t: &[u32; 3]) -> Vec3 {
    area_vector(t.map(|v| s.positions[v as usize]))
}

/// Whether a triangle has turned over.
fn turns(s: &Surface, f: u32, areas: &[Vec3]) -> bool {
    area(s, &s.triangles[f as usize]).dot(areas[f as usize]) <= 0.0
}

/// Spreads the steps of the boundary over the rings of vertices about it: each step is the mean of its
/// neighbours', none beyond the last ring.
fn spread(s: &Surface, around: &Lists, ring: &mut [u8], step: &mut [Vec3], ctx: &Context<'_>) -> Result<()> {
    let neighbours = |v: u32| around.of(v).iter().flat_map(|&f| s.triangles[f as usize]);
    let mut last: Vec<u32> = (0..).zip(&*ring).filter(|(_, r)| **r == 0).map(|(v, _)| v).collect();
    let mut follow: Vec<u32> = Vec::new();
    for k in 1..=RIM.rings {
        let mut next = Vec::new();
        for (i, &v) in last.iter().enumerate() {
            ctx.check_at(i)?;
            for w in neighbours(v) {
                if ring[w as usize] == FAR {
                    ring[w as usize] = k as u8;
                    next.push(w);
                }
            }
        }
        follow.extend(&next);
        last = next;
    }
    let of_each = follow.par_iter().map(|&v| {
        let mut own: Vec<u32> = neighbours(v).filter(|&w| w != v).collect();
        own.sort_unstable();
        own.dedup();
        own
    });
    let of_each: Vec<Vec<u32>> = of_each.collect();
    for _ in 0..RIM.sweeps {
        ctx.check()?;
        let mean = |own: &Vec<u32>| {
            let sum = own.iter().fold(Vec3::ZERO, |sum, &w| sum + step[w as usize]);
            sum * (1.0 / own.len() as f64)
        };
        let means: Vec<Vec3> = of_each.par_iter().map(mean).collect();
        follow.iter().zip(means).for_each(|(&v, mean)| step[v as usize] = mean);
    }
    Ok(())
}

/// A place on the surface and its normal, moved along its chart.
fn along(chart: Option<&Chart>, (at, normal): (Vec3, Vec3), step: Vec3) -> (Vec3, Vec3) {
    let to = at + step;
    let views = chart.and_then(|c| Some((c.view(at)?, c.view(to)?)));
    let Some((before, after)) = views else { return (to, normal) };
    // The blend of charts keeps its distance from this one.
    let sign = if before.normal.dot(normal) < 0.0 { -1.0 } else { 1.0 };
    let turned = (normal + (after.normal - before.normal) * sign).normalized();
    (to - after.normal * (after.distance - before.distance), turned)
}
