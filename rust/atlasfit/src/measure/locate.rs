//! Exact distance from points to a triangle mesh.
//!
//! In: positions and triangles. Out: nearest triangle, foot point, distance.

use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use crate::spatial::triangle::closest_on_triangle;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

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
