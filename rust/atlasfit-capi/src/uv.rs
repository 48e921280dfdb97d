//! What unwrapping made: one handle, its info, getters that copy its arrays.

use crate::arrays::{copy_lines, copy_out};
use crate::buffer::{Column, atlasfit_buffer, copy_to};
use crate::handle::{self, Handle};
use crate::mesh::Mesh;
use crate::sized::{self, Sized};
use crate::status::{ATLASFIT_BUFFER_TOO_SMALL, Failure, atlasfit_status, guard};
use atlasfit::unwrap::{PolygonLayout, SplitCorners, UvLayout};
use atlasfit::{Context, measure};
use std::ffi::c_char;

/// UVs of a mesh. Immutable: any number of threads may read one at once.
pub struct atlasfit_uv(());

/// What a UV handle holds.
pub(crate) struct Layout {
    /// What was found, but for what each face and corner has.
    pub(crate) layout: UvLayout,
    /// Triangles of the mesh.
    triangles: usize,
    /// UV per corner of the faces that were given.
    corner_uv: Vec<[f32; 2]>,
    face_chart: Vec<u32>,
    face_page: Vec<u32>,
    /// Faces whose triangles do not agree on the UVs of their corners, in order.
    torn: Vec<u32>,
    /// The mesh with one vertex per pair of vertex and UV.
    split: SplitCorners,
    coverage: f64,
    /// Of unwrapping alone.
    pub(crate) seconds: f64,
}

impl Layout {
    /// Of the faces as they were given.
    pub(crate) fn new(mut layout: UvLayout, mesh: &Mesh, ctx: &Context<'_>) -> atlasfit::Result<Self> {
        let coverage = measure::uv::coverage(&layout.corner_uv, layout.pages);
        let triangles = layout.corner_uv.len();
        let (vertices, mut torn) = (mesh.mesh.positions.len(), Vec::new());
        let (corner_uv, face_chart, face_page, split);
        if let Some(cut) = &mesh.polygons {
            let of = PolygonLayout::new(cut, &layout, ctx)?;
            split = of.split(cut, vertices, ctx)?;
            (corner_uv, face_chart, face_page, torn) = (of.corner_uv, of.face_chart, of.face_page, of.torn);
        } else {
            split = layout.split(&mesh.mesh, ctx)?.into();
            corner_uv = std::mem::take(&mut layout.corner_uv).into_flattened();
            face_chart = std::mem::take(&mut layout.face_chart);
            face_page = std::mem::take(&mut layout.face_page);
        }
        layout.corner_uv = Vec::new();
        Ok(Self { layout, triangles, corner_uv, face_chart, face_page, torn, split, coverage, seconds: 0.0 })
    }
}

impl Handle for atlasfit_uv {
    type Target = Layout;
    const NAME: &str = "UV layout";
}

/// Frees UVs; NULL is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_free(uv: *mut atlasfit_uv) -> atlasfit_status {
    guard("atlasfit_uv_free", || handle::free(uv))
}

/// What UVs hold.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_uv_info {
    /// sizeof(atlasfit_uv_info), set by the caller.
    pub struct_size: usize,
    /// Triangles that the mesh has, or that its faces were cut into.
    pub triangles: usize,
    /// Charts.
    pub charts: usize,
    /// Pages.
    pub pages: usize,
    /// Vertices of the mesh in its split form.
    pub split_vertices: usize,
    /// Triangles of zero area or with repeated or non-finite vertices; they got small, valid
    /// UV triangles.
    pub degenerate_faces: usize,
    /// Triangles that repeat the corners of an earlier one; they got UVs of their own.
    pub duplicate_faces: usize,
    /// Edges that were cut because more than two triangles, or two of opposite orientation, meet there.
    pub non_manifold_edges: usize,
    /// Charts that had to be cut further to stay free of flips and overlaps.
    pub repaired_charts: usize,
    /// Polygons that could not stay in one piece because they do not lie flat.
    pub split_polygons: usize,
    /// Width of a page in texels.
    pub width: u32,
    /// Height of a page in texels.
    pub height: u32,
    /// Texels per unit of length on the surface.
    pub texels_per_unit: f64,
    /// The stretch bound that was kept: max_stretch, or more where max_charts needed it.
    pub stretch_bound: f64,
    /// Share of the area stretched beyond the bound.
    pub over_stretched: f64,
    /// Share of the pages that lies under triangles.
    pub coverage: f64,
    /// Wall time of unwrapping, in seconds, without the copying of the mesh and the making of the split form.
    pub seconds: f64,
    /// Free texels between charts and at a page's border: the padding asked for, or less where with that the
    /// charts would have had no room.
    pub padding: u32,
    /// Is 0.
    pub reserved: u32,
    /// Faces that were given: polygons or triangles.
    pub faces: usize,
    /// Corners of those faces: three for each triangle.
    pub corners: usize,
    /// Faces that do not lie flat and were cut between charts, so that their triangles do not agree on the
    /// UVs of their corners: see atlasfit_uv_face_torn().
    pub torn_faces: usize,
    /// Vertices at open edges that lie exactly where another one does and were taken for it, for the layout
    /// only.
    pub welded_vertices: usize,
    /// Parts that lie on another one of their shape, as stack of the options asked for.
    pub stacked_parts: usize,
    /// Charts whose sides are straight and parallel to the page's, as straighten of the options asked for.
    pub straightened_charts: usize,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_uv_info {
    const NAME: &str = "atlasfit_uv_info";
    const FIRST: usize = std::mem::offset_of!(Self, padding);
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// Tells what UVs hold.
///
/// @param info Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_get_info(
    uv: *const atlasfit_uv,
    info: *mut atlasfit_uv_info,
) -> atlasfit_status {
    guard("atlasfit_uv_get_info", || unsafe {
        let both = handle::get(uv)?;
        let l = &both.layout;
        let value = atlasfit_uv_info {
            struct_size: size_of::<atlasfit_uv_info>(),
            triangles: both.triangles,
            charts: l.charts,
            pages: l.pages,
            split_vertices: both.split.source.len(),
            degenerate_faces: l.degenerate_faces,
            duplicate_faces: l.duplicate_faces,
            non_manifold_edges: l.non_manifold_edges,
            repaired_charts: l.repaired_charts,
            split_polygons: l.split_polygons,
            width: l.width,
            height: l.height,
            texels_per_unit: l.texels_per_unit,
            stretch_bound: l.stretch_bound,
            over_stretched: l.over_stretched,
            coverage: both.coverage,
            seconds: both.seconds,
            padding: l.padding_px,
            reserved: 0,
            faces: both.face_chart.len(),
            corners: both.corner_uv.len(),
            torn_faces: both.torn.len(),
            welded_vertices: l.welded_vertices,
            stacked_parts: l.stacked_parts,
            straightened_charts: l.straightened_charts,
        };
        sized::write(info, value)
    })
}

/// Copies the warnings of unwrapping: what the user should hear, a line each, in English. No line where all
/// is well.
///
/// @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
/// @param capacity At least the length and 1, unless `text` is NULL.
/// @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_warnings(
    uv: *const atlasfit_uv,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> atlasfit_status {
    guard("atlasfit_uv_warnings", || unsafe {
        copy_lines(&handle::get(uv)?.layout.warnings, text, capacity, length)
    })
}

/// Copies the UVs: u, v in [0, 1], v up, for each corner of each face. Faces without a triangle have zeros.
///
/// @param corner_uv Room for `capacity` numbers.
/// @param capacity  At least 2 * info.corners (6 * info.triangles for a mesh of triangles).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_corners(
    uv: *const atlasfit_uv,
    corner_uv: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_corners", || unsafe {
        copy_out(handle::get(uv)?.corner_uv.as_flattened(), corner_uv, capacity, "corner UVs")
    })
}

/// Copies the chart of each face, 0 to info.charts - 1; UINT32_MAX for a face without a triangle.
///
/// @param face_charts Room for `capacity` numbers.
/// @param capacity    At least info.faces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_face_charts(
    uv: *const atlasfit_uv,
    face_charts: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_face_charts", || unsafe {
        copy_out(&handle::get(uv)?.face_chart, face_charts, capacity, "face charts")
    })
}

/// Copies the page of each face, 0 to info.pages - 1; UINT32_MAX for a face without a triangle.
///
/// @param face_pages Room for `capacity` numbers.
/// @param capacity   At least info.faces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_face_pages(
    uv: *const atlasfit_uv,
    face_pages: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_face_pages", || unsafe {
        copy_out(&handle::get(uv)?.face_page, face_pages, capacity, "face pages")
    })
}

/// atlasfit_uv_copy(): u, v of each corner of each face.
pub const ATLASFIT_UV_CORNERS: u32 = 0;
/// atlasfit_uv_copy(): the chart of each face.
pub const ATLASFIT_UV_FACE_CHARTS: u32 = 1;
/// atlasfit_uv_copy(): the page of each face.
pub const ATLASFIT_UV_FACE_PAGES: u32 = 2;

/// Copies an array of UVs as the caller has its own: numbers of another type, at any stride.
///
/// @param array #ATLASFIT_UV_CORNERS to #ATLASFIT_UV_FACE_PAGES.
/// @param to    Where and how.
/// @return As atlasfit_result_copy().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_copy(
    uv: *const atlasfit_uv,
    array: u32,
    to: *const atlasfit_buffer,
) -> atlasfit_status {
    guard("atlasfit_uv_copy", || unsafe {
        let held = handle::get(uv)?;
        let (column, width, name) = match array {
            ATLASFIT_UV_CORNERS => (Column::Floats(held.corner_uv.as_flattened()), 2, "corner UVs"),
            ATLASFIT_UV_FACE_CHARTS => (Column::Indices(&held.face_chart), 1, "face charts"),
            ATLASFIT_UV_FACE_PAGES => (Column::Indices(&held.face_page), 1, "face pages"),
            other => {
                return Err(Failure::invalid(format!(
                    "array is {other}. Give ATLASFIT_UV_CORNERS to ATLASFIT_UV_FACE_PAGES"
                )));
            }
        };
        copy_to(&column, width, to, name)
    })
}

/// Copies the numbers of the faces that were cut between charts because they do not lie flat, ascending. A
/// corner of such a face may have one UV in one of its triangles and another in the next;
/// atlasfit_uv_corners() gives that of the first.
///
/// @param torn     Room for `capacity` numbers.
/// @param capacity At least info.torn_faces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_face_torn(
    uv: *const atlasfit_uv,
    torn: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_face_torn", || unsafe {
        copy_out(&handle::get(uv)?.torn, torn, capacity, "torn faces")
    })
}

/// Copies the split form of the mesh, with one vertex per pair of vertex and UV: what graphics cards and glTF
/// take.
///
/// @param indices         The new vertex of each corner of each face, in the mesh's order.
/// @param index_capacity  Numbers that `indices` has room for, at least info.corners.
/// @param sources         The mesh's vertex that each new vertex came from.
/// @param vertex_uv       u, v of each new vertex.
/// @param vertex_capacity New vertices that `sources` and `vertex_uv` have room for, at least
///                        info.split_vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_split(
    uv: *const atlasfit_uv,
    indices: *mut u32,
    index_capacity: usize,
    sources: *mut u32,
    vertex_uv: *mut f32,
    vertex_capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_split", || unsafe {
        let s = &handle::get(uv)?.split;
        if indices.is_null() || sources.is_null() || vertex_uv.is_null() {
            return Err(Failure::invalid("a buffer is NULL"));
        }
        if index_capacity < s.corners.len() || vertex_capacity < s.source.len() {
            return Err(Failure::new(
                ATLASFIT_BUFFER_TOO_SMALL,
                format!(
                    "the capacities are {index_capacity} indices and {vertex_capacity} vertices, \
                     but there are {} and {}",
                    s.corners.len(),
                    s.source.len()
                ),
            ));
        }
        copy_out(&s.corners, indices, index_capacity, "indices")?;
        copy_out(&s.source, sources, vertex_capacity, "sources")?;
        copy_out(s.uv.as_flattened(), vertex_uv, vertex_capacity.saturating_mul(2), "vertex UVs")
    })
}
