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
use crate::spatial::edges::Edges;
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
    let edges = Edges::new(&s.triangles, ctx)?;
    let mut step = ctx.filled(Vec3::ZERO, s.positions.len())?;
    let mut ring = ctx.filled(FAR, s.positions.len())?;
    for &(v, to) in targets {
        let v = v as usize;
        // Along the surface: across it the charts know better.
        let way = to - s.positions[v];
        step[v] = way - s.normals[v] * s.normals[v].dot(way);
        ring[v] = 0;
    }
    spread(&edges, &mut ring, &mut step, ctx)?;
    let moved: Vec<u32> = (0..).zip(&ring).filter(|(_, r)| **r != FAR).map(|(v, _)| v).collect();
    let before: Vec<(Vec3, Vec3)> =
        moved.iter().map(|&v| (s.positions[v as usize], s.normals[v as usize])).collect();
    let mut share = ctx.filled(1.0, s.positions.len())?;
    let around = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    let areas: Vec<Vec3> = s.triangles.iter().map(|t| area(s, t)).collect();
    // Where a triangle would turn over, its corners go half as far, until none does.
    loop {
        ctx.check()?;
        let placed: Vec<(Vec3, Vec3)> = (moved.par_iter().zip(&before))
            .map(|(&v, &at)| {
                let chart = charts.get(s.chart[v as usize] as usize);
                along(chart, at, step[v as usize] * share[v as usize])
            })
            .collect();
        for (&v, (p, n)) in moved.iter().zip(placed) {
            (s.positions[v as usize], s.normals[v as usize]) = (p, n);
        }
        let mut turned: Vec<u32> = (moved.iter().filter(|&&v| share[v as usize] > 0.0))
            .flat_map(|&v| around.of(v))
            .filter(|&&f| turns(s, f, &areas))
            .flat_map(|&f| s.triangles[f as usize])
            .collect();
        if turned.is_empty() {
            return Ok(());
        }
        turned.sort_unstable();
        turned.dedup();
        for v in turned {
            let share = &mut share[v as usize];
            *share = if *share > RIM.least_share { 0.5 * *share } else { 0.0 };
        }
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
fn spread(edges: &Edges, ring: &mut [u8], step: &mut [Vec3], ctx: &Context<'_>) -> Result<()> {
    for k in 1..=RIM.rings {
        for (i, edge) in edges.iter().enumerate() {
            ctx.check_at(i)?;
            let [a, b] = edge[0].ends().map(|v| v as usize);
            for (from, to) in [(a, b), (b, a)] {
                if usize::from(ring[from]) == k - 1 && ring[to] == FAR {
                    ring[to] = k as u8;
                }
            }
        }
    }
    let mut links: Vec<[u32; 2]> = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        let follows = |v: u32| (1..FAR).contains(&ring[v as usize]);
        links.extend([[a, b], [b, a]].into_iter().filter(|l| follows(l[0])));
    }
    let mut sum = ctx.filled((Vec3::ZERO, 0.0), ring.len())?;
    for _ in 0..RIM.sweeps {
        for (i, &[v, from]) in links.iter().enumerate() {
            ctx.check_at(i)?;
            let (total, count) = &mut sum[v as usize];
            *total += step[from as usize];
            *count += 1.0;
        }
        for (i, &[v, _]) in links.iter().enumerate() {
            ctx.check_at(i)?;
            let (total, count) = std::mem::take(&mut sum[v as usize]);
            if count > 0.0 {
                step[v as usize] = total * (1.0 / count);
            }
        }
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
