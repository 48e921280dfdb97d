//! A mesh of the caller: borrowed arrays, copied into the core's [`TriMesh`] and the columns beside it.

use crate::arrays::{
    ATLASFIT_F32, Colors, MOST, Positions, checked_count, colors, column, packed, positions,
};
use crate::faces::{self, Faces, atlasfit_faces};
use crate::sized::{self, Sized};
use crate::status::{Failure, Outcome, atlasfit_status, guard};
use atlasfit::Context;
use atlasfit::geometry::{Polygons, TriMesh};
use std::ffi::c_void;

/// A mesh, borrowed for the call and never changed. Fill it with atlasfit_mesh_init(), then set what there
/// is. Its faces are `triangles`, or `faces` of any number of corners, which are cut into triangles that do
/// not fold: quads along the shorter diagonal, others by ear clipping. A face of fewer than three corners
/// has no triangle.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_mesh {
    /// sizeof(atlasfit_mesh).
    pub struct_size: usize,
    /// Vertex positions: x, y, z of each, of type `scalar`, in any unit.
    pub positions: *const c_void,
    /// Number of vertices, below 2^32 - 1.
    pub vertex_count: usize,
    /// Bytes from one vertex to the next; 0 = tightly packed.
    pub stride: usize,
    /// Type of the positions: #ATLASFIT_F32 or #ATLASFIT_F64. Default #ATLASFIT_F32.
    pub scalar: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Three vertex indices per triangle, counter-clockwise seen from outside.
    pub triangles: *const u32,
    /// Number of triangles, below 2^32 / 3.
    pub triangle_count: usize,
    /// Texture coordinates: u, v of each corner of each face (6 floats per triangle), v up. NULL = none.
    /// Read by atlasfit_measure_uv(), atlasfit_bake(), atlasfit_simplify(), and atlasfit_unwrap() with
    /// keep_uv_seams or keep_uvs.
    pub corner_uv: *const f32,
    /// A group (material, for example) per face: no UV chart spans two. NULL = one group. Read by
    /// atlasfit_unwrap().
    pub face_group: *const u32,
    /// The polygon that each triangle was cut from; any numbers name polygons. Triangles of one polygon stay
    /// in one chart. NULL = each triangle is a polygon. Not with `faces`, which are the polygons. Read by
    /// atlasfit_unwrap().
    pub face_polygon: *const u32,
    /// Edges that must be seams, as pairs of vertex indices; a pair that is no edge is left out. NULL = none.
    /// Read by atlasfit_unwrap().
    pub seam_edges: *const u32,
    /// Number of seam edges.
    pub seam_edge_count: usize,
    /// The page that each face's UVs are on, 0 to 4095. NULL = all are on page 0. Read by
    /// atlasfit_measure_uv() and atlasfit_bake().
    pub face_page: *const u32,
    /// Width of a page, in texels or any other unit; 0, with a height of 0 = pages are square. Read by
    /// atlasfit_measure_uv().
    pub page_width: u32,
    /// Height of a page, in the unit of page_width.
    pub page_height: u32,
    /// Colours of the vertices. NULL = none. Read by atlasfit_bake().
    pub colors: *const c_void,
    /// Bytes from one colour to the next; 0 = tightly packed.
    pub color_stride: usize,
    /// Type of the colours: #ATLASFIT_F32 (0 to 1) or #ATLASFIT_U8 (0 to 255). Default #ATLASFIT_F32.
    pub color_scalar: u32,
    /// Colour channels: 3 (red, green, blue) or 4 (and alpha). Default 4.
    pub color_width: u32,
    /// Bytes from x to y to z of a vertex, where they lie apart; `stride` is then from x to x, 0 = tightly
    /// packed. 0 = x, y, z lie beside each other. Default 0.
    pub component_stride: usize,
    /// The faces, with `triangles` NULL: polygons, or triangles with indices of other types or strides.
    pub faces: atlasfit_faces,
    /// A byte per face, not 0 where the face is to be ignored: as if it had no triangle, but it keeps its
    /// number. NULL = none is. Default NULL.
    pub face_ignored: *const u8,
    /// What a UV seam costs per unit of its length at each vertex, finite, not negative; an edge costs the
    /// mean of its ends. 1 as usual, less where seams may be, more where not: only ratios count. NULL = the
    /// same everywhere. Read by atlasfit_unwrap(), not with keep_uvs. Default NULL.
    pub seam_price: *const f32,
    /// Triangles in UVs of the first page, 6 numbers each, that the charts of atlasfit_unwrap() keep free of,
    /// with the padding: for example those of faces that are not laid out anew. Finite; what lies outside
    /// the page does not count. Charts are then packed by their shapes; where no room is left for them the
    /// call fails with #ATLASFIT_INVALID_ARGUMENT. NULL = the page is free. Default NULL.
    pub occupied_uv: *const f32,
    /// Number of those triangles. Default 0.
    pub occupied_count: usize,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_mesh {
    const NAME: &str = "atlasfit_mesh";
    const FIRST: usize = std::mem::offset_of!(Self, component_stride);
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            positions: std::ptr::null(),
            vertex_count: 0,
            stride: 0,
            scalar: ATLASFIT_F32,
            reserved: 0,
            triangles: std::ptr::null(),
            triangle_count: 0,
            corner_uv: std::ptr::null(),
            face_group: std::ptr::null(),
            face_polygon: std::ptr::null(),
            seam_edges: std::ptr::null(),
            seam_edge_count: 0,
            face_page: std::ptr::null(),
            page_width: 0,
            page_height: 0,
            colors: std::ptr::null(),
            color_stride: 0,
            color_scalar: ATLASFIT_F32,
            color_width: 4,
            component_stride: 0,
            faces: atlasfit_faces::NONE,
            face_ignored: std::ptr::null(),
            seam_price: std::ptr::null(),
            occupied_uv: std::ptr::null(),
            occupied_count: 0,
        }
    }
}

/// Fills a mesh with its defaults: no triangle.
///
/// @param mesh        The struct to fill.
/// @param struct_size sizeof(atlasfit_mesh).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_mesh_init(mesh: *mut atlasfit_mesh, struct_size: usize) -> atlasfit_status {
    guard("atlasfit_mesh_init", || unsafe { sized::init(mesh, struct_size) })
}

/// A mesh as the core's, and the columns that the core's has no place for. Its faces are triangles after
/// [`Mesh::cut`].
pub(crate) struct Mesh {
    pub mesh: TriMesh,
    /// What the triangles were cut from; none where they were given.
    pub polygons: Option<Polygons>,
    pub face_page: Option<Vec<u32>>,
    pub page_size: [f64; 2],
    pub face_group: Option<Vec<u32>>,
    pub face_polygon: Option<Vec<u32>>,
    pub seam_edges: Option<Vec<[u32; 2]>>,
    pub seam_price: Option<Vec<f32>>,
    pub occupied: Option<Vec<[[f32; 2]; 3]>>,
    /// Faces that are still to be cut, their corners' UVs, and which are ignored.
    uncut: Option<Faces>,
    uncut_uv: Option<Vec<[f32; 2]>>,
    ignored: Option<Vec<bool>>,
}

impl Mesh {
    /// Cuts the faces into triangles; columns of faces and corners become those of the triangles.
    pub(crate) fn cut(&mut self, ctx: &Context<'_>) -> atlasfit::Result<()> {
        let Some(Faces { corners, offsets }) = self.uncut.take() else { return Ok(()) };
        let cut = Polygons::new(&self.mesh.positions, corners, offsets, self.ignored.as_deref(), ctx)?;
        self.mesh.triangles.clone_from(&cut.triangles);
        self.mesh.corner_uv = self.uncut_uv.take().map(|uv| cut.of_triangle_corners(&uv));
        for column in [&mut self.face_page, &mut self.face_group] {
            *column = column.take().map(|c| cut.of_triangles(&c));
        }
        if cut.offsets.windows(2).any(|w| w[1] - w[0] > 3) {
            self.face_polygon = Some(cut.face_of.clone());
        }
        self.polygons = Some(cut);
        Ok(())
    }

    /// How many faces the caller gave.
    pub(crate) fn faces(&self) -> usize {
        match (&self.uncut, &self.polygons) {
            (Some(uncut), _) => uncut.offsets.len() - 1,
            (_, Some(cut)) => cut.len(),
            _ => self.mesh.triangles.len(),
        }
    }
}

/// The caller's mesh as the core's; indices are checked there.
pub(crate) unsafe fn mesh(mesh: *const atlasfit_mesh) -> Outcome<Mesh> {
    let m = unsafe { sized::read(mesh) }?;
    sized::zero(m.reserved)?;
    checked_count(m.vertex_count, MOST, "vertices")?;
    checked_count(m.triangle_count, MOST / 3, "triangles")?;
    checked_count(m.seam_edge_count, MOST, "seam edges")?;
    // SAFETY: the caller's arrays have an entry per vertex, face or corner.
    unsafe {
        let positions = positions(Positions {
            base: m.positions,
            count: m.vertex_count,
            stride: m.stride,
            component_stride: m.component_stride,
            scalar: m.scalar,
        })?;
        let (triangles, uncut) = given_faces(&m)?;
        let faces = uncut.as_ref().map_or(m.triangle_count, |f| f.offsets.len() - 1);
        let mut out = Mesh {
            mesh: TriMesh::new(positions, triangles),
            polygons: None,
            face_page: column(m.face_page, faces, "face_page")?,
            page_size: if [m.page_width, m.page_height] == [0; 2] {
                [1.0; 2]
            } else {
                [m.page_width, m.page_height].map(f64::from)
            },
            face_group: column(m.face_group, faces, "face_group")?,
            face_polygon: column(m.face_polygon, faces, "face_polygon")?,
            seam_edges: if m.seam_edge_count == 0 {
                None
            } else {
                Some(packed(m.seam_edges.cast::<[u32; 2]>(), m.seam_edge_count, "seam_edges")?)
            },
            seam_price: column(m.seam_price, m.vertex_count, "seam_price")?,
            occupied: if m.occupied_count == 0 {
                None
            } else {
                Some(packed(m.occupied_uv.cast::<[[f32; 2]; 3]>(), m.occupied_count, "occupied_uv")?)
            },
            uncut_uv: match &uncut {
                Some(f) => column(m.corner_uv.cast::<[f32; 2]>(), f.corners.len(), "corner_uv")?,
                None => None,
            },
            ignored: column(m.face_ignored, faces, "face_ignored")?
                .map(|i: Vec<u8>| i.into_iter().map(|b| b != 0).collect()),
            uncut,
        };
        if out.uncut.is_none() {
            out.mesh.corner_uv = column(m.corner_uv.cast::<[[f32; 2]; 3]>(), faces, "corner_uv")?;
        }
        out.mesh.colors = colors(Colors {
            base: m.colors,
            count: m.vertex_count,
            stride: m.color_stride,
            scalar: m.color_scalar,
            width: m.color_width,
        })?;
        Ok(out)
    }
}

/// The triangles of a mesh, or else its faces: where they are given as such, or some are ignored.
unsafe fn given_faces(m: &atlasfit_mesh) -> Outcome<(Vec<[u32; 3]>, Option<Faces>)> {
    // SAFETY: the caller's arrays.
    unsafe {
        if let Some(faces) = faces::faces(&m.faces)? {
            if !m.triangles.is_null() || m.triangle_count != 0 || !m.face_polygon.is_null() {
                return Err(Failure::invalid(
                    "faces are given, and triangles or face_polygon too. Give either",
                ));
            }
            return Ok((Vec::new(), Some(faces)));
        }
        let triangles = packed(m.triangles.cast::<[u32; 3]>(), m.triangle_count, "triangles")?;
        if m.face_ignored.is_null() {
            return Ok((triangles, None));
        }
        let offsets = (0..=triangles.len() as u32).map(|i| 3 * i).collect();
        Ok((Vec::new(), Some(Faces { corners: triangles.into_flattened(), offsets })))
    }
}
