//! Whether two charts would overlap once they are joined along a part of their border.
//!
//! In: two flattened charts, their path, the part along which they are joined, the rigid motion that lays one
//! against the other. Out: yes or no. The solve hardly changes the answer, and costs far more: of 328 parts
//! refused here on three meshes (spool, cow, fertility; a private build) it would have accepted none.

use super::align::{Motion, Shared, moved};
use super::dart::Path;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::inject::segments_touch;
use crate::unwrap::chart::Chart;
use crate::unwrap::surface::NONE;
use rustc_hash::FxHashSet;
use std::ops::Range;

/// Whether the charts touch but for the part along which they are joined.
pub(super) fn overlaps(
    [a, b]: [&Chart; 2],
    path: &Path,
    part: &Range<usize>,
    motion: Motion,
    ctx: &Context<'_>,
) -> Result<bool> {
    // Most that do so do it right where they part, which is quickly seen.
    let after = path.edges.get(part.end).is_some_and(|e| closes_in([a, b], e, 1, motion));
    let before = path.edges[..part.start].last().is_some_and(|e| closes_in([a, b], e, 0, motion));
    Ok(after || before || borders_touch([a, b], &path.edges[part.clone()], motion, ctx)?)
}

/// Whether the second chart lies within the first at end `k` of an edge of both, if its other end is joined:
/// there the two have more than a full turn. By less than a quarter of one: two edges that point away from
/// each other do so too where the two have less than half a turn, as a steep cone's halves.
fn closes_in([a, b]: [&Chart; 2], e: &Shared, k: usize, motion: Motion) -> bool {
    let direction = |from: [f64; 2], to: [f64; 2]| [to[0] - from[0], to[1] - from[1]];
    let [p, q] = e.a.map(|v| a.uv[v as usize]);
    let of_b = e.b.map(|v| moved(motion, b.uv[v as usize]));
    let (along, other) = (direction(p, q), direction(of_b[0], of_b[1]));
    // Either points from the end that is joined if `k` is 1, and to it if not.
    let turn = along[0] * other[1] - along[1] * other[0];
    let same_way = along[0] * other[0] + along[1] * other[1] > 0.0;
    same_way && (turn > 0.0) == (k == 1) && turn != 0.0
}

/// Whether the borders of the two charts touch, once the vertices of some edges of both are made one.
fn borders_touch([a, b]: [&Chart; 2], joined: &[Shared], motion: Motion, ctx: &Context<'_>) -> Result<bool> {
    let mut uv = a.uv.clone();
    let mut name_of_b = vec![NONE; b.vertices()];
    for e in joined {
        for (&p, &q) in e.a.iter().zip(&e.b) {
            let (x, y) = (a.uv[p as usize], moved(motion, b.uv[q as usize]));
            uv[p as usize] = [0.5 * (x[0] + y[0]), 0.5 * (x[1] + y[1])];
            name_of_b[q as usize] = p;
        }
    }
    let border = |c: &Chart, inside: FxHashSet<[u32; 2]>| -> Vec<[u32; 2]> {
        let ends = |&(i, k): &(u32, u8)| {
            let (t, k) = (c.tris[i as usize], usize::from(k));
            [t[k], t[(k + 1) % 3]]
        };
        c.border.iter().map(ends).filter(|edge| !inside.contains(edge)).collect()
    };
    let mut segments = border(a, joined.iter().map(|e| e.a).collect());
    for edge in border(b, joined.iter().map(|e| [e.b[1], e.b[0]]).collect()) {
        segments.push(edge.map(|v| {
            let name = &mut name_of_b[v as usize];
            if *name == NONE {
                *name = uv.len() as u32;
                uv.push(moved(motion, b.uv[v as usize]));
            }
            *name
        }));
    }
    Ok(segments_touch(&segments, &uv, ctx)?.is_some())
}

#[cfg(test)]
mod tests {
    use super::super::align::align;
    use super::super::dart::tests::strips;
    use super::*;
    use crate::Run;

    /// Whether strips overlap that are joined along the first eight edges of their path.
    fn joined(height: impl Fn(f64) -> f64) -> bool {
        let height: Vec<f64> = (0..=16).map(|i| height(f64::from(i))).collect();
        let (a, b, shared) = strips(&height);
        let path = Path::new(&a, &b, shared);
        let motion = align(&a, &b, &path.edges[..8]).0;
        Run::default().execute(|ctx| overlaps([&a, &b], &path, &(0..8), motion, ctx)).unwrap()
    }

    #[test]
    fn sides_that_part_leave_a_dart_and_sides_that_close_in_overlap() {
        assert!(!joined(|x| 0.1 * (x - 8.0).max(0.0)));
        assert!(joined(|x| -0.1 * (x - 8.0).max(0.0)));
    }

    #[test]
    fn sides_that_part_and_meet_again_overlap() {
        let bump = |x: f64| (x - 8.0).max(0.0) * (13.5 - x);
        assert!(joined(|x| 0.1 * bump(x)));
    }
}
