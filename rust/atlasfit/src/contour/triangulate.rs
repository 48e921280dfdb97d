//! Quads cut into triangles, and triangles taken away where they are not manifold.
//!
//! In: quads with their positions. Out: triangles with every edge in at most two of them.

use super::surface::remove_marked;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::{Edges, HalfEdge};

/// Cuts each quad along its shorter diagonal; quads that use a vertex twice are left out.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn split(positions: &[Vec3], quads: &[[u32; 4]], ctx: &Context<'_>) -> Result<Vec<[u32; 3]>> {
    let mut triangles = Vec::with_capacity(quads.len() * 2);
    for (i, &[a, b, c, d]) in quads.iter().enumerate() {
        ctx.check_at(i)?;
        if a == b || b == c || c == d || d == a || a == c || b == d {
            continue;
        }
        let at = |i: u32| positions[i as usize];
        if at(a).dist2(at(c)) <= at(b).dist2(at(d)) {
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        } else {
            triangles.push([a, b, d]);
            triangles.push([b, c, d]);
        }
    }
    Ok(triangles)
}

/// Takes away all triangles at an edge of more than two; the hole is closed later if it is small. So do
/// neighbours that face opposite ways where the surface has two sides: there a stray chart joins one side to
/// the other.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn drop_non_manifold(
    triangles: &mut Vec<[u32; 3]>,
    one_sided: bool,
    ctx: &Context<'_>,
) -> Result<()> {
    let bad_edge = |edge: &[HalfEdge]| match edge {
        [_] => false,
        [x, y] => !one_sided && x.runs_as(*y, triangles),
        _ => true,
    };
    let mut bad = vec![false; triangles.len()];
    for edge in Edges::new(triangles, ctx)?.iter().filter(|edge| bad_edge(edge)) {
        edge.iter().for_each(|h| bad[h.face()] = true);
    }
    ctx.check()?;
    remove_marked(triangles, &bad);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    #[test]
    fn three_triangles_at_an_edge_go_and_two_stay() {
        let run = |mut t: Vec<[u32; 3]>, one_sided| {
            Run::default().execute(|ctx| drop_non_manifold(&mut t, one_sided, ctx)).unwrap();
            t.len()
        };
        assert_eq!(run(vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]], true), 0);
        assert_eq!(run(vec![[0, 1, 2], [1, 0, 3]], false), 2);
        // Two that face opposite ways stay on a one-sided surface only.
        assert_eq!(run(vec![[0, 1, 2], [0, 1, 3]], true), 2);
        assert_eq!(run(vec![[0, 1, 2], [0, 1, 3]], false), 0);
    }
}
