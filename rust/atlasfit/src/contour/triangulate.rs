//! Quads cut into triangles, and triangles taken away where they are not manifold.
//!
//! In: quads with their positions. Out: triangles with every edge in at most two of them.

use super::surface::remove_marked;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::{Edges, HalfEdge};

/// Cuts each quad along its shorter diagonal. A quad with the same vertex at two neighbouring corners is a
/// triangle; others that use a vertex twice are left out.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn split(positions: &[Vec3], quads: &[[u32; 4]], ctx: &Context<'_>) -> Result<Vec<[u32; 3]>> {
    let mut triangles = Vec::with_capacity(quads.len() * 2);
    for (i, &[a, b, c, d]) in quads.iter().enumerate() {
        ctx.check_at(i)?;
        if a == c || b == d {
            continue;
        }
        if a == b || b == c || c == d || d == a {
            // The corners without the one that repeats its neighbour: three, if only two are the same.
            let corners = if a == b || b == c { [a, c, d] } else { [a, b, c] };
            if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
                triangles.push(corners);
            }
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
    fn a_quad_with_the_same_vertex_twice_in_a_row_is_a_triangle() {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(Vec3);
        let split = |q| Run::default().execute(|ctx| split(&positions, &[q], ctx)).unwrap();
        for q in [[0, 0, 1, 2], [0, 1, 1, 2], [0, 1, 2, 2], [0, 1, 2, 0]] {
            assert_eq!(split(q), [[0, 1, 2]], "{q:?}");
        }
        assert_eq!(split([0, 1, 2, 3]).len(), 2);
        for q in [[0, 1, 0, 2], [0, 0, 1, 1], [0, 0, 0, 1]] {
            assert!(split(q).is_empty(), "{q:?}");
        }
    }

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
