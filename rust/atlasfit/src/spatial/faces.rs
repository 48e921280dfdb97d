//! Triangles in a tree, and which of them meet.
//!
//! In: positions and triangles. Out: the triangles' corners and a tree of their boxes; those triangles that
//! meet others elsewhere than at shared vertices and edges. Tests are exact.

use super::bvh::{Aabb, Bvh};
use super::triangle::{area_vector, segment_meets};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Triangles looked at between two checks.
const CHECK: usize = 512;
/// Two triangles at an edge whose normals' cosine is below this lie on each other. Source: chosen, close to
/// -1.
const FOLDED: f64 = -0.999_999;

/// A vertex is on one side of a plane for sure where its distance, times twice the area of the triangle that
/// spans the plane, is above this share of the product of the three lengths that make it. Source: derived,
/// some 50 roundings of 2e-16.
const SURELY: f64 = 1e-13;

/// Triangles in a tree.
pub(crate) struct Faces<'a> {
    pub(crate) positions: &'a [Vec3],
    pub(crate) triangles: &'a [[u32; 3]],
    /// The corners of each triangle.
    pub(crate) corners: Vec<[Vec3; 3]>,
    pub(crate) tree: Bvh,
}

impl<'a> Faces<'a> {
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn new(positions: &'a [Vec3], triangles: &'a [[u32; 3]], ctx: &Context<'_>) -> Result<Self> {
        let mut corners = Vec::with_capacity(triangles.len());
        let mut boxes = Vec::with_capacity(triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            ctx.check_at(i)?;
            let at = t.map(|v| positions[v as usize]);
            corners.push(at);
            boxes.push(Aabb::of(&at));
        }
        Ok(Self { positions, triangles, corners, tree: Bvh::build(&boxes, ctx)? })
    }

    /// Along a triangle's normal.
    pub(crate) fn normal(&self, triangle: u32) -> Vec3 {
        area_vector(self.corners[triangle as usize]).normalized()
    }

    /// Those of the triangles `of` that meet others elsewhere than at shared vertices and edges.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn meeting(&self, of: &[u32], ctx: &Context<'_>) -> Result<Vec<u32>> {
        let found = of
            .par_chunks(CHECK)
            .map(|chunk| {
                ctx.check()?;
                Ok(chunk.iter().copied().filter(|&t| self.meets(t)).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(found.concat())
    }

    /// Whether a triangle meets another elsewhere than at what they share.
    fn meets(&self, t: u32) -> bool {
        let (triangle, at) = (self.triangles[t as usize], &self.corners[t as usize]);
        let end = self.tree.meeting(&Aabb::of(at), |u| {
            let (other, corners) = (self.triangles[u as usize], &self.corners[u as usize]);
            if u != t && meet((triangle, at), (other, corners)) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        end.is_break()
    }
}

/// The triangles whose box meets any of these.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn near(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    boxes: &[Aabb],
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let tree = Bvh::build(boxes, ctx)?;
    let meets_any = |t: &[u32; 3]| {
        let own = Aabb::of(&t.map(|v| positions[v as usize]));
        let met = |b: u32| match boxes[b as usize].meets(&own) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        tree.meeting(&own, met).is_break()
    };
    let found = triangles
        .par_chunks(CHECK)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            let near = chunk.iter().enumerate().filter(|(_, t)| meets_any(t));
            Ok(near.map(|(i, _)| (c * CHECK + i) as u32).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.concat())
}

/// Whether two triangles, each given by its vertices and where they are, meet elsewhere than at what they
/// share.
fn meet((a, p): ([u32; 3], &[Vec3; 3]), (b, q): ([u32; 3], &[Vec3; 3])) -> bool {
    if !Aabb::of(p).meets(&Aabb::of(q)) {
        return false;
    }
    let shared = a.iter().filter(|v| b.contains(v)).count();
    let normal = |t: &[Vec3; 3]| area_vector(*t).normalized();
    match shared {
        // Most are told apart without exact arithmetic.
        0 | 1 if on_one_side((a, p), (b, q)) || on_one_side((b, q), (a, p)) => false,
        // Only the sides opposite to the shared vertex, or all sides.
        0 | 1 => crosses((a, p), (b, q)) || crosses((b, q), (a, p)),
        2 => normal(p).dot(normal(q)) < FOLDED,
        _ => true,
    }
}

/// Whether all vertices of the second that are not the first's lie strictly on one side of its plane, for
/// sure.
fn on_one_side((a, p): ([u32; 3], &[Vec3; 3]), (b, q): ([u32; 3], &[Vec3; 3])) -> bool {
    let longest = |v: Vec3| v[0].abs().max(v[1].abs()).max(v[2].abs());
    let (ab, ac) = (p[1] - p[0], p[2] - p[0]);
    let normal = ab.cross(ac);
    let sure = SURELY * longest(ab) * longest(ac);
    let side = |q: Vec3| {
        let to = q - p[0];
        let (height, sure) = (normal.dot(to), sure * longest(to));
        if height > sure { 1 } else { -i32::from(height < -sure) }
    };
    let mut sides = (0..3).filter(|&k| !a.contains(&b[k])).map(|k| side(q[k]));
    let first = sides.next().unwrap_or(0);
    first != 0 && sides.all(|s| s == first)
}

/// Whether a side of the first that shares no vertex with the second crosses it.
fn crosses((a, p): ([u32; 3], &[Vec3; 3]), (b, q): ([u32; 3], &[Vec3; 3])) -> bool {
    (0..3).any(|k| {
        let j = (k + 1) % 3;
        !b.contains(&a[k]) && !b.contains(&a[j]) && segment_meets(p[k], p[j], q)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use proptest::prelude::*;

    fn meeting(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<u32> {
        let at: Vec<Vec3> = positions.iter().copied().map(Vec3).collect();
        let all: Vec<u32> = (0..triangles.len() as u32).collect();
        Run::default().execute(|ctx| Faces::new(&at, triangles, ctx)?.meeting(&all, ctx)).unwrap()
    }

    #[test]
    fn neighbours_share_what_they_share_and_meet_nowhere_else() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.3], [-1.0, -1.0, 0.0]];
        let fan = [[0, 1, 2], [2, 1, 3], [0, 2, 4]];
        assert!(meeting(&corners, &fan).is_empty());
        let folded = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.1, 0.0]];
        assert_eq!(meeting(&folded, &[[0, 1, 2], [2, 1, 3]]), [0, 1], "folded onto each other");
        assert_eq!(meeting(&corners, &[[0, 1, 2], [1, 2, 0]]), [0, 1], "the same face twice");
        let pierced = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.5], [0.3, 0.3, -0.5]];
        assert_eq!(meeting(&pierced, &[[0, 1, 2], [0, 3, 4]]), [0, 1], "at one shared vertex");
    }

    proptest! {
        /// By whether any of many segments in one crosses the other.
        #[test]
        fn two_triangles_meet_where_segments_of_one_cross_the_other(
            v in prop::array::uniform18(-1.0f64..1.0),
        ) {
            let at = |k: usize| [v[3 * k], v[3 * k + 1], v[3 * k + 2]];
            let corners: Vec<[f64; 3]> = (0..6).map(at).collect();
            let found = !meeting(&corners, &[[0, 1, 2], [3, 4, 5]]).is_empty();
            let t = [0, 1, 2].map(|k| Vec3(corners[k]));
            let u = [3, 4, 5].map(|k| Vec3(corners[k]));
            let steps = 40;
            let spread = |t: [Vec3; 3], k: usize, i: usize| {
                let share = i as f64 / steps as f64;
                [t[k], t[(k + 1) % 3] * (1.0 - share) + t[(k + 2) % 3] * share]
            };
            let all = (0..3).flat_map(|k| (0..=steps).map(move |i| (k, i)));
            let crossed = all.into_iter().any(|(k, i)| {
                let ([p, q], [r, s]) = (spread(t, k, i), spread(u, k, i));
                segment_meets(p, q, &u) || segment_meets(r, s, &t)
            });
            prop_assert_eq!(found, crossed);
        }
    }
}
