//! A mesh of the caller: borrowed arrays, copied into the core's [`TriMesh`] and the columns beside it.

use crate::arrays::{ATLASFIT_F32, Colors, MOST, checked_count, colors, packed, positions};
use crate::sized::{self, Sized};
use crate::status::{Outcome, atlasfit_status, guard};
use atlasfit::geometry::TriMesh;
use std::ffi::c_void;

/// A triangle mesh, borrowed for the call and never changed. Fill it with atlasfit_mesh_init(), then set what
/// there is.
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
    /// Texture coordinates: u, v of each corner of each triangle (6 floats per triangle), v up. NULL = none.
    /// Read by atlasfit_measure_uv(), atlasfit_bake(), and atlasfit_unwrap() with keep_uv_seams.
    pub corner_uv: *const f32,
    /// A group (material, for example) per triangle: no UV chart spans two. NULL = one group. Read by
    /// atlasfit_unwrap().
    pub face_group: *const u32,
    /// The polygon that each triangle was cut from; any numbers name polygons. Triangles of one polygon stay
    /// in one chart. NULL = each triangle is a polygon. Read by atlasfit_unwrap().
    pub face_polygon: *const u32,
    /// Edges that must be seams, as pairs of vertex indices; a pair that is no edge is left out. NULL = none.
    /// Read by atlasfit_unwrap().
    pub seam_edges: *const u32,
    /// Number of seam edges.
    pub seam_edge_count: usize,
    /// The page that each triangle's UVs are on, 0 to 4095. NULL = all are on page 0. Read by
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
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_mesh {
    const NAME: &str = "atlasfit_mesh";
    const FIRST: usize = size_of::<Self>();
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

/// A mesh as the core's, and the columns that the core's has no place for.
pub(crate) struct Mesh {
    pub mesh: TriMesh,
    pub face_page: Option<Vec<u32>>,
    pub page_size: [f64; 2],
    pub face_group: Option<Vec<u32>>,
    pub face_polygon: Option<Vec<u32>>,
    pub seam_edges: Option<Vec<[u32; 2]>>,
}

/// The caller's mesh as the core's; indices are checked there.
pub(crate) unsafe fn mesh(mesh: *const atlasfit_mesh) -> Outcome<Mesh> {
    let m = unsafe { sized::read(mesh) }?;
    sized::zero(m.reserved)?;
    checked_count(m.vertex_count, MOST, "vertices")?;
    checked_count(m.triangle_count, MOST / 3, "triangles")?;
    checked_count(m.seam_edge_count, MOST, "seam edges")?;
    // SAFETY: the caller's arrays have an entry per vertex or triangle.
    unsafe {
        let positions = positions(m.positions, m.vertex_count, m.stride, m.scalar)?;
        let triangles = packed(m.triangles.cast::<[u32; 3]>(), m.triangle_count, "triangles")?;
        let corner_uv = if m.corner_uv.is_null() {
            None
        } else {
            Some(packed(m.corner_uv.cast::<[[f32; 2]; 3]>(), m.triangle_count, "corner_uv")?)
        };
        let column = |base: *const u32, name: &str| {
            if base.is_null() { Ok(None) } else { packed(base, m.triangle_count, name).map(Some) }
        };
        let face_page = column(m.face_page, "face_page")?;
        let colors = colors(Colors {
            base: m.colors,
            count: m.vertex_count,
            stride: m.color_stride,
            scalar: m.color_scalar,
            width: m.color_width,
        })?;
        let face_group = column(m.face_group, "face_group")?;
        let face_polygon = column(m.face_polygon, "face_polygon")?;
        let seam_edges = if m.seam_edge_count == 0 {
            None
        } else {
            Some(packed(m.seam_edges.cast::<[u32; 2]>(), m.seam_edge_count, "seam_edges")?)
        };
        Ok(Mesh {
            mesh: TriMesh { corner_uv, colors, ..TriMesh::new(positions, triangles) },
            face_page,
            page_size: if [m.page_width, m.page_height] == [0; 2] {
                [1.0; 2]
            } else {
                [m.page_width, m.page_height].map(f64::from)
            },
            face_group,
            face_polygon,
            seam_edges,
        })
    }
}
