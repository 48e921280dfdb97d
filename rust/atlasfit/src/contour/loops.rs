//! Boundary loops.
//!
//! In: an oriented surface with every edge in at most two triangles. Out: closed rings of vertices along its
//! boundary.

use super::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use crate::spatial::edges::{Edges, HalfEdge};

/// Boundary loops as vertices in the order in which new triangles run along them. Vertices where boundaries
/// touch make no loop.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn of(s: &Surface, ctx: &Context<'_>) -> Result<Vec<Vec<u32>>> {
    // The missing triangle runs against the one that is there.
    let missing = |h: HalfEdge| {
        let [low, high] = h.ends();
        if h.start(&s.triangles) == high { (low, high) } else { (high, low) }
    };
    let mut next: Vec<(u32, u32)> = Edges::new(&s.triangles, ctx)?
        .iter()
        .filter(|edge| edge.len() == 1)
        .map(|edge| missing(edge[0]))
        .collect();
    sort(&mut next, ctx)?;
    let successor = |v: u32| {
        let i = next.partition_point(|e| e.0 < v);
        match next.get(i) {
            Some(e) if e.0 == v && next.get(i + 1).is_none_or(|f| f.0 != v) => Some((i, e.1)),
            _ => None,
        }
    };
    let mut used = vec![false; next.len()];
    let mut out = Vec::new();
    for start in 0..next.len() {
        if used[start] {
            continue;
        }
        let (first, mut v) = next[start];
        let mut ring = vec![first];
        used[start] = true;
        let closed = loop {
            if v == first {
                break true;
            }
            let Some((i, to)) = successor(v) else { break false };
            if used[i] {
                break false;
            }
            used[i] = true;
            ring.push(v);
            v = to;
        };
        if closed && ring.len() >= 3 {
            out.push(ring);
        }
    }
    Ok(out)
}
