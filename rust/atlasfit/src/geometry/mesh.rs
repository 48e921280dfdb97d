//! A triangle mesh with per-vertex attributes and per-corner texture coordinates.

use super::cloud::{Attribute, PointCloud, point_bytes};
use crate::error::{Error, Result};
use crate::numeric::vec3::Vec3;

/// The largest number of pages that the UVs of a mesh may lie on: more are the sign of a damaged file. Each
/// page still has 256 of the texels that coverage is counted on.
pub const MOST_PAGES: u32 = 4096;

/// A triangle mesh. Positions are f64 in the user's unit and frame. Counter-clockwise triangles face outward.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions.
    pub positions: Vec<[f64; 3]>,
    /// Vertex indices, three per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals per vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Red, green, blue, alpha per vertex in [0, 1], encoded as stored (sRGB by convention).
    pub colors: Option<Vec<[f32; 4]>>,
    /// Other attributes per vertex.
    pub attributes: Vec<Attribute>,
    /// Texture coordinates per corner of each triangle, v up.
    pub corner_uv: Option<Vec<[[f32; 2]; 3]>>,
    /// Unit normals per corner of each triangle, where those of a vertex differ between its triangles, as at
    /// creases; then [`Self::normals`] are means of them.
    pub corner_normals: Option<Vec<[[f32; 3]; 3]>>,
    /// UV chart per triangle; `u32::MAX` where there is none.
    pub face_chart: Option<Vec<u32>>,
}

/// Checks that every index of the triangles refers to one of `count` things, which `of` names.
///
/// # Errors
/// [`Error::IndexOutOfRange`] naming the first triangle that does not.
pub(crate) fn check_indices(triangles: &[[u32; 3]], count: usize, of: &'static str) -> Result<()> {
    for (i, t) in triangles.iter().enumerate() {
        if let Some(&bad) = t.iter().find(|&&v| v as usize >= count) {
            return Err(Error::IndexOutOfRange {
                what: format!("triangle {i}"),
                value: u64::from(bad),
                limit: count as u64,
                of,
            });
        }
    }
    Ok(())
}

impl TriMesh {
    /// A mesh of bare positions and triangles.
    #[must_use]
    pub fn new(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, ..Self::default() }
    }

    /// Checks that every index refers to a vertex.
    ///
    /// # Errors
    /// [`Error::IndexOutOfRange`] naming the first triangle that does not.
    pub fn validate(&self) -> Result<()> {
        check_indices(&self.triangles, self.positions.len(), "vertices")
    }

    /// Bytes that its arrays hold.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let of_vertices = point_bytes(&self.positions, &self.normals, &self.colors, &self.attributes);
        let uv = self.corner_uv.as_ref().map_or(0, |uv| size_of_val(&uv[..]));
        let chart = self.face_chart.as_ref().map_or(0, |c| size_of_val(&c[..]));
        let normals = self.corner_normals.as_ref().map_or(0, |n| size_of_val(&n[..]));
        of_vertices + (size_of_val(&self.triangles[..]) + uv + normals + chart) as u64
    }

    /// The vertices as a point cloud with their attributes.
    #[must_use]
    pub fn to_cloud(&self) -> PointCloud {
        PointCloud {
            positions: self.positions.clone(),
            normals: self.normals.clone(),
            colors: self.colors.clone(),
            scanners: None,
            attributes: self.attributes.clone(),
        }
    }
}

/// Unit normal of each vertex of a mesh: the mean of its triangles' normals, weighted by area; zero where
/// there is none. Indices must refer to vertices ([`TriMesh::validate`]).
///
/// ```
/// let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// assert_eq!(atlasfit::geometry::mesh::vertex_normals(&corners, &[[0, 1, 2]])[0], [0.0, 0.0, 1.0]);
/// ```
#[must_use]
pub fn vertex_normals(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| Vec3(positions[v as usize]));
        t.iter().for_each(|&v| sums[v as usize] += (b - a).cross(c - a));
    }
    sums.iter().map(|n| n.normalized().to_f32()).collect()
}
