//! What CGAL and OpenMesh are asked for.
//!
//! In: meshes of the core. Out: meshes, pairs of triangles, distances.

use atlasfit::geometry::TriMesh;
use atlasfit::{Context, Result};

/// What CGAL does for meshes. Lengths are in the mesh's unit.
pub trait Cgal: Sync {
    /// A closed shell around a surface, `offset` away from it, into whose hollows a ball of radius `alpha`
    /// does not go (Portaneri et al. 2022, "Alpha wrapping with an offset"): two-manifold, without
    /// self-intersections.
    ///
    /// # Errors
    /// Those of [`TriMesh::validate`] and [`Context::check`]; [`atlasfit::Error::InvalidArgument`] for
    /// lengths that are not positive and vertices that are not finite, [`atlasfit::Error::Degenerate`] for a
    /// mesh without a triangle.
    fn alpha_wrap(&self, surface: &TriMesh, alpha: f64, offset: f64, ctx: &Context<'_>) -> Result<TriMesh>;

    /// Pairs of triangles that meet elsewhere than in corners and edges that they share, ascending, by exact
    /// predicates. Vertices at one place are one; triangles without an area meet nothing.
    ///
    /// # Errors
    /// As above.
    fn self_intersections(&self, mesh: &TriMesh, ctx: &Context<'_>) -> Result<Vec<[u32; 2]>>;

    /// Distances of points from a mesh by rational arithmetic, each rounded once. It looks at every triangle
    /// for every point: for checks of small meshes.
    ///
    /// # Errors
    /// As above.
    fn exact_distances(&self, mesh: &TriMesh, points: &[[f64; 3]], ctx: &Context<'_>) -> Result<Vec<f64>>;

    /// A mesh of the same surface whose triangles have sides of 4/5 to 4/3 of `length`, in some rounds of
    /// splitting, collapsing, flipping and moving along the surface (Botsch and Kobbelt 2004); three are
    /// usual. Vertices on the boundary stay on it. Columns and UVs are left out. It stops within some 50
    /// milliseconds of being asked, as CGAL looks places up all the time, but for the tree over the
    /// triangles that it builds first.
    ///
    /// # Errors
    /// As above, and [`atlasfit::Error::InvalidArgument`] for a mesh that halfedges cannot hold,
    /// [`atlasfit::Error::OutOfMemory`].
    fn remesh(&self, mesh: &TriMesh, length: f64, iterations: u32, ctx: &Context<'_>) -> Result<TriMesh>;
}

/// How a mesh is subdivided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subdivision {
    /// Each triangle becomes four, the surface smooth (Loop 1987).
    Loop,
    /// Each triangle becomes three, turned by half a corner; of boundary edges every second step makes three
    /// (Kobbelt 2000).
    Sqrt3,
}

/// What OpenMesh does for meshes.
pub trait OpenMesh: Sync {
    /// Subdivides a mesh some times. Columns and UVs are left out, and vertices without a triangle. It asks
    /// between two steps whether to stop: a step takes about a second for a million triangles that it makes.
    ///
    /// # Errors
    /// Those of [`TriMesh::validate`] and [`Context::check`]; [`atlasfit::Error::InvalidArgument`] for
    /// vertices that are not finite, a mesh that halfedges cannot hold, and more triangles than 2^32 / 3;
    /// [`atlasfit::Error::Degenerate`] for a mesh without a triangle, [`atlasfit::Error::OutOfMemory`].
    fn subdivide(&self, mesh: &TriMesh, how: Subdivision, times: u32, ctx: &Context<'_>) -> Result<TriMesh>;
}
