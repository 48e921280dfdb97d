//! A piece of a cut is closed, and only what is near gives way.
//!
//! In: a layout, and cut edges from a loose end inward. Out: the positions of what moved, and what the mean
//! energy comes to; on demand the layout after that.

use super::around::Around;
use super::constants::SEAMS;
use super::sheet::{Layout, Sheet};
use crate::run::Context;
use crate::spatial::inject::turns_once;
use crate::unwrap::flatten::newton::mean_energy;
use crate::unwrap::flatten::shape::all_positive;

/// A piece of a cut, closed.
pub(super) struct Closed {
    path: Vec<u32>,
    /// Positions of the layout's vertices that moved.
    moved: Vec<(u32, [f64; 2])>,
    /// Mean energy of the whole.
    pub energy: f64,
    /// Length of what is cut still.
    pub length: f64,
}

impl Closed {
    /// The layout with the piece closed.
    pub(super) fn layout(&self, sheet: &Sheet<'_>, old: &Layout, ctx: &Context<'_>) -> Option<Layout> {
        let mut cut = old.cut.clone();
        self.path.iter().for_each(|&e| cut[e as usize] = false);
        let mut at = old.chart.uv.clone();
        self.moved.iter().for_each(|&(v, p)| at[v as usize] = p);
        let mut chart = sheet.glued(&cut, ctx)?;
        for (t, o) in chart.tris.iter().zip(&old.chart.tris) {
            for (&v, &o) in t.iter().zip(o) {
                chart.uv[v as usize] = at[o as usize];
            }
        }
        let energy = mean_energy(&chart.tris, &sheet.rest, &chart.uv);
        let length = sheet.cut_length(&cut);
        Some(Layout { cut, chart, energy, length })
    }
}

impl Around {
    /// Joins the sides of an edge; whether no triangle turns over and the border stays off itself.
    fn join(&mut self, sheet: &Sheet<'_>, e: u32, same: &mut [u32], ctx: &Context<'_>) -> bool {
        let [f, g] = sheet.sides(e);
        let [Some(i), Some(j)] = [f, g].map(|f| self.faces.iter().position(|&x| x == f)) else {
            return false;
        };
        let slot = |f: u32| (0..3).find(|&k| sheet.edge[f as usize][k] == e).unwrap_or(0);
        let (k, l) = (slot(f), slot(g));
        let (t, u) = (self.tris[i], self.tris[j]);
        let pairs = [[t[k], u[(l + 1) % 3]], [t[(k + 1) % 3], u[l]]];
        let open: Vec<[u32; 2]> = pairs.into_iter().filter(|p| p[0] != p[1]).collect();
        if open.iter().flatten().any(|&v| self.held[v as usize]) {
            return false;
        }
        for &[v, w] in &open {
            same.iter_mut().filter(|s| **s == w).for_each(|s| *s = v);
            let rename = |x: &mut u32| {
                if *x == w {
                    *x = v;
                }
            };
            self.tris.iter_mut().flatten().for_each(rename);
            self.segments.iter_mut().flat_map(|s| &mut s.0).for_each(rename);
        }
        self.segments.retain(|s| s.1 != e);
        let was = self.uv.clone();
        [0.5, 0.25, 0.75, 0.05, 0.95].into_iter().any(|share| {
            for &[v, w] in &open {
                let [a, b] = [v, w].map(|x| was[x as usize]);
                self.uv[v as usize] = [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
            }
            all_positive(&self.tris, &self.uv)
        }) && turns_once(&self.tris, &self.uv, &self.held, ctx).is_ok_and(|once| once)
            && self.border().touches(&self.uv, ctx).is_ok_and(|touches| !touches)
    }
}

/// A piece of a cut closed, edge by edge: the two sides of a long piece lie too far apart. `None` where
/// triangles would turn over, or when the run is to stop.
pub(super) fn closed(sheet: &Sheet<'_>, now: &Layout, path: &[u32], ctx: &Context<'_>) -> Option<Closed> {
    let mut around = Around::new(sheet, now, path);
    // The vertex that each became part of.
    let mut same: Vec<u32> = (0..around.vertex.len() as u32).collect();
    let before = around.energy(sheet.area);
    let mut after = before;
    for (i, &e) in path.iter().enumerate() {
        ctx.check().ok()?;
        if !around.join(sheet, e, &mut same, ctx) {
            return None;
        }
        let steps = if i + 1 == path.len() { SEAMS.trial_steps } else { 1 };
        after = around.relaxed(sheet.area, steps, ctx)?;
    }
    let moved = (around.vertex.iter().zip(&same))
        .zip(&around.held)
        .filter(|v| !v.1)
        .map(|((&v, &own), _)| (v, around.uv[own as usize]))
        .collect();
    let length = now.length - path.iter().map(|&e| sheet.length[e as usize]).sum::<f64>();
    let energy = now.energy + after - before;
    energy.is_finite().then(|| Closed { path: path.to_vec(), moved, energy, length })
}
