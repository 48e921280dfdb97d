//! One hole filled: the triangulation of its boundary with the least area.
//!
//! In: a ring of vertices. Out: triangles that fill it. The least area bends least for the small holes that
//! are meant (dynamic programming; Barequet and Sharir 1995, Liepa 2003). A triangle that would repeat an
//! edge of the surface is never used, so the result stays manifold.

use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::triangle::area_vector;

/// Edges of the surface that a filling must not use again, sorted.
pub(super) struct TakenEdges(Vec<(u32, u32)>);

impl TakenEdges {
    /// The edges between two vertices that are marked.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn among(marked: &[bool], triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Self> {
        let mut taken = Vec::new();
        for t in triangles {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                if marked[a as usize] && marked[b as usize] {
                    taken.push((a.min(b), a.max(b)));
                }
            }
        }
        sort(&mut taken, ctx)?;
        Ok(Self(taken))
    }
    /// Whether an edge is taken.
    #[inline]
    pub(super) fn contains(&self, a: u32, b: u32) -> bool {
        self.0.binary_search(&(a.min(b), a.max(b))).is_ok()
    }
}

/// A filling.
pub(super) struct Patch {
    /// Triangles.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Their area.
    pub(super) area: f64,
}

/// Area of the triangle of three points.
pub(super) fn area(corners: [Vec3; 3]) -> f64 {
    0.5 * area_vector(corners).norm()
}

/// The triangulation of a closed polygon with the least area, by edges at most `longest` long that are not
/// taken; `None` where there is none.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn of_least_area(
    positions: &[Vec3],
    ring: &[u32],
    longest: f64,
    taken: &TakenEdges,
    ctx: &Context<'_>,
) -> Result<Option<Patch>> {
    let n = ring.len();
    let at = |i: usize| positions[ring[i] as usize];
    let free = |i: usize, j: usize| {
        let neighbours = j == i + 1 || (i == 0 && j == n - 1);
        neighbours || (at(i).dist2(at(j)) <= longest * longest && !taken.contains(ring[i], ring[j]))
    };
    let mut cost = vec![f64::INFINITY; n * n];
    let mut split = vec![0u32; n * n];
    for i in 0..n - 1 {
        cost[i * n + i + 1] = 0.0;
    }
    for span in 2..n {
        ctx.check()?;
        for i in 0..n - span {
            let j = i + span;
            if !free(i, j) {
                continue;
            }
            for k in i + 1..j {
                // The second is far away in memory.
                if cost[i * n + k] >= cost[i * n + j] {
                    continue;
                }
                let below = cost[i * n + k] + cost[k * n + j];
                if below >= cost[i * n + j] {
                    continue;
                }
                let c = below + area([at(i), at(k), at(j)]);
                if c < cost[i * n + j] {
                    cost[i * n + j] = c;
                    split[i * n + j] = k as u32;
                }
            }
        }
    }
    if !cost[n - 1].is_finite() {
        return Ok(None);
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut stack = vec![(0, n - 1)];
    while let Some((i, j)) = stack.pop() {
        if j < i + 2 {
            continue;
        }
        let k = split[i * n + j] as usize;
        triangles.push([ring[i], ring[k], ring[j]]);
        stack.push((i, k));
        stack.push((k, j));
    }
    Ok(Some(Patch { triangles, area: cost[n - 1] }))
}
