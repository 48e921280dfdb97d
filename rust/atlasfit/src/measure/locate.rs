//! Exact distance from points to a triangle mesh.
//!
//! In: positions and triangles. Out: nearest triangle, foot point, distance. Arithmetic is f64; the closest
//! point on a triangle is by Voronoi regions (Ericson 2004, "Real-Time Collision Detection", 5.1.5), with a
//! fall-back to the three sides where the triangle has no area.

use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use rayon::prelude::*;

/// Queries per task, between two looks at the cancel flag: one far from the mesh takes up to 30 us.
const BLOCK: usize = 256;

/// The nearest point of a mesh to a query.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Foot {
    /// Index of the triangle in the mesh.
    pub triangle: u32,
    /// The nearest point on it.
    pub point: Vec3,
    /// Its squared distance to the query.
    pub distance2: f64,
}

/// Where the square of twice a triangle's area is below this times the fourth power of its longer side at the
/// first corner, the weights of its corners are lost in rounding (2e-16 each): its sides are searched
/// instead. Derived.
const NO_AREA: f64 = 1e-14;

/// A mesh prepared for distance queries. Triangles with a corner that is not finite are left out.
///
/// ```
/// use atlasfit::{Run, Vec3, geometry::TriMesh, measure::Locator};
/// let mesh = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// let locator = Run::default().execute(|ctx| Locator::new(&mesh, ctx))?;
/// let foot = locator.nearest(Vec3([0.2, 0.2, 2.0])).unwrap();
/// assert_eq!((foot.triangle, foot.distance2), (0, 4.0));
/// # Ok::<(), atlasfit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Locator {
    corners: Vec<[Vec3; 3]>,
    triangle: Vec<u32>,
    tree: Bvh,
}

impl Locator {
    /// Prepares a mesh.
    ///
    /// # Errors
    /// [`Error::IndexOutOfRange`]; [`Error::EmptyInput`] where no triangle is finite; cancel and time limit.
    pub fn new(mesh: &TriMesh, ctx: &Context<'_>) -> Result<Self> {
        mesh.validate()?;
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        let mut triangle = Vec::with_capacity(mesh.triangles.len());
        for (i, t) in mesh.triangles.iter().enumerate() {
            ctx.check_at(i)?;
            let c = t.map(|v| Vec3(mesh.positions[v as usize]));
            if c.iter().flat_map(|p| p.iter()).all(|x| x.is_finite()) {
                corners.push(c);
                triangle.push(i as u32);
            }
        }
        if corners.is_empty() {
            return Err(Error::empty(
                format!("none of {} triangles has finite corners", mesh.triangles.len()),
                "Give a mesh with faces",
            ));
        }
        let boxes: Vec<Aabb> = corners.par_iter().map(|c| Aabb::of(c)).collect();
        ctx.check()?;
        Ok(Self { tree: Bvh::build(&boxes, ctx)?, corners, triangle })
    }

    /// The nearest point of the mesh; `None` where the query is not finite.
    #[must_use]
    pub fn nearest(&self, query: Vec3) -> Option<Foot> {
        if !query.iter().all(|x| x.is_finite()) {
            return None;
        }
        let (i, distance2) = self.tree.nearest(query, f64::INFINITY, |i| {
            query.dist2(closest_on_triangle(query, &self.corners[i as usize]))
        })?;
        let point = closest_on_triangle(query, &self.corners[i as usize]);
        Some(Foot { triangle: self.triangle[i as usize], point, distance2 })
    }

    /// [`Self::nearest`] of many points, in parallel. Points that are not finite give `None`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::TimedOut`].
    pub fn nearest_all(&self, queries: &[Vec3], ctx: &Context<'_>) -> Result<Vec<Option<Foot>>> {
        let blocks = queries
            .par_chunks(BLOCK)
            .map(|block| {
                ctx.check()?;
                ctx.advance(block.len());
                Ok(block.iter().map(|q| self.nearest(*q)).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(blocks.concat())
    }
}

/// The point of a triangle that is nearest to `p`.
fn closest_on_triangle(p: Vec3, t: &[Vec3; 3]) -> Vec3 {
    let [a, b, c] = *t;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc < 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb < 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va < 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    let side2 = ab.norm2().max(ac.norm2());
    if sum > NO_AREA * side2 * side2 {
        return a + (ab * (vb / sum) + ac * (vc / sum));
    }
    [(a, b), (b, c), (c, a)]
        .map(|(s, e)| closest_on_segment(p, s, e))
        .into_iter()
        .min_by(|x, y| p.dist2(*x).total_cmp(&p.dist2(*y)))
        .unwrap_or(a)
}

fn closest_on_segment(p: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let ab = b - a;
    let length2 = ab.norm2();
    if length2 > 0.0 { a + ab * ((p - a).dot(ab) / length2).clamp(0.0, 1.0) } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use proptest::prelude::*;

    /// The distance by a fine grid of points of the triangle, an upper bound that converges.
    fn by_grid(p: Vec3, t: &[Vec3; 3], n: usize) -> f64 {
        let mut best = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n - i {
                let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
                let q = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
                best = best.min(p.dist2(q));
            }
        }
        best.sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn closest_point_is_on_the_triangle_and_nearest(
            v in prop::array::uniform12(-1.0f64..1.0),
            flat in 0u8..4,
        ) {
            let at = |k: usize| Vec3([v[k], v[k + 1], v[k + 2]]);
            let (mut t, p) = ([at(0), at(3), at(6)], at(9));
            match flat {
                1 => t[2] = t[0] + (t[1] - t[0]) * v[6],
                2 => t[1] = t[0],
                3 => t = [t[0]; 3],
                _ => {}
            }
            let d = (p - closest_on_triangle(p, &t)).norm();
            let grid = by_grid(p, &t, 60);
            prop_assert!(d <= grid + 1e-9, "{d} {grid}");
            prop_assert!(d >= grid - 0.08, "{d} {grid}");
        }
    }

    #[test]
    fn triangles_that_are_not_finite_are_left_out_and_keep_the_numbering() {
        let mesh = TriMesh::new(
            vec![[f64::NAN; 3], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vec![[0, 1, 2], [1, 2, 3]],
        );
        let locator = Run::default().execute(|ctx| Locator::new(&mesh, ctx)).unwrap();
        let foot = locator.nearest(Vec3([0.2, 0.2, 1.0])).unwrap();
        assert_eq!(foot.triangle, 1);
        assert!((foot.distance2 - 1.0).abs() < 1e-15);
        assert_eq!(locator.nearest(Vec3([f64::NAN; 3])), None);
    }
}
