//! The surface beside the border of two charts, and the shortest border that it has room for.
//!
//! In: two charts that are neighbours. Out: the faces that go over to the other one.
//!
//! Where the border is a way from one end to another, or several, the shortest ones are found as such ways
//! (Dijkstra). Where it is closed, it is the shortest cut between what lies deep in the one chart and deep in
//! the other.

use super::charts::Charts;
use super::constants::MERGE;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::min_cut::{Side, min_cut};
use crate::spatial::paths::{Step, shortest};
use crate::spatial::sets::Sets;
use crate::unwrap::chart::Chart;
use crate::unwrap::surface::{NONE, Surface};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Beyond an edge: a face of the pair that is too deep to be looked at.
const DEEP: u32 = NONE - 1;

/// Faces that go over to the other chart.
pub(super) struct Move {
    /// Whether the second of the two charts gives them.
    pub from_second: bool,
    /// Sorted.
    pub faces: Vec<u32>,
}

/// Two charts that share a border.
pub(super) struct Neighbouring<'a> {
    pub s: &'a Surface,
    pub charts: &'a Charts,
    pub ids: [u32; 2],
    /// Length of their border.
    pub length: f64,
}

/// The faces near the border.
struct Region {
    /// The faces.
    faces: Vec<u32>,
    /// Whether each belongs to the second chart.
    second: Vec<bool>,
    /// Whether each may change hands.
    open: Vec<bool>,
    /// For each edge the place here of the face beyond it; [`DEEP`], or [`NONE`] where the pair ends.
    beyond: Vec<[u32; 3]>,
    /// The border: edges of faces of the first chart, by place and slot.
    border: Vec<(u32, u8)>,
}

impl Neighbouring<'_> {
    /// What changes hands so that the border is the shortest within `reach` of the present one, what saves
    /// most first. Nothing when the run is to stop: the caller checks.
    pub(super) fn moves(&self, reach: f64, ctx: &Context<'_>) -> Vec<Move> {
        let Some(region) = self.region(reach, ctx) else { return Vec::new() };
        let second = match self.way(&region, ctx) {
            Way::Shorter(second) => second,
            Way::None => return Vec::new(),
            Way::Unclear => match self.cut(&region, ctx) {
                Some(second) => second,
                None => return Vec::new(),
            },
        };
        self.changed(&region, &second)
    }

    /// Which of the two charts a face belongs to, the second if so, and its place there.
    fn place(&self, face: usize) -> Option<(bool, u32)> {
        let which = self.ids.iter().position(|&id| id == self.charts.owner[face])?;
        Some((which == 1, self.charts.index_of[face]))
    }

    /// The face beyond an edge of a face of the pair: whether it belongs to the same chart and hangs together
    /// with the face. `None` where the pair ends.
    fn beyond(&self, both: &[&Chart; 2], face: u32, k: usize) -> Option<(u32, bool)> {
        let h = self.s.twin[face as usize][k];
        if h == NONE {
            return None;
        }
        let (second, i) = self.place(face as usize)?;
        let (other, j) = self.place(h as usize / 3)?;
        if second != other {
            return Some((h / 3, false));
        }
        let c = both[usize::from(second)];
        let (t, u, l) = (c.tris[i as usize], c.tris[j as usize], h as usize % 3);
        (t[k] == u[(l + 1) % 3] && t[(k + 1) % 3] == u[l]).then_some((h / 3, true))
    }

    fn region(&self, reach: f64, ctx: &Context<'_>) -> Option<Region> {
        let Self { s, charts, ids, .. } = *self;
        let chart = |id: u32| charts.list[id as usize].as_ref();
        let both = [chart(ids[0])?, chart(ids[1])?];
        let centre = |f: u32| {
            let sum = s.tri[f as usize].iter().fold(Vec3::ZERO, |a, &v| a + s.pos[v as usize]);
            sum * (1.0 / 3.0)
        };
        let (mut faces, mut deep) = (Vec::new(), Vec::new());
        let mut local: FxHashMap<u32, u32> = FxHashMap::default();
        let mut heap = BinaryHeap::new();
        let mut border = Vec::new();
        for &(i, k) in &both[0].border {
            let f = both[0].faces[i as usize];
            let h = s.twin[f as usize][k as usize];
            if h == NONE || charts.owner[h as usize / 3] != ids[1] {
                continue;
            }
            for f in [h / 3, f] {
                local.entry(f).or_insert_with(|| {
                    faces.push(f);
                    deep.push(0.0);
                    heap.push(Reverse((0u64, faces.len() as u32 - 1)));
                    faces.len() as u32 - 1
                });
            }
            border.push((local[&f], k));
        }
        // Deeper than this it makes no difference how deep the deepest face is.
        let enough = reach / MERGE.core;
        let mut deepest = [0.0; 2];
        let mut looks = 0;
        // As numbers that are not negative, distances are ordered as their bits.
        while let Some(Reverse((bits, i))) = heap.pop() {
            looks += 1;
            ctx.check_at(looks).ok()?;
            let (f, far) = (faces[i as usize], f64::from_bits(bits));
            if far > deep[i as usize] {
                continue;
            }
            let second = charts.owner[f as usize] == ids[1];
            deepest[usize::from(second)] = far;
            if far > enough {
                continue;
            }
            for k in 0..3 {
                let Some((g, true)) = self.beyond(&both, f, k) else { continue };
                let then = far + (centre(f) - centre(g)).norm();
                let j = *local.entry(g).or_insert_with(|| {
                    faces.push(g);
                    deep.push(f64::INFINITY);
                    faces.len() as u32 - 1
                });
                if then < deep[j as usize] {
                    deep[j as usize] = then;
                    heap.push(Reverse((then.to_bits(), j)));
                }
            }
        }
        let free = deepest.map(|d: f64| reach.min(MERGE.core * d));
        let second: Vec<bool> = faces.iter().map(|&f| charts.owner[f as usize] == ids[1]).collect();
        let open: Vec<bool> = second.iter().zip(&deep).map(|(&s, &d)| d <= free[usize::from(s)]).collect();
        let beyond = |&f: &u32| {
            [0, 1, 2].map(|k| {
                let found = self.beyond(&both, f, k);
                found.map_or(NONE, |(g, _)| local.get(&g).copied().unwrap_or(DEEP))
            })
        };
        let beyond = faces.iter().map(beyond).collect();
        Some(Region { faces, second, open, beyond, border })
    }

    /// The shortest ways between the two ends of each piece of the border, as a side for each face of the
    /// region.
    fn way(&self, region: &Region, ctx: &Context<'_>) -> Way {
        let s = self.s;
        let Region { faces, second, open, beyond, border } = region;
        // Vertices and edges of the faces that may change hands.
        let mut local: FxHashMap<u32, u32> = FxHashMap::default();
        let mut named = |v: u32| {
            let next = local.len() as u32;
            *local.entry(v).or_insert(next)
        };
        let mut edges: Vec<(u32, u32, f64)> = Vec::new();
        let mut edge_of = vec![[NONE; 3]; faces.len()];
        let mut outside: Vec<(u32, u32)> = Vec::new();
        for i in (0..faces.len()).filter(|&i| open[i]) {
            let f = faces[i];
            let t = s.tri[f as usize].map(&mut named);
            for k in 0..3 {
                let (a, b, j) = (t[k], t[(k + 1) % 3], beyond[i][k]);
                if j == NONE {
                    outside.push((a, b));
                    continue;
                }
                let g = s.twin[f as usize][k] / 3;
                if edge_of[i][k] != NONE || s.cells.is_some() && s.cell(f) == s.cell(g) {
                    continue;
                }
                edge_of[i][k] = edges.len() as u32;
                if j != DEEP {
                    edge_of[j as usize][s.twin[f as usize][k] as usize % 3] = edges.len() as u32;
                }
                edges.push((a, b, f64::from(s.length[f as usize][k])));
            }
        }
        // Where the pair ends, in connected pieces.
        let mut sets = Sets::new(local.len());
        let mut end = vec![NONE; local.len()];
        outside.iter().for_each(|&(a, b)| sets.join(a, b));
        for v in outside.iter().flat_map(|&(a, b)| [a, b]) {
            end[v as usize] = sets.find(v);
        }
        let mut of_vertex: Vec<Vec<u32>> = vec![Vec::new(); local.len()];
        for (e, &(a, b, _)) in edges.iter().enumerate() {
            of_vertex[a as usize].push(e as u32);
            of_vertex[b as usize].push(e as u32);
        }
        let across = |e: u32, v: u32| {
            let (a, b, _) = edges[e as usize];
            if a == v { b } else { a }
        };
        let mut on_way = vec![false; edges.len()];
        let (mut length, mut is_way) = (0.0, false);
        for piece in connected(border.iter().map(|&(i, k)| edge_of[i as usize][k as usize]), &edges) {
            if ctx.check().is_err() {
                return Way::None;
            }
            let mut ends: Vec<u32> = (piece.iter())
                .flat_map(|&e| [edges[e as usize].0, edges[e as usize].1])
                .map(|v| end[v as usize])
                .filter(|&e| e != NONE)
                .collect();
            ends.sort_unstable();
            ends.dedup();
            if let &[from, to] = &ends[..] {
                let steps = |v: u32| {
                    let (of, edges) = (&of_vertex[v as usize], &edges);
                    of.iter().map(move |&e| Step { to: across(e, v), length: edges[e as usize].2, by: e })
                };
                let starts = (0..local.len() as u32).filter(|&v| end[v as usize] == from);
                let Ok(reached) = shortest(local.len(), starts, steps, |v| end[v as usize] == to, ctx) else {
                    return Way::None;
                };
                if let Some(mut v) = reached.end {
                    (length, is_way) = (length + reached.distance[v as usize], true);
                    while reached.by[v as usize] != NONE {
                        let e = reached.by[v as usize];
                        on_way[e as usize] = true;
                        v = across(e, v);
                    }
                    continue;
                }
            }
            // It stays as it is.
            for e in piece {
                length += edges[e as usize].2;
                on_way[e as usize] = true;
            }
        }
        if !is_way {
            return Way::Unclear;
        }
        if length > (1.0 - MERGE.trade_gain) * self.length {
            return Way::None;
        }
        // From what lies deep every face is reached that lies on the same side of the ways.
        let passes = |i: usize, k: usize| edge_of[i][k] == NONE || !on_way[edge_of[i][k] as usize];
        let deep = |j: u32| j == DEEP || j != NONE && !open[j as usize];
        let mut side: Vec<Option<bool>> = vec![None; faces.len()];
        let mut stack = Vec::new();
        for i in (0..faces.len()).filter(|&i| open[i]) {
            if (0..3).any(|k| deep(beyond[i][k]) && passes(i, k)) {
                side[i] = Some(second[i]);
                stack.push(i);
            }
        }
        while let Some(i) = stack.pop() {
            for k in 0..3 {
                let j = beyond[i][k];
                if j == NONE || deep(j) || !passes(i, k) {
                    continue;
                }
                match side[j as usize] {
                    None => {
                        side[j as usize] = side[i];
                        stack.push(j as usize);
                    }
                    other if other != side[i] => return Way::Unclear,
                    _ => {}
                }
            }
        }
        Way::Shorter(side.iter().zip(second).map(|(side, &now)| side.unwrap_or(now)).collect())
    }

    /// The same as the shortest cut.
    fn cut(&self, region: &Region, ctx: &Context<'_>) -> Option<Vec<bool>> {
        let s = self.s;
        let Region { faces, second, open, beyond, .. } = region;
        let n = faces.len() as u32;
        if open.iter().filter(|o| **o).count() > MERGE.cut_faces {
            return None;
        }
        // A polygon stays in one piece: it is one vertex of the cut.
        let mut of_cell: FxHashMap<u32, u32> = FxHashMap::default();
        let name: Vec<u32> = (faces.iter().zip(0..))
            .map(|(&f, i)| if s.cells.is_some() { *of_cell.entry(s.cell(f)).or_insert(i) } else { i })
            .collect();
        // What is deep is one vertex for each chart.
        let mut sides = vec![Side::Open; n as usize];
        sides.extend([Side::First, Side::Second]);
        let mut edges = Vec::new();
        for i in 0..n as usize {
            if !open[i] {
                sides[name[i] as usize] = if second[i] { Side::Second } else { Side::First };
            }
            for (k, &j) in beyond[i].iter().enumerate() {
                let to = match j {
                    NONE => continue,
                    DEEP => n + u32::from(second[i]),
                    j if j > i as u32 => name[j as usize],
                    _ => continue,
                };
                edges.push((name[i], to, f64::from(s.length[faces[i] as usize][k])));
            }
        }
        let cut = min_cut(&edges, &sides, ctx).ok()?;
        Some(name.iter().map(|&v| cut[v as usize]).collect())
    }

    /// The connected faces that are to lie on the other side, what saves most first.
    fn changed(&self, region: &Region, side: &[bool]) -> Vec<Move> {
        let Region { faces, second, open, beyond, .. } = region;
        let changes = |i: usize| open[i] && side[i] != second[i];
        let mut seen = vec![false; faces.len()];
        let mut out: Vec<(f64, Move)> = Vec::new();
        for first in 0..faces.len() {
            if seen[first] || !changes(first) {
                continue;
            }
            seen[first] = true;
            let (mut members, mut next, mut saved) = (vec![first], 0, 0.0);
            while let Some(&i) = members.get(next) {
                next += 1;
                for (k, &j) in beyond[i].iter().enumerate() {
                    let length = f64::from(self.s.length[faces[i] as usize][k]);
                    match j {
                        NONE => {}
                        DEEP => saved -= length,
                        j if second[j as usize] != second[i] => saved += length,
                        j if !changes(j as usize) => saved -= length,
                        j => {
                            if !std::mem::replace(&mut seen[j as usize], true) {
                                members.push(j as usize);
                            }
                        }
                    }
                }
            }
            if saved > MERGE.trade_gain * self.length {
                let mut moved: Vec<u32> = members.iter().map(|&i| faces[i]).collect();
                moved.sort_unstable();
                out.push((saved, Move { from_second: second[first], faces: moved }));
            }
        }
        out.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.faces.cmp(&y.1.faces)));
        out.into_iter().map(|m| m.1).collect()
    }
}

/// Edges in connected pieces.
fn connected(some: impl Iterator<Item = u32>, edges: &[(u32, u32, f64)]) -> Vec<Vec<u32>> {
    let some: Vec<u32> = some.filter(|&e| e != NONE).collect();
    let most = some.iter().map(|&e| edges[e as usize].0.max(edges[e as usize].1) as usize + 1).max();
    let mut sets = Sets::new(most.unwrap_or(0));
    some.iter().for_each(|&e| sets.join(edges[e as usize].0, edges[e as usize].1));
    let mut pieces: Vec<(u32, u32)> = some.iter().map(|&e| (sets.find(edges[e as usize].0), e)).collect();
    pieces.sort_unstable();
    pieces.chunk_by(|x, y| x.0 == y.0).map(|piece| piece.iter().map(|p| p.1).collect()).collect()
}

/// What is known of the shortest ways.
enum Way {
    /// A side for each face, the second if so.
    Shorter(Vec<bool>),
    /// None is shorter than the present one.
    None,
    /// The border has no ends, or the ways do not part the charts.
    Unclear,
}
