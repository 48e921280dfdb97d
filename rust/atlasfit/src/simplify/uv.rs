//! UVs while a mesh is simplified: where they are at a place of the surface, and that no triangle turns over.
//!
//! In: a block. Out: a UV, or whether a change is allowed. Without UVs all is allowed.

use super::block::{Around, Block};
use crate::numeric::vec3::Vec3;
use crate::spatial::triangle::{closest_on_triangle, weights};

/// Twice the area of a triangle of the plane, positive where it runs counter-clockwise.
fn area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

impl Block<'_> {
    /// Whether two vertices are copies of each other, or the same.
    #[inline]
    pub(super) fn same_place(&self, v: u32, w: u32) -> bool {
        self.place[v as usize] == self.place[w as usize]
    }

    /// The UV at the place of the triangles about `ends` that is nearest to `to`.
    pub(super) fn uv_at(&self, to: Vec3, ends: [u32; 2], around: &Around) -> Option<[f64; 2]> {
        if self.uv.is_empty() {
            return None;
        }
        let mut best = (f64::INFINITY, None);
        for f in self.star(ends[0], around).chain(self.star(ends[1], around)) {
            let t = self.triangles[f as usize];
            let corners = self.corners(&t);
            let on = closest_on_triangle(to, &corners);
            let d = on.dist2(to);
            if d < best.0 {
                best = (d, Some((t, weights(on, &corners))));
            }
        }
        let (t, w) = best.1?;
        // As files hold it, so that rounding turns nothing over later.
        Some([0, 1].map(|k| {
            let at: f64 = (0..3).map(|c| w[c] * self.uv[t[c] as usize][k]).sum();
            f64::from(at as f32)
        }))
    }

    /// Whether a triangle faces in UV space as it did, when some of its corners get other UVs. One that had
    /// no area there may have any.
    pub(super) fn keeps_side(&self, t: [u32; 3], moved: impl Fn(u32) -> Option<[f64; 2]>) -> bool {
        if self.uv.is_empty() {
            return true;
        }
        let before = area(t.map(|v| self.uv[v as usize]));
        let after = area(t.map(|v| moved(v).unwrap_or(self.uv[v as usize])));
        before == 0.0 || before * after > 0.0
    }

    /// Whether two triangles may become two others over the same corners: all face one way in UV space.
    pub(super) fn flip_keeps_sides(&self, before: [[u32; 3]; 2], after: [[u32; 3]; 2]) -> bool {
        if self.uv.is_empty() {
            return true;
        }
        let side = |t: [u32; 3]| area(t.map(|v| self.uv[v as usize]));
        let old = before.map(side);
        old[0] * old[1] > 0.0 && after.iter().all(|&t| side(t) * old[0] > 0.0)
    }
}
