//! Boundary loops.
//!
//! In: a surface with every edge in at most two triangles, one-sided or not. Out: closed rings of vertices
//! along its boundary.

use super::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::{sort, sort_by};
use crate::run::Context;
use crate::spatial::edges::{Edges, HalfEdge};

/// One end of an edge of the boundary.
#[derive(Clone, Copy)]
struct End {
    vertex: u32,
    other: u32,
    edge: u32,
}

/// Boundary loops as vertices, on a surface that is oriented in the order in which new triangles run along
/// them. Vertices where boundaries touch make no loop.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn of(s: &Surface, ctx: &Context<'_>) -> Result<Vec<Vec<u32>>> {
    // The missing triangle runs against the one that is there.
    let missing = |h: HalfEdge| {
        let [low, high] = h.ends();
        if h.start(&s.triangles) == high { (low, high) } else { (high, low) }
    };
    let mut boundary: Vec<(u32, u32)> = Edges::new(&s.triangles, ctx)?
        .iter()
        .filter(|edge| edge.len() == 1)
        .map(|edge| missing(edge[0]))
        .collect();
    sort(&mut boundary, ctx)?;
    let ends = boundary
        .iter()
        .zip(0..)
        .flat_map(|(&(a, b), edge)| [End { vertex: a, other: b, edge }, End { vertex: b, other: a, edge }]);
    let mut ends: Vec<End> = ends.collect();
    sort_by(&mut ends, |a, b| a.vertex.cmp(&b.vertex).then(a.edge.cmp(&b.edge)), ctx)?;
    // The edge that goes on from one that ends at a vertex, where there is just one.
    let successor = |v: u32, from: u32| {
        let i = ends.partition_point(|e| e.vertex < v);
        match ends[i..] {
            [a, b, ref rest @ ..] if b.vertex == v && rest.first().is_none_or(|c| c.vertex != v) => {
                Some(if a.edge == from { b } else { a })
            }
            _ => None,
        }
    };
    let mut used = vec![false; boundary.len()];
    let mut out = Vec::new();
    for start in 0..boundary.len() {
        ctx.check_at(start)?;
        if used[start] {
            continue;
        }
        let ((first, mut v), mut edge) = (boundary[start], start as u32);
        let mut ring = vec![first];
        used[start] = true;
        let closed = loop {
            if v == first {
                break true;
            }
            let Some(next) = successor(v, edge) else { break false };
            if used[next.edge as usize] {
                break false;
            }
            used[next.edge as usize] = true;
            ring.push(v);
            (v, edge) = (next.other, next.edge);
        };
        if closed && ring.len() >= 3 {
            out.push(ring);
        }
    }
    Ok(out)
}
