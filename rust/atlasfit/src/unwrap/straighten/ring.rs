//! Rings cut open.
//!
//! In: a chart with two border curves. Out: the same, cut along the shortest path of edges from one to the
//! other, and where its four corners are.

use super::border::loops;
use super::constants::STRAIGHT;
use crate::run::Context;
use crate::spatial::paths::{Step, shortest};
use crate::unwrap::chart::Chart;
use crate::unwrap::cut::adjacent_faces;
use crate::unwrap::surface::{NONE, Surface};

/// A ring that is cut.
pub(super) struct Open {
    pub chart: Chart,
    pub border: Vec<u32>,
    /// Places on the border: both sides of both ends of the cut.
    pub corners: [usize; 4],
}

/// Cuts a ring; `None` where that makes no disk, or when the run is to stop: the caller checks.
pub(super) fn opened(s: &Surface, c: &Chart, curves: [&[u32]; 2], ctx: &Context<'_>) -> Option<Open> {
    let adjacent = adjacent_faces(s, c, ctx).ok()?;
    let path = across(s, c, curves, &adjacent, ctx)?;
    let mut place = vec![NONE; c.vertices()];
    path.iter().enumerate().for_each(|(i, &v)| place[v as usize] = i as u32);
    let is_cut = |i: usize, k: usize| {
        let [a, b] = [k, (k + 1) % 3].map(|k| place[c.tris[i][k] as usize]);
        a != NONE && b != NONE && a.abs_diff(b) == 1
    };
    let glued = |i: usize, _, k: usize| Some(adjacent[i][k]).filter(|&j| j != NONE && !is_cut(i, k));
    let mut chart = Chart::glue(s, c.faces.clone(), glued, ctx)?;
    let mut old = vec![NONE; chart.vertices()];
    for (t, of) in chart.tris.iter().zip(&c.tris) {
        for (&v, &of) in t.iter().zip(of) {
            chart.uv[v as usize] = c.uv[of as usize];
            old[v as usize] = of;
        }
    }
    chart.over = c.over;
    let mut all = loops(&chart)?;
    let border = all.pop().filter(|_| all.is_empty())?;
    let ends = [path[0], path[path.len() - 1]];
    let corners: Vec<usize> =
        (0..border.len()).filter(|&i| ends.contains(&old[border[i] as usize])).collect();
    Some(Open { chart, border, corners: corners.try_into().ok()? })
}

/// The shortest path from one curve to the other, through no polygon.
fn across(
    s: &Surface,
    c: &Chart,
    [from, to]: [&[u32]; 2],
    adjacent: &[[u32; 3]],
    ctx: &Context<'_>,
) -> Option<Vec<u32>> {
    let n = c.vertices();
    let mut edges: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
    let grain = STRAIGHT.grain * c.area.sqrt();
    for (i, t) in c.tris.iter().enumerate() {
        ctx.check_at(i).ok()?;
        let f = c.faces[i];
        for k in (0..3).filter(|&k| adjacent[i][k] != NONE) {
            if s.cell(f) == s.cell(c.faces[adjacent[i][k] as usize]) {
                continue;
            }
            let grains = (f64::from(s.length[f as usize][k]) / grain).round() + 1.0;
            edges[t[k] as usize].push((t[(k + 1) % 3], grains));
        }
    }
    let mut is_end = vec![false; n];
    to.iter().for_each(|&v| is_end[v as usize] = true);
    let steps = |v: u32| edges[v as usize].iter().map(move |&(to, length)| Step { to, length, by: v });
    let found = shortest(n, from.iter().copied(), steps, |v| is_end[v as usize], ctx).ok()?;
    let before = |v: &u32| Some(found.by[*v as usize]).filter(|&v| v != NONE);
    Some(std::iter::successors(Some(found.end?), before).collect())
}
