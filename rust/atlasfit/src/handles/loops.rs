//! The shortest loops about a handle.
//!
//! In: a piece of a surface with a handle. Out: two loops of its vertices: the shortest that does not cut the
//! piece in two, and the shortest that crosses it once. For a tube one goes about it, the other along it and
//! back. Loops at a place are those that a tree of shortest ways and a tree of what lies beside them leave
//! (Erickson and Whittlesey 2005).

use super::constants::HANDLES;
use super::open;
use super::piece::{Edge, Piece};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::paths::{self, Step};
use crate::spatial::sets::Sets;

/// The loops of a piece; none where they come to its boundary.
pub(super) fn shortest(piece: &Piece, ctx: &Context<'_>) -> Result<Vec<Vec<u32>>> {
    let ways = Ways::new(piece);
    let free: Vec<u32> = (0..piece.vertices.len() as u32).filter(|&v| !piece.on_ring[v as usize]).collect();
    let shorter = |a: &(f64, Vec<u32>), b: &(f64, Vec<u32>)| a.0.total_cmp(&b.0);
    let mut best: Option<(f64, Vec<u32>)> = None;
    for &base in free.iter().step_by(free.len().div_ceil(HANDLES.bases).max(1)) {
        best = best.into_iter().chain(ways.loop_at(base, ctx)?).min_by(shorter);
    }
    // A loop that was found from beside it is shorter from one of its own vertices.
    for base in best.iter().flat_map(|best| best.1.clone()).collect::<Vec<_>>() {
        best = best.into_iter().chain(ways.loop_at(base, ctx)?).min_by(shorter);
    }
    let Some((_, first)) = best else { return Ok(Vec::new()) };
    let mut loops = vec![first];
    loops.extend(ways.crossing(&loops[0], ctx)?);
    Ok(loops)
}

/// The ways along the edges of a piece.
struct Ways<'a> {
    piece: &'a Piece,
    /// The edges at each vertex.
    at: Vec<Vec<u32>>,
    length: Vec<f64>,
}

impl<'a> Ways<'a> {
    fn new(piece: &'a Piece) -> Self {
        let mut at = vec![Vec::new(); piece.vertices.len()];
        for (edge, i) in piece.edges.iter().zip(0..) {
            edge.ends.iter().for_each(|&v| at[v as usize].push(i));
        }
        let length: Vec<f64> = piece.edges.iter().map(|e| piece.distance(e.ends[0], e.ends[1])).collect();
        // No way within the piece is as long: boundaries are come to last.
        let all: f64 = length.iter().sum();
        let dear = |(&length, edge): (&f64, &Edge)| {
            if edge.ends.iter().any(|&v| piece.on_ring[v as usize]) { length + all } else { length }
        };
        let length = length.iter().zip(&piece.edges).map(dear).collect();
        Self { piece, at, length }
    }
    /// Whether a loop comes to no boundary.
    fn is_inside(&self, found: &[u32]) -> bool {
        found.len() > 2 && found.iter().all(|&v| !self.piece.on_ring[v as usize])
    }
    /// The shortest loop at a vertex that does not cut the piece in two, without the way to it; its length
    /// first.
    fn loop_at(&self, base: u32, ctx: &Context<'_>) -> Result<Option<(f64, Vec<u32>)>> {
        let Piece { edges, faces, rings, vertices, .. } = self.piece;
        let steps = |v: u32| {
            self.at[v as usize].iter().map(move |&e| {
                let [a, b] = edges[e as usize].ends;
                Step { to: if a == v { b } else { a }, length: self.length[e as usize], by: e }
            })
        };
        let reached = paths::shortest(vertices.len(), [base].into_iter(), steps, |_| false, ctx)?;
        let mut left: Vec<u32> = (0..edges.len() as u32)
            .filter(|&e| edges[e as usize].ends.iter().all(|&v| reached.by[v as usize] != e))
            .collect();
        let round = |e: u32| {
            let edge = &edges[e as usize];
            edge.ends.iter().map(|&v| reached.distance[v as usize]).sum::<f64>() + self.length[e as usize]
        };
        // The tree beside takes the edges of the longest loops.
        left.sort_by(|&a, &b| round(b).total_cmp(&round(a)));
        let mut beside = Sets::new(faces.len() + rings);
        left.retain(|&e| {
            let [f, g] = edges[e as usize].beside;
            let apart = beside.find(f) != beside.find(g);
            beside.join(f, g);
            !apart
        });
        let Some(&last) = left.last() else { return Ok(None) };
        let up = |v: u32| {
            let by = reached.by[v as usize];
            let [a, b] = edges.get(by as usize)?.ends;
            Some(if a == v { b } else { a })
        };
        let way = |v: u32| std::iter::successors(Some(v), |&v| up(v)).collect::<Vec<u32>>();
        let [mut there, mut back] = edges[last as usize].ends.map(way);
        // Both lead to the base: the last vertex that they share is where they part.
        while there.len() > 1 && back.len() > 1 && there[there.len() - 2] == back[back.len() - 2] {
            there.pop();
            back.pop();
        }
        back.pop();
        there.extend(back.into_iter().rev());
        let next = there.iter().cycle().skip(1);
        let length = there.iter().zip(next).map(|(&a, &b)| self.piece.distance(a, b)).sum();
        Ok(self.is_inside(&there).then_some((length, there)))
    }
    /// The shortest loop that crosses one once.
    fn crossing(&self, first: &[u32], ctx: &Context<'_>) -> Result<Option<Vec<u32>>> {
        let Some(open) = open::along(&self.piece.corners, first) else { return Ok(None) };
        let n = self.piece.vertices.len();
        // Right of the loop its vertices have copies, named on after all vertices.
        let mut corners = self.piece.corners.clone();
        open.iter().for_each(|c| corners[c.face as usize][c.corner] = n as u32 + c.place);
        let original = |v: u32| if v < n as u32 { v } else { first[v as usize - n] };
        let all: f64 = self.length.iter().sum();
        let far = |a: u32, b: u32| {
            let [a, b] = [a, b].map(original);
            let dear: f64 = [a, b].iter().filter(|&&v| self.piece.on_ring[v as usize]).count() as f64;
            self.piece.distance(a, b) + dear * all
        };
        let mut beside: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n + first.len()];
        for &[a, b, c] in &corners {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                let far = far(a, b);
                beside[a as usize].push((b, far));
                beside[b as usize].push((a, far));
            }
        }
        let steps = |v: u32| beside[v as usize].iter().map(move |&(to, length)| Step { to, length, by: v });
        let mut best: Option<(f64, Vec<u32>)> = None;
        for (place, &v) in first.iter().enumerate() {
            let copy = (n + place) as u32;
            let reached = paths::shortest(n + first.len(), [v].into_iter(), steps, |w| w == copy, ctx)?;
            let length = reached.distance[copy as usize];
            if length.is_finite() && best.as_ref().is_none_or(|best| length < best.0) {
                let up = |&w: &u32| Some(reached.by[w as usize]).filter(|&w| w != u32::MAX);
                let way = std::iter::successors(Some(copy), up).skip(1).map(original).collect();
                best = Some((length, way));
            }
        }
        Ok(best.map(|best| best.1).filter(|found| self.is_inside(found)))
    }
}
