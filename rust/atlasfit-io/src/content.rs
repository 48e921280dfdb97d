//! What a reader gives back: plain data, the same for every format.

use atlasfit::geometry::PointCloud;

/// The faces of a file as polygons: what its triangles were cut from.
///
/// ```
/// use atlasfit_io::{LoadOptions, load_bytes};
/// # fn main() -> atlasfit_io::Result<()> {
/// let obj = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
/// let loaded = load_bytes("square.obj".as_ref(), obj, &LoadOptions::default())?;
/// assert_eq!(loaded.faces.len(), 2);
/// let polygons = loaded.polygons.expect("a face of four corners");
/// assert_eq!(polygons.sizes, [4]);
/// assert_eq!(polygons.of_triangles(), [0, 0]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Polygons {
    /// Corners per face, at least 3, in file order. A face of n corners is n - 2 of the triangles, in the
    /// same order.
    pub sizes: Vec<u32>,
    /// The corners of all faces, one face after the other: indices of vertices.
    pub corners: Vec<u32>,
}

impl Polygons {
    /// The polygon that each triangle was cut from: one index into [`Self::sizes`] per triangle.
    #[must_use]
    pub fn of_triangles(&self) -> Vec<u32> {
        (self.sizes.iter().zip(0u32..))
            .flat_map(|(&n, i)| std::iter::repeat_n(i, n.saturating_sub(2) as usize))
            .collect()
    }
}

/// The columns of the faces.
#[derive(Default)]
pub(crate) struct FaceColumns {
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates per corner of each triangle, v up.
    pub corner_uv: Option<Vec<[[f32; 2]; 3]>>,
    /// Numbers of normals per corner of each triangle, counted from 1; 0 for none. A reader turns them into
    /// `corner_normals`.
    pub corner_normal: Option<Vec<[u32; 3]>>,
    /// Unit normals per corner of each triangle, where those of a vertex differ.
    pub corner_normals: Option<Vec<[[f32; 3]; 3]>>,
    /// UV chart per triangle.
    pub chart: Option<Vec<u32>>,
    /// `None` if all faces are triangles.
    pub polygons: Option<Polygons>,
}

impl FaceColumns {
    /// Looks the corners' normals up by their numbers; a corner without one has its vertex's.
    pub fn look_up_normals(&mut self, normals: &[[f32; 3]], of_vertices: &[[f32; 3]]) {
        let Some(rows) = self.corner_normal.take() else { return };
        let look_up = |number: u32, v: u32| {
            let known = (number as usize).checked_sub(1).and_then(|i| normals.get(i));
            known.or_else(|| of_vertices.get(v as usize)).copied().unwrap_or_default()
        };
        let corners = self.triangles.iter().zip(rows);
        self.corner_normals =
            Some(corners.map(|(t, row)| [0, 1, 2].map(|k| look_up(row[k], t[k]))).collect());
    }
}

/// What a reader gives back.
#[derive(Default)]
pub(crate) struct Content {
    /// The points, or the vertices of a mesh. Each column is as long as the positions.
    pub cloud: PointCloud,
    pub faces: FaceColumns,
    /// The bytes of an image file.
    pub texture: Option<Vec<u8>>,
    /// What the file holds besides, in words.
    pub left_out: Vec<String>,
}
