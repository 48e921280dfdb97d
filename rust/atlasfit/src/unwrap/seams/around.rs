//! The faces about a piece of a cut: what gives way while all else is held.
//!
//! In: a layout and a path of edges. Out: the faces near it with numbers of their own, and their part of the
//! mean energy after some steps.

use super::constants::SEAMS;
use super::sheet::{Layout, Sheet};
use crate::run::Context;
use crate::unwrap::flatten::contacts::Border;
use crate::unwrap::flatten::newton::{Piece, Until, mean_energy, relax_piece};
use crate::unwrap::surface::NONE;

/// The faces about a path, with numbers of their own.
pub(super) struct Around {
    pub faces: Vec<u32>,
    inside: Vec<bool>,
    pub tris: Vec<[u32; 3]>,
    pub rest: Vec<[f64; 3]>,
    /// The layout's vertex of each.
    pub vertex: Vec<u32>,
    pub uv: Vec<[f64; 2]>,
    pub held: Vec<bool>,
    /// Edges of the whole border that may come near, and the inner edge of each; [`NONE`] where it has none.
    pub segments: Vec<([u32; 2], u32)>,
    /// How many of them are its own: the first ones.
    pub own: usize,
    /// Where vertices may go: no border outside comes in here.
    lo: [f64; 2],
    hi: [f64; 2],
}

impl Around {
    pub(super) fn new(sheet: &Sheet<'_>, now: &Layout, path: &[u32]) -> Self {
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
            own: 0,
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
                if glued(f, k).is_some_and(|g| !out.inside[g as usize]) {
                    [t[k], t[(k + 1) % 3]].into_iter().for_each(|v| out.held[v as usize] = true);
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
        let ends = |&(i, k): &(u32, u8)| {
            let (t, k) = (now.chart.tris[i as usize], usize::from(k));
            ([t[k], t[(k + 1) % 3]], sheet.edge[i as usize][k])
        };
        let (own, others): (Vec<_>, Vec<_>) = now.chart.border.iter().partition(|b| out.inside[b.0 as usize]);
        for (ends, e) in own.into_iter().map(ends) {
            let ends = ends.map(|v| out.number(v, now, &mut local));
            out.segments.push((ends, e));
        }
        out.own = out.segments.len();
        for (ends, e) in others.into_iter().map(ends) {
            let [p, q] = ends.map(|v| now.chart.uv[v as usize]);
            if (0..2).all(|k| p[k].min(q[k]) <= out.hi[k] && p[k].max(q[k]) >= out.lo[k]) {
                let ends = ends.map(|v| out.number(v, now, &mut local));
                out.segments.push((ends, e));
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

    /// Its part of the mean energy over an area.
    pub(super) fn energy(&self, area: f64) -> f64 {
        let own: f64 = self.rest.iter().map(|r| 0.5 * r[0] * r[2]).sum();
        mean_energy(&self.tris, &self.rest, &self.uv) * own / area
    }

    pub(super) fn border(&self) -> Border {
        Border::of(self.segments.iter().map(|s| s.0).collect())
    }

    /// Lowers its part of the mean energy over an area, and returns it. `None` where something moves out of
    /// the box, or when the run is to stop.
    pub(super) fn relaxed(&mut self, area: f64, steps: usize, ctx: &Context<'_>) -> Option<f64> {
        let until = Until { steps, least: SEAMS.least_near, wanted: None };
        let mut uv = std::mem::take(&mut self.uv);
        let Self { tris, rest, held, lo, hi, .. } = &*self;
        let stay: Vec<[bool; 2]> = held.iter().map(|&h| [h; 2]).collect();
        let piece = Piece { tris, rest, area, border: self.border(), held: &stay };
        let energy = relax_piece(&piece, &mut uv, until, ctx)?;
        let inside = |p: &[f64; 2]| (0..2).all(|k| lo[k] < p[k] && p[k] < hi[k]);
        let all = uv.iter().zip(held).all(|(p, &held)| held || inside(p));
        self.uv = uv;
        all.then_some(energy)
    }
}
