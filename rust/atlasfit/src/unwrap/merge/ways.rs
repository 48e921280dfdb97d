//! The shortest border that two charts could have.
//!
//! In: the faces near their border. Out: a side for each of them.
//!
//! Where the border is a way from one end to another, or several, the shortest ones are found as such ways
//! (Dijkstra). Where it is closed, it is the shortest cut between what lies deep in the one chart and deep in
//! the other.

use super::constants::MERGE;
use super::region::{DEEP, Region};
use crate::run::Context;
use crate::spatial::min_cut::{Side, min_cut};
use crate::spatial::paths::{Step, shortest};
use crate::spatial::sets::Sets;
use crate::unwrap::surface::{NONE, Surface};
use rustc_hash::FxHashMap;

/// For each face of the region whether it is to lie in the second chart: as now where the border, which costs
/// `cost`, is about as cheap as can be. `None` where to find out would take long, or when the run is to
/// stop: the caller checks.
pub(super) fn sides(s: &Surface, region: &Region, cost: f64, ctx: &Context<'_>) -> Option<Vec<bool>> {
    let net = Net::new(s, region);
    if let Some(ways) = ways(region, &net, ctx)? {
        if ways.length > (1.0 - MERGE.trade_gain) * cost {
            return Some(region.second.clone());
        }
        if let Some(sides) = parted(region, &net, &ways) {
            return Some(sides);
        }
    }
    shortest_cut(s, region, ctx)
}

/// An edge: its ends, and its length.
type Edge = (u32, u32, f64);

/// The edges that the border may run along: those of faces that may change hands. Vertices have numbers of
/// their own.
struct Net {
    edges: Vec<Edge>,
    /// Which edge each side of each face of the region is; [`NONE`] where no border may run.
    edge_of: Vec<[u32; 3]>,
    /// The edges at each vertex.
    of_vertex: Vec<Vec<u32>>,
    /// Where the pair ends, by connected pieces: the piece at each vertex, [`NONE`] at those inside.
    end: Vec<u32>,
}

impl Net {
    fn new(s: &Surface, region: &Region) -> Self {
        let Region { faces, open, beyond, .. } = region;
        let mut number: FxHashMap<u32, u32> = FxHashMap::default();
        let mut numbered = |v: u32| {
            let next = number.len() as u32;
            *number.entry(v).or_insert(next)
        };
        let (mut edges, mut edge_of) = (Vec::new(), vec![[NONE; 3]; faces.len()]);
        let mut outside = Vec::new();
        for i in (0..faces.len()).filter(|&i| open[i]) {
            let f = faces[i];
            let t = s.tri[f as usize].map(&mut numbered);
            for k in 0..3 {
                let (a, b, j) = (t[k], t[(k + 1) % 3], beyond[i][k]);
                if j == NONE {
                    outside.push((a, b));
                    continue;
                }
                let h = s.twin[f as usize][k];
                // No border runs through a polygon.
                if edge_of[i][k] != NONE || s.cells.is_some() && s.cell(f) == s.cell(h / 3) {
                    continue;
                }
                edge_of[i][k] = edges.len() as u32;
                if j != DEEP {
                    edge_of[j as usize][h as usize % 3] = edges.len() as u32;
                }
                edges.push((a, b, s.cost(f as usize, k)));
            }
        }
        let mut sets = Sets::new(number.len());
        let mut end = vec![NONE; number.len()];
        outside.iter().for_each(|&(a, b)| sets.join(a, b));
        for v in outside.iter().flat_map(|&(a, b)| [a, b]) {
            end[v as usize] = sets.find(v);
        }
        let mut of_vertex = vec![Vec::new(); number.len()];
        for (&(a, b, _), e) in edges.iter().zip(0..) {
            of_vertex[a as usize].push(e);
            of_vertex[b as usize].push(e);
        }
        Self { edges, edge_of, of_vertex, end }
    }

    /// The other end of an edge.
    fn across(&self, e: u32, v: u32) -> u32 {
        let (a, b, _) = self.edges[e as usize];
        if a == v { b } else { a }
    }

    /// The edges between faces of the one chart and of the other, in connected pieces.
    fn border(&self, region: &Region) -> Vec<Vec<u32>> {
        let Region { second, beyond, .. } = region;
        let mut sets = Sets::new(self.end.len());
        let mut border = Vec::new();
        for i in (0..second.len()).filter(|&i| !second[i]) {
            for (&j, &e) in beyond[i].iter().zip(&self.edge_of[i]) {
                if e != NONE && j != DEEP && second[j as usize] {
                    sets.join(self.edges[e as usize].0, self.edges[e as usize].1);
                    border.push(e);
                }
            }
        }
        let mut pieces: Vec<(u32, u32)> =
            border.into_iter().map(|e| (sets.find(self.edges[e as usize].0), e)).collect();
        pieces.sort_unstable();
        pieces.chunk_by(|x, y| x.0 == y.0).map(|piece| piece.iter().map(|p| p.1).collect()).collect()
    }

    /// Adds to `on` the shortest way between the two ends of a piece of the border, and returns its length;
    /// `None` inside where it has no two ends, outside when the run is to stop.
    fn way(&self, piece: &[u32], on: &mut [bool], ctx: &Context<'_>) -> Option<Option<f64>> {
        let of = |&e: &u32| [self.edges[e as usize].0, self.edges[e as usize].1];
        let mut ends: Vec<u32> =
            piece.iter().flat_map(of).map(|v| self.end[v as usize]).filter(|&e| e != NONE).collect();
        ends.sort_unstable();
        ends.dedup();
        let &[from, to] = &ends[..] else { return Some(None) };
        let steps = |v: u32| {
            let step =
                move |&e: &u32| Step { to: self.across(e, v), length: self.edges[e as usize].2, by: e };
            self.of_vertex[v as usize].iter().map(step)
        };
        let count = self.end.len();
        let starts = (0..count as u32).filter(|&v| self.end[v as usize] == from);
        let reached = shortest(count, starts, steps, |v| self.end[v as usize] == to, ctx).ok()?;
        let Some(end) = reached.end else { return Some(None) };
        let mut v = end;
        while reached.by[v as usize] != NONE {
            let e = reached.by[v as usize];
            on[e as usize] = true;
            v = self.across(e, v);
        }
        Some(Some(reached.distance[end as usize]))
    }
}

/// The shortest ways that all pieces of the border could take.
struct Ways {
    /// Whether they run along each edge.
    on: Vec<bool>,
    length: f64,
}

/// The shortest ways; `None` inside where no piece of the border has ends, outside when the run is to stop.
/// Pieces without ends stay as they are.
fn ways(region: &Region, net: &Net, ctx: &Context<'_>) -> Option<Option<Ways>> {
    let mut out = Ways { on: vec![false; net.edges.len()], length: 0.0 };
    let mut any = false;
    for piece in net.border(region) {
        if let Some(length) = net.way(&piece, &mut out.on, ctx)? {
            out.length += length;
            any = true;
        } else {
            for e in piece {
                out.length += net.edges[e as usize].2;
                out.on[e as usize] = true;
            }
        }
    }
    Some(any.then_some(out))
}

/// On which side of the ways each face lies; `None` where they do not part the charts.
fn parted(region: &Region, net: &Net, ways: &Ways) -> Option<Vec<bool>> {
    let Region { second, open, beyond, .. } = region;
    let passes = |i: usize, k: usize| {
        let e = net.edge_of[i][k];
        e == NONE || !ways.on[e as usize]
    };
    // From what keeps its chart every face is reached that lies on the same side.
    let mut side: Vec<Option<bool>> = vec![None; second.len()];
    let mut stack = Vec::new();
    for i in (0..second.len()).filter(|&i| open[i]) {
        if (0..3).any(|k| region.keeps(beyond[i][k]) && passes(i, k)) {
            side[i] = Some(second[i]);
            stack.push(i);
        }
    }
    while let Some(i) = stack.pop() {
        for k in 0..3 {
            let j = beyond[i][k];
            if j == NONE || region.keeps(j) || !passes(i, k) {
                continue;
            }
            match side[j as usize] {
                None => {
                    side[j as usize] = side[i];
                    stack.push(j as usize);
                }
                other if other != side[i] => return None,
                _ => {}
            }
        }
    }
    Some(side.iter().zip(second).map(|(side, &now)| side.unwrap_or(now)).collect())
}

/// The same as the shortest cut; `None` where that would take long, or when the run is to stop.
fn shortest_cut(s: &Surface, region: &Region, ctx: &Context<'_>) -> Option<Vec<bool>> {
    let Region { faces, second, open, beyond } = region;
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
            edges.push((name[i], to, s.cost(faces[i] as usize, k)));
        }
    }
    let cut = min_cut(&edges, &sides, ctx).ok()?;
    Some(name.iter().map(|&v| cut[v as usize]).collect())
}
