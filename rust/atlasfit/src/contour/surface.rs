//! The surface in the making, as data: quads as they are contoured, and the triangles that are made of them.

use crate::numeric::vec3::Vec3;

/// A contoured surface before cleaning.
#[derive(Debug, Clone, Default)]
pub(crate) struct Contour {
    /// The vertices.
    pub(super) vertices: ContourVertices,
    /// Quads.
    pub(super) quads: Vec<[u32; 4]>,
}

/// The vertices of a contoured surface: one entry of each list per vertex.
#[derive(Debug, Clone, Default)]
pub(super) struct ContourVertices {
    /// Positions.
    pub(super) positions: Vec<Vec3>,
    /// Unit normals from the charts, in the gauge of the vertex's block.
    pub(super) normals: Vec<Vec3>,
    /// The chart that weighs most there.
    pub(super) chart: Vec<u32>,
    /// Whether the vertex lies where the field was filled in rather than known from charts.
    pub(super) filled: Vec<bool>,
    /// Blended mask, in [0, 1], or `CONTOUR.off_band`: below `CONTOUR.end_of_data` the vertex is beyond the
    /// end of the data.
    pub(super) support: Vec<f32>,
}

/// A triangle mesh in the making.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surface {
    /// Vertex positions.
    pub(crate) positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub(crate) normals: Vec<Vec3>,
    /// Chart that weighs most at each vertex.
    pub(crate) chart: Vec<u32>,
    /// Triangles.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// The positions of a triangle's corners.
#[inline]
pub(crate) fn corners(positions: &[Vec3], triangle: &[u32; 3]) -> [Vec3; 3] {
    triangle.map(|v| positions[v as usize])
}

/// Takes away the triangles that are marked.
pub(super) fn remove_marked(triangles: &mut Vec<[u32; 3]>, marked: &[bool]) {
    let mut marked = marked.iter();
    triangles.retain(|_| !marked.next().unwrap_or(&false));
}
