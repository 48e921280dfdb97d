//! A piece of a cut is closed, and only what is near gives way.
//!
//! In: a layout, and cut edges from a loose end inward. Out: the positions of what moved, and what the mean
//! energy comes to; on demand the layout after that.

use super::constants::SEAMS;
use super::sheet::{Layout, Sheet};
use crate::run::Context;
use crate::spatial::inject::turns_once;
use crate::unwrap::flatten::contacts::Border;
use crate::unwrap::flatten::newton::{Piece, Until, mean_energy, relax_piece};
use crate::unwrap::flatten::shape::all_positive;
use crate::unwrap::surface::NONE;

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

/// The faces about a path, with numbers of their own.
struct Around {
    faces: Vec<u32>,
    inside: Vec<bool>,
    tris: Vec<[u32; 3]>,
    rest: Vec<[f64; 3]>,
    /// The layout's vertex of each.
    vertex: Vec<u32>,
    uv: Vec<[f64; 2]>,
    held: Vec<bool>,
    /// Edges of the whole border that may come near, and the inner edge of each; [`NONE`] where it has none.
    segments: Vec<([u32; 2], u32)>,
    /// Where vertices may go: no border outside comes in here.
    lo: [f64; 2],
    hi: [f64; 2],
}

impl Around {
    fn new(sheet: &Sheet<'_>, now: &Layout, path: &[u32]) -> Self {
        let most = SEAMS.near + SEAMS.near_edge * path.len();
        let mut inside = vec![false; sheet.faces.len()];
        let mut faces: Vec<u32> = Vec::with_capacity(most);
        let mut enter = |f: u32, faces: &mut Vec<u32>| {
            if !std::mem::replace(&mut inside[f as usize], true) {
                faces.push(f);
            }
        };
        for &e in path {
            sheet.sides(e).into_iter().for_each(|f| enter(f, &mut faces));
        }
        let glued = |f: u32, k: usize| {
            let g = sheet.across[f as usize][k];
            (g != NONE && !now.cut[sheet.edge[f as usize][k] as usize]).then_some(g)
        };
        let mut next = 0;
        while next < faces.len() && faces.len() < most {
            let f = faces[next];
            (0..3).filter_map(|k| glued(f, k)).for_each(|g| enter(g, &mut faces));
            next += 1;
        }
        let mut out = Self {
            inside,
            tris: Vec::new(),
            rest: faces.iter().map(|&f| sheet.rest[f as usize]).collect(),
            faces,
            vertex: Vec::new(),
            uv: Vec::new(),
            held: Vec::new(),
            segments: Vec::new(),
            lo: [f64::INFINITY; 2],
            hi: [f64::NEG_INFINITY; 2],
        };
        let mut local = vec![NONE; now.chart.vertices()];
        for i in 0..out.faces.len() {
            let t = now.chart.tris[out.faces[i] as usize].map(|v| out.number(v, now, &mut local));
            out.tris.push(t);
        }
        out.held = vec![false; out.vertex.len()];
        for (&f, t) in out.faces.iter().zip(&out.tris) {
            for k in 0..3 {
                match glued(f, k) {
                    Some(g) if !out.inside[g as usize] => {
                        [t[k], t[(k + 1) % 3]].into_iter().for_each(|v| out.held[v as usize] = true);
                    }
                    _ => (),
                }
            }
        }
        for p in &out.uv {
            for k in 0..2 {
                out.lo[k] = out.lo[k].min(p[k]);
                out.hi[k] = out.hi[k].max(p[k]);
            }
        }
        let margin = SEAMS.margin * (out.hi[0] - out.lo[0]).hypot(out.hi[1] - out.lo[1]);
        for k in 0..2 {
            out.lo[k] -= margin;
            out.hi[k] += margin;
        }
        for &(i, k) in &now.chart.border {
            let (t, k) = (now.chart.tris[i as usize], usize::from(k));
            let ends = [t[k], t[(k + 1) % 3]];
            let [p, q] = ends.map(|v| now.chart.uv[v as usize]);
            let meets = |k: usize| p[k].min(q[k]) <= out.hi[k] && p[k].max(q[k]) >= out.lo[k];
            if out.inside[i as usize] || meets(0) && meets(1) {
                let ends = ends.map(|v| out.number(v, now, &mut local));
                out.segments.push((ends, sheet.edge[i as usize][k]));
            }
        }
        out.held.resize(out.vertex.len(), true);
        out
    }

    /// The own number of one of the layout's vertices.
    fn number(&mut self, v: u32, now: &Layout, local: &mut [u32]) -> u32 {
        let own = &mut local[v as usize];
        if *own == NONE {
            *own = self.vertex.len() as u32;
            self.vertex.push(v);
            self.uv.push(now.chart.uv[v as usize]);
        }
        *own
    }

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

    /// Its part of the mean energy over an area.
    fn energy(&self, area: f64) -> f64 {
        let own: f64 = self.rest.iter().map(|r| 0.5 * r[0] * r[2]).sum();
        mean_energy(&self.tris, &self.rest, &self.uv) * own / area
    }

    fn border(&self) -> Border {
        Border::of(self.segments.iter().map(|s| s.0).collect())
    }
}

/// A piece of a cut closed, edge by edge: the two sides of a long piece lie too far apart. `None` where
/// triangles would turn over, or when the run is to stop.
pub(super) fn closed(sheet: &Sheet<'_>, now: &Layout, path: &[u32], ctx: &Context<'_>) -> Option<Closed> {
    let mut around = Around::new(sheet, now, path);
    // The vertex that each became part of.
    let mut same: Vec<u32> = (0..around.vertex.len() as u32).collect();
    let area = sheet.area;
    let before: f64 = around.energy(area);
    let mut after = before;
    for (i, &e) in path.iter().enumerate() {
        ctx.check().ok()?;
        if !around.join(sheet, e, &mut same, ctx) {
            return None;
        }
        let steps = if i + 1 == path.len() { SEAMS.trial_steps } else { 1 };
        let until = Until { steps, least: SEAMS.least_near, wanted: None };
        let mut uv = std::mem::take(&mut around.uv);
        let Around { tris, rest, held, .. } = &around;
        after = relax_piece(&Piece { tris, rest, area, border: around.border(), held }, &mut uv, until, ctx)?;
        around.uv = uv;
        let out = |(p, held): (&[f64; 2], &bool)| !held && (0..2).any(|k| p[k] < around.lo[k] || p[k] > around.hi[k]);
        if around.uv.iter().zip(&around.held).any(out) {
            return None;
        }
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
