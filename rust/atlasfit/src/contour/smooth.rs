//! Vertices smoothed where no data carries them.
//!
//! In: a surface with its charts, and which vertices are free to move. Out: the same with those vertices, the
//! spikes that no chart asks for and those next to them smoothed (Taubin 1995), and their normals taken from
//! the triangles too. All others stay where the charts put them.

use super::constants::CONTOUR;
use super::surface::{Surface, corners};
use crate::atlas::Chart;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// Smooths vertices that no data carries: the free ones, those of spikes, and those next to them.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn smooth(
    s: &mut Surface,
    charts: &[Chart],
    mut free: Vec<bool>,
    ctx: &Context<'_>,
) -> Result<()> {
    let links = links_of_free(s, charts, &mut free, ctx)?;
    for step in CONTOUR.taubin.into_iter().cycle().take(2 * CONTOUR.sweeps) {
        sweep(&mut s.positions, &links, step, ctx)?;
    }
    mend_normals(s, &free, ctx)
}

/// A vertex that moves, and a neighbour that it moves towards.
pub(super) struct Link {
    pub(super) from: u32,
    pub(super) to: u32,
}

/// Adds spikes and the rings about free vertices to `free`, and gives the links that those move along.
/// Vertices of the boundary move along the boundary only.
fn links_of_free(s: &Surface, charts: &[Chart], free: &mut [bool], ctx: &Context<'_>) -> Result<Vec<Link>> {
    let normal = face_normals(s, ctx)?;
    let edges = Edges::new(&s.triangles, ctx)?;
    let mut rim = vec![false; s.positions.len()];
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        match edge {
            [x, y]
                if normal[x.face()].dot(normal[y.face()]) < CONTOUR.spike
                    && !x.runs_as(*y, &s.triangles)
                    && ![x, y].iter().all(|e| lies_on_chart(s, charts, e.face(), normal[e.face()])) =>
            {
                for v in x.ends() {
                    free[v as usize] = true;
                }
            }
            [x] => {
                for v in x.ends() {
                    rim[v as usize] = true;
                }
            }
            _ => {}
        }
    }
    for _ in 0..CONTOUR.spread {
        let core = free.to_vec();
        for (i, edge) in edges.iter().enumerate() {
            ctx.check_at(i)?;
            let [a, b] = edge[0].ends().map(|v| v as usize);
            free[a] |= core[b];
            free[b] |= core[a];
        }
    }
    let mut links = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        for (from, to) in [(a, b), (b, a)] {
            if free[from as usize] && (!rim[from as usize] || rim[to as usize]) {
                links.push(Link { from, to });
            }
        }
    }
    Ok(links)
}

/// Whether a triangle lies along one of its vertices' charts.
fn lies_on_chart(s: &Surface, charts: &[Chart], triangle: usize, normal: Vec3) -> bool {
    let t = &s.triangles[triangle];
    let [a, b, c] = corners(&s.positions, t);
    let middle = (a + b + c) * (1.0 / 3.0);
    t.iter().any(|&v| {
        let chart = charts.get(s.chart[v as usize] as usize);
        let view = chart.and_then(|chart| chart.view(middle));
        view.is_some_and(|view| view.normal.dot(normal).abs() > CONTOUR.one_side)
    })
}

/// The unit normal of every triangle.
fn face_normals(s: &Surface, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let normal = |t: &[u32; 3]| area_vector(corners(&s.positions, t)).normalized();
    let found = s
        .triangles
        .par_chunks(CONTOUR.check)
        .map(|chunk| {
            ctx.check()?;
            Ok(chunk.iter().map(normal).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.concat())
}

/// Moves every vertex with more than one link by a share of the way to the mean of those it is linked to.
pub(super) fn sweep(positions: &mut [Vec3], links: &[Link], step: f64, ctx: &Context<'_>) -> Result<()> {
    let mut sum = vec![(Vec3::ZERO, 0.0); positions.len()];
    for (i, link) in links.iter().enumerate() {
        ctx.check_at(i)?;
        let (total, count) = &mut sum[link.from as usize];
        *total += positions[link.to as usize];
        *count += 1.0;
    }
    for (p, (total, count)) in positions.iter_mut().zip(&sum) {
        if *count > 1.0 {
            *p = *p * (1.0 - step) + *total * (step / count);
        }
    }
    ctx.check()
}

/// The normals of free vertices, from charts and triangles alike; from the triangles alone where the surface
/// has left its charts.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn mend_normals(s: &mut Surface, free: &[bool], ctx: &Context<'_>) -> Result<()> {
    let mut sum = vec![Vec3::ZERO; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        if t.iter().any(|&v| free[v as usize]) {
            let n = area_vector(corners(&s.positions, t));
            for &v in t {
                sum[v as usize] += n;
            }
        }
    }
    for ((n, sum), _) in s.normals.iter_mut().zip(&sum).zip(free).filter(|x| *x.1) {
        if (*sum).norm() > 0.0 {
            let by_faces = (*sum).normalized();
            *n = if (*n).dot(by_faces) < CONTOUR.astray { by_faces } else { (*n + by_faces).normalized() };
        }
    }
    Ok(())
}
