//! A connected part of a surface, and a way to cut and flatten it.
//!
//! In: faces of a surface. Out: its edges and vertices with numbers of its own; charts for a choice of edges
//! that are cut.

use super::constants::SEAMS;
use crate::error::Result;
use crate::numeric::plane::corners;
use crate::run::Context;
use crate::spatial::inject::injective;
use crate::spatial::paths::{Step, shortest};
use crate::unwrap::chart::Chart;
use crate::unwrap::flatten::dirichlet::{Disk, convex};
use crate::unwrap::flatten::newton::{Until, dirichlet, relax};
use crate::unwrap::flatten::shape::{all_positive, cotangents};
use crate::unwrap::surface::{NONE, Surface};
use rustc_hash::FxHashMap;

/// A connected part of a surface.
pub(super) struct Sheet<'a> {
    pub s: &'a Surface,
    pub faces: Vec<u32>,
    /// Rest shapes of the faces.
    pub rest: Vec<[f64; 3]>,
    /// Area of all of them.
    pub area: f64,
    /// Vertices of the faces, uncut.
    pub tris: Vec<[u32; 3]>,
    /// The surface's vertex of each.
    pub vertex: Vec<u32>,
    /// Face beyond each edge of a face; [`NONE`] at the border.
    pub across: Vec<[u32; 3]>,
    /// Number of each face's inner edges; [`NONE`] at the border.
    pub edge: Vec<[u32; 3]>,
    /// The two ends, the length (more for one inside a polygon) and a half-edge `3 * face + slot` of each
    /// inner edge.
    pub ends: Vec<[u32; 2]>,
    pub length: Vec<f64>,
    pub half: Vec<u32>,
    /// Inner edges at each vertex: `near[start[v]..start[v + 1]]`.
    start: Vec<u32>,
    near: Vec<u32>,
    /// Whether a vertex lies on the border.
    pub rim: Vec<bool>,
}

/// A sheet cut and laid flat.
#[derive(Clone)]
pub(super) struct Layout {
    /// Per inner edge.
    pub cut: Vec<bool>,
    pub chart: Chart,
    /// Mean energy by area.
    pub energy: f64,
    /// Length of what is cut.
    pub length: f64,
}

impl<'a> Sheet<'a> {
    /// The sheet of some connected faces. `None` where it has no inner edge.
    pub(super) fn new(s: &'a Surface, faces: Vec<u32>, ctx: &Context<'_>) -> Result<Option<Self>> {
        let place: FxHashMap<u32, u32> = faces.iter().enumerate().map(|(i, &f)| (f, i as u32)).collect();
        ctx.check()?;
        let beyond = |f: u32, k: usize| place.get(&(s.twin[f as usize][k] / 3)).copied();
        let across: Vec<[u32; 3]> =
            (faces.iter()).map(|&f| [0, 1, 2].map(|k| beyond(f, k).unwrap_or(NONE))).collect();
        ctx.check()?;
        let glue = |i: usize, _, k: usize| (across[i][k] != NONE).then(|| across[i][k]);
        let Some(base) = Chart::glue(s, faces.clone(), glue, ctx) else {
            ctx.check()?;
            return Ok(None);
        };
        let n = base.vertices();
        let mut vertex = vec![0; n];
        let mut rim = vec![false; n];
        let (mut ends, mut length, mut half) = (Vec::new(), Vec::new(), Vec::new());
        let mut edge = vec![[NONE; 3]; faces.len()];
        for (i, (&f, t)) in faces.iter().zip(&base.tris).enumerate() {
            ctx.check_at(i)?;
            for k in 0..3 {
                vertex[t[k] as usize] = s.tri[f as usize][k];
                let (a, b) = (t[k], t[(k + 1) % 3]);
                let j = across[i][k];
                if j == NONE {
                    rim[a as usize] = true;
                    rim[b as usize] = true;
                } else if edge[i][k] == NONE {
                    edge[i][k] = ends.len() as u32;
                    edge[j as usize][s.twin[f as usize][k] as usize % 3] = ends.len() as u32;
                    ends.push([a, b]);
                    let within = s.cell(f) == s.cell(faces[j as usize]);
                    let price = if within { SEAMS.within_polygon } else { 1.0 };
                    length.push(price * s.cost(f as usize, k));
                    half.push((3 * i + k) as u32);
                }
            }
        }
        let mut start = vec![0u32; n + 1];
        ends.iter().flatten().for_each(|&v| start[v as usize + 1] += 1);
        (0..n).for_each(|v| start[v + 1] += start[v]);
        let (mut fill, mut near) = (start.clone(), vec![0u32; 2 * ends.len()]);
        for (e, v) in ends.iter().enumerate().flat_map(|(e, ends)| ends.map(|v| (e, v as usize))) {
            near[fill[v] as usize] = e as u32;
            fill[v] += 1;
        }
        let rest = base.rest(s);
        let some = !ends.is_empty();
        let tris = base.tris;
        let area = rest.iter().map(|r| 0.5 * r[0] * r[2]).sum();
        let out =
            Self { s, faces, rest, area, tris, vertex, across, edge, ends, length, half, start, near, rim };
        Ok(some.then_some(out))
    }

    /// Number of vertices, uncut.
    pub(super) fn vertices(&self) -> usize {
        self.vertex.len()
    }

    /// Inner edges at a vertex.
    pub(super) fn near(&self, v: u32) -> &[u32] {
        &self.near[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }

    /// The end of an edge that is not `v`.
    pub(super) fn other(&self, e: u32, v: u32) -> u32 {
        let [a, b] = self.ends[e as usize];
        if a == v { b } else { a }
    }

    /// The two faces of an inner edge.
    pub(super) fn sides(&self, e: u32) -> [u32; 2] {
        let h = self.half[e as usize] as usize;
        [h as u32 / 3, self.across[h / 3][h % 3]]
    }

    /// Length of what is cut.
    pub(super) fn cut_length(&self, cut: &[bool]) -> f64 {
        cut.iter().zip(&self.length).filter(|c| *c.0).map(|c| c.1).sum()
    }

    /// Per vertex, whether it lies on the border or on a cut.
    pub(super) fn opened(&self, cut: &[bool]) -> Vec<bool> {
        let mut on = self.rim.clone();
        for (ends, _) in self.ends.iter().zip(cut).filter(|e| *e.1) {
            ends.iter().for_each(|&v| on[v as usize] = true);
        }
        on
    }

    /// Number of cut edges at a vertex.
    pub(super) fn cuts_at(&self, v: u32, cut: &[bool]) -> usize {
        self.near(v).iter().filter(|&&e| cut[e as usize]).count()
    }

    /// Its chart with a cut, all positions zero.
    pub(super) fn glued(&self, cut: &[bool], ctx: &Context<'_>) -> Option<Chart> {
        let across = |i: usize, _, k: usize| {
            let j = self.across[i][k];
            (j != NONE && !cut[self.edge[i][k] as usize]).then_some(j)
        };
        Chart::glue(self.s, self.faces.clone(), across, ctx)
    }

    fn relaxed(&self, cut: Vec<bool>, chart: Chart, steps: usize, ctx: &Context<'_>) -> Option<Layout> {
        self.until(cut, chart, Until { steps, least: SEAMS.least, wanted: None }, ctx)
    }

    /// Lowers the energy of a chart of this cut.
    pub(super) fn until(
        &self,
        cut: Vec<bool>,
        mut chart: Chart,
        until: Until,
        ctx: &Context<'_>,
    ) -> Option<Layout> {
        let disk =
            Disk { tris: &chart.tris, rest: &self.rest, border: &chart.border, vertices: chart.vertices() };
        let energy = relax(&disk, &mut chart.uv, until, ctx)?;
        let length = self.cut_length(&cut);
        energy.is_finite().then_some(Layout { cut, chart, energy, length })
    }

    /// Flattens it anew. `None` where it is no disk, or when the run is to stop.
    pub(super) fn fresh(&self, cut: Vec<bool>, ctx: &Context<'_>) -> Option<Layout> {
        let mut chart = self.glued(&cut, ctx)?;
        let disk =
            Disk { tris: &chart.tris, rest: &self.rest, border: &chart.border, vertices: chart.vertices() };
        chart.uv = convex(&disk, &cotangents(&self.rest), ctx)?;
        self.relaxed(cut, chart, SEAMS.first_steps, ctx)
    }

    /// Flattens it from the positions of another cut. `None` where triangles would turn over, or when the run
    /// is to stop.
    pub(super) fn from(
        &self,
        old: &Layout,
        cut: Vec<bool>,
        steps: usize,
        ctx: &Context<'_>,
    ) -> Option<Layout> {
        let mut chart = self.glued(&cut, ctx)?;
        // The positions that each vertex had: one, or two that become one.
        let mut had: Vec<[u32; 2]> = vec![[NONE; 2]; chart.vertices()];
        for (t, o) in chart.tris.iter().zip(&old.chart.tris) {
            for (&v, &o) in t.iter().zip(o) {
                let had = &mut had[v as usize];
                if had[0] == NONE {
                    *had = [o, o];
                } else if had[0] != o {
                    had[1] = o;
                }
            }
        }
        let at = |o: u32| old.chart.uv[o as usize];
        for share in [0.5, 0.25, 0.75, 0.05, 0.95] {
            for (p, &[a, b]) in chart.uv.iter_mut().zip(&had) {
                let (a, b) = (at(a), at(b));
                *p = [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
            }
            if all_positive(&chart.tris, &chart.uv) {
                return if parted(&mut chart, &had, ctx) {
                    self.relaxed(cut, chart, steps, ctx)
                } else {
                    None
                };
            }
        }
        None
    }

    /// Energy above its least, per area, about each vertex.
    pub(super) fn excess(&self, layout: &Layout) -> Vec<f64> {
        let (mut sum, mut area) = (vec![0.0; self.vertices()], vec![1e-300; self.vertices()]);
        for ((t, &r), o) in self.tris.iter().zip(&self.rest).zip(&layout.chart.tris) {
            let a = 0.5 * r[0] * r[2];
            let e = a * (dirichlet(r, corners(*o, &layout.chart.uv)) - 4.0).max(0.0);
            for &v in t {
                sum[v as usize] += e;
                area[v as usize] += a;
            }
        }
        sum.iter().zip(&area).map(|(s, a)| s / a).collect()
    }

    /// Distances along edges from some vertices, and the edge that each vertex is reached by.
    pub(super) fn distances(&self, from: &[bool], ctx: &Context<'_>) -> Result<(Vec<f64>, Vec<u32>)> {
        let sources = (0..self.vertices() as u32).filter(|&v| from[v as usize]);
        let step = |v: u32| {
            let edges = self.near(v).iter();
            edges.map(move |&e| Step { to: self.other(e, v), length: self.length[e as usize], by: e })
        };
        let reached = shortest(self.vertices(), sources, step, |_| false, ctx)?;
        Ok((reached.distance, reached.by))
    }

    /// The edges from a vertex back to where distances were counted from.
    pub(super) fn path(&self, mut v: u32, by: &[u32]) -> Vec<u32> {
        let mut out = Vec::new();
        while by[v as usize] != NONE {
            out.push(by[v as usize]);
            v = self.other(by[v as usize], v);
        }
        out
    }
}

/// Draws the two sides of a new cut apart by a little, each towards its own triangles; whether the border
/// then touches itself nowhere. `had` gives the positions that each vertex had: those that share one are the
/// two sides.
pub(super) fn parted(chart: &mut Chart, had: &[[u32; 2]], ctx: &Context<'_>) -> bool {
    let most = had.iter().flatten().max().map_or(0, |&o| o as usize + 1);
    let mut copies = vec![0u8; most];
    had.iter().for_each(|h| copies[h[0] as usize] = copies[h[0] as usize].saturating_add(1));
    let injective = |uv: &[[f64; 2]]| {
        all_positive(&chart.tris, uv) && injective(&chart.tris, uv, &chart.border, ctx).is_ok_and(|fits| fits)
    };
    if copies.iter().all(|&c| c <= 1) {
        return injective(&chart.uv);
    }
    let is_new = |v: u32| copies[had[v as usize][0] as usize] > 1;
    // Border vertices before and after each; the way between both on the chart's side, and the nearer one.
    let mut beside = vec![[NONE; 2]; chart.vertices()];
    for &(i, k) in &chart.border {
        let (t, k) = (chart.tris[i as usize], usize::from(k));
        beside[t[k] as usize][1] = t[(k + 1) % 3];
        beside[t[(k + 1) % 3] as usize][0] = t[k];
    }
    let inward: Vec<(usize, [f64; 2])> = (0..chart.vertices())
        .filter(|&v| is_new(v as u32) && !beside[v].contains(&NONE))
        .map(|v| {
            let p = chart.uv[v];
            let [before, after] = beside[v].map(|w| [0, 1].map(|k| chart.uv[w as usize][k] - p[k]));
            let from = after[1].atan2(after[0]);
            let turn = (before[1].atan2(before[0]) - from).rem_euclid(std::f64::consts::TAU);
            let (sin, cos) = (from + 0.5 * turn).sin_cos();
            let nearer = before[0].hypot(before[1]).min(after[0].hypot(after[1]));
            (v, [nearer * cos, nearer * sin])
        })
        .collect();
    let mut share = SEAMS.parted;
    for _ in 0..SEAMS.partings {
        let mut at = chart.uv.clone();
        for &(v, d) in &inward {
            at[v] = [0, 1].map(|k| at[v][k] + share * d[k]);
        }
        if injective(&at) {
            chart.uv = at;
            return true;
        }
        share *= 0.1;
    }
    false
}
