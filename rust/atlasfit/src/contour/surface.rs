//! A surface while it is being cleaned.

use crate::numeric::vec3::Vec3;

/// A triangle mesh in the making.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Chart that weighs most at each vertex.
    pub chart: Vec<u32>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
}
