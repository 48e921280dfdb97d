//! What CGAL is asked for.
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
}
