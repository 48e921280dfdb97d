//! UVs for a mesh of the caller's.

use crate::arrays::{copy_lines, copy_out};
use crate::handle::{self, Handle};
use crate::mesh::{self, atlasfit_mesh};
use crate::run::{atlasfit_run, core_run, number_out};
use crate::sized::{self, Sized};
use crate::status::{ATLASFIT_BUFFER_TOO_SMALL, Failure, Outcome, atlasfit_status, guard};
use atlasfit::measure;
use atlasfit::unwrap::{Packer, Preset, SplitMesh, UnwrapOptions, UvLayout, memory_needed, unwrap};
use std::ffi::c_char;
use std::sync::Arc;
use std::time::Instant;

/// atlasfit_unwrap_options.packer: packs charts by their shapes: they lie in each other's bays and holes.
pub const ATLASFIT_PACK_SHAPES: u32 = 0;
/// atlasfit_unwrap_options.packer: packs charts by their bounding boxes, in rows: fastest, and wastes most.
pub const ATLASFIT_PACK_BOXES: u32 = 1;

/// atlasfit_unwrap_options_set_preset(): "few-seams": few charts and short seams, also for meshes of few
/// faces, which bend much at each edge.
pub const ATLASFIT_PRESET_FEW_SEAMS: u32 = 0;
/// atlasfit_unwrap_options_set_preset(): "balanced": what atlasfit_unwrap_options_init() gives.
pub const ATLASFIT_PRESET_BALANCED: u32 = 1;
/// atlasfit_unwrap_options_set_preset(): "low-stretch": lengths are kept best; most charts.
pub const ATLASFIT_PRESET_LOW_STRETCH: u32 = 2;

/// How to unwrap. Fill it with atlasfit_unwrap_options_init(); a NULL pointer to one means the defaults.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_unwrap_options {
    /// sizeof(atlasfit_unwrap_options).
    pub struct_size: usize,
    /// Bound on the stretch of 95% of the area, more than 1. Stretch is max(s1, 1/s2), with s1 >= s2 the
    /// singular values of the map from surface to texture, at one texel density for all charts. A smaller
    /// bound gives more charts. Default 1.1; atlasfit_unwrap_options_set_preset() sets others by name.
    pub max_stretch: f64,
    /// Most charts: max_stretch is raised until they are enough. More are still made where the topology or
    /// the constraints need them. 0 = any number. Default 0.
    pub max_charts: u32,
    /// Width of a page in texels, 16 to 65536. Default 1024.
    pub page_width: u32,
    /// Height of a page in texels, 16 to 65536. Default 1024.
    pub page_height: u32,
    /// Free texels between charts and at the page's border, at most an eighth of the page. Default 2.
    pub padding: u32,
    /// Most pages, up to 4096; 0 = one page or, where texels_per_unit is set, as many as that density needs.
    /// Default 0.
    pub pages: u32,
    /// #ATLASFIT_PACK_SHAPES or #ATLASFIT_PACK_BOXES. Default #ATLASFIT_PACK_SHAPES.
    pub packer: u32,
    /// 1 if seams of the UVs that the mesh already has (atlasfit_mesh.corner_uv) stay seams, else 0. Default
    /// 0.
    pub keep_uv_seams: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Texels per unit of length on the surface; 0 = as many as fill the pages. Default 0.
    pub texels_per_unit: f64,
    /// Edges whose triangles meet at an angle of more than this many degrees are seams, 0 to 180; 180 = none
    /// are for that reason. Default 180.
    pub hard_edge_angle: f64,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_unwrap_options {
    const NAME: &str = "atlasfit_unwrap_options";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        let d = UnwrapOptions::default();
        Self {
            struct_size: size_of::<Self>(),
            max_stretch: d.max_stretch,
            max_charts: d.max_charts.map_or(0, |n| n as u32),
            page_width: d.page_size[0],
            page_height: d.page_size[1],
            padding: d.padding_px,
            pages: d.pages.unwrap_or(0),
            packer: match d.packer {
                Packer::Shapes => ATLASFIT_PACK_SHAPES,
                Packer::Boxes => ATLASFIT_PACK_BOXES,
            },
            keep_uv_seams: u32::from(d.keep_uv_seams),
            reserved: 0,
            texels_per_unit: d.texels_per_unit.unwrap_or(0.0),
            hard_edge_angle: d.hard_edge_angle.unwrap_or(STRAIGHT),
        }
    }
}

/// Degrees: no two triangles of an edge meet at a larger angle, so none is hard.
const STRAIGHT: f64 = 180.0;

impl atlasfit_unwrap_options {
    /// The core's options but for the mesh's own columns.
    fn core(&self) -> Outcome<UnwrapOptions> {
        let packer = match self.packer {
            ATLASFIT_PACK_SHAPES => Packer::Shapes,
            ATLASFIT_PACK_BOXES => Packer::Boxes,
            other => {
                return Err(Failure::invalid(format!(
                    "packer is {other}. Give ATLASFIT_PACK_SHAPES or ATLASFIT_PACK_BOXES"
                )));
            }
        };
        let keep_uv_seams = sized::flag(self.keep_uv_seams, "keep_uv_seams")?;
        sized::zero(self.reserved)?;
        Ok(UnwrapOptions::default()
            .with_max_stretch(self.max_stretch)
            .with_max_charts((self.max_charts > 0).then_some(self.max_charts as usize))
            .with_page_size([self.page_width, self.page_height])
            .with_padding_px(self.padding)
            .with_texels_per_unit((self.texels_per_unit != 0.0).then_some(self.texels_per_unit))
            .with_pages((self.pages > 0).then_some(self.pages))
            .with_packer(packer)
            .with_keep_uv_seams(keep_uv_seams)
            .with_hard_edge_angle((self.hard_edge_angle != STRAIGHT).then_some(self.hard_edge_angle)))
    }
}

/// Fills options with their defaults.
///
/// @param options     The struct to fill.
/// @param struct_size sizeof(atlasfit_unwrap_options).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_unwrap_options_init(
    options: *mut atlasfit_unwrap_options,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_unwrap_options_init", || unsafe { sized::init(options, struct_size) })
}

/// Sets the numbers of options that a preset stands for, which is max_stretch. What is set after it counts.
///
/// @param options The struct, filled by its _init.
/// @param preset  #ATLASFIT_PRESET_FEW_SEAMS (a stretch of 1.3), #ATLASFIT_PRESET_BALANCED (1.1) or
///                #ATLASFIT_PRESET_LOW_STRETCH (1.05).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_unwrap_options_set_preset(
    options: *mut atlasfit_unwrap_options,
    preset: u32,
) -> atlasfit_status {
    guard("atlasfit_unwrap_options_set_preset", || unsafe {
        let set = sized::read(options)?;
        let preset = match preset {
            ATLASFIT_PRESET_FEW_SEAMS => Preset::FewSeams,
            ATLASFIT_PRESET_BALANCED => Preset::Balanced,
            ATLASFIT_PRESET_LOW_STRETCH => Preset::LowStretch,
            other => {
                return Err(Failure::invalid(format!(
                    "preset is {other}. Give ATLASFIT_PRESET_FEW_SEAMS to ATLASFIT_PRESET_LOW_STRETCH"
                )));
            }
        };
        sized::write(options, atlasfit_unwrap_options { max_stretch: preset.max_stretch(), ..set })
    })
}

/// Tells how many bytes atlasfit_unwrap() needs at its peak, the mesh included: an upper bound that is up to
/// twice too large. The mesh need not be there.
///
/// @param vertices  How many vertices.
/// @param triangles How many triangles.
/// @param options   How to unwrap; NULL = the defaults.
/// @param run       How long work is run, of which the threads count; NULL = the defaults.
/// @param bytes     Set to the bytes; 0 on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_unwrap_memory_needed(
    vertices: usize,
    triangles: usize,
    options: *const atlasfit_unwrap_options,
    run: *const atlasfit_run,
    bytes: *mut u64,
) -> atlasfit_status {
    guard("atlasfit_unwrap_memory_needed", || unsafe {
        let bytes = number_out(bytes)?;
        let options = sized::read_or_default(options)?.core()?;
        *bytes = memory_needed(vertices, triangles, &options, core_run(run)?.thread_count()?);
        Ok(())
    })
}

/// UVs of a mesh. Immutable: any number of threads may read one at once.
pub struct atlasfit_uv(());

/// What a UV handle holds.
pub(crate) struct Layout {
    layout: UvLayout,
    split: SplitMesh,
    coverage: f64,
    seconds: f64,
}

impl Handle for atlasfit_uv {
    type Target = Layout;
    const NAME: &str = "UV layout";
}

/// Lays out UVs for a mesh of any topology: charts of low stretch that neither flip nor overlap, packed on
/// pages of the size that the options say. The mesh keeps its vertices and the order of its triangles. A
/// chart so long that it alone would decide the scale on the page is cut across, unless the options set
/// max_charts, a density or several pages.
///
/// @param mesh    The mesh; face_group, face_polygon and seam_edges are read, and corner_uv with
///                keep_uv_seams.
/// @param options How to unwrap; NULL = the defaults.
/// @param run     How long work is run; NULL = the defaults.
/// @param out     Where the UVs are put; NULL on failure. Free them with atlasfit_uv_free().
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
///         triangle names no vertex), #ATLASFIT_EMPTY_INPUT or #ATLASFIT_DEGENERATE (no area),
///         #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_unwrap(
    mesh: *const atlasfit_mesh,
    options: *const atlasfit_unwrap_options,
    run: *const atlasfit_run,
    out: *mut *mut atlasfit_uv,
) -> atlasfit_status {
    guard("atlasfit_unwrap", || unsafe {
        handle::checked_out(out)?;
        let options = sized::read_or_default(options)?.core()?;
        let mut run = core_run(run)?;
        let mesh::Mesh { mesh, face_group, face_polygon, seam_edges, .. } = mesh::mesh(mesh)?;
        let options =
            options.with_face_group(face_group).with_face_polygon(face_polygon).with_seam_edges(seam_edges);
        let start = Instant::now();
        let (mut layout, after) = run.execute(|ctx| {
            let layout = unwrap(&mesh, &options, ctx)?;
            ctx.check()?;
            let end = Instant::now();
            let split = layout.split(&mesh, ctx)?;
            let coverage = measure::uv::coverage(&layout.corner_uv, layout.pages);
            Ok((Layout { layout, split, coverage, seconds: 0.0 }, end.elapsed()))
        })?;
        layout.seconds = start.elapsed().saturating_sub(after).as_secs_f64();
        handle::give(Arc::new(layout), out);
        Ok(())
    })
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
    /// Triangles of the mesh.
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
            triangles: l.corner_uv.len(),
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

/// Copies the UVs: u, v in [0, 1], v up, for each corner of each triangle.
///
/// @param corner_uv Room for `capacity` numbers.
/// @param capacity  At least 6 * info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_corners(
    uv: *const atlasfit_uv,
    corner_uv: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_corners", || unsafe {
        let u = handle::get(uv)?;
        copy_out(u.layout.corner_uv.as_flattened().as_flattened(), corner_uv, capacity, "corner UVs")
    })
}

/// Copies the chart of each triangle, 0 to info.charts - 1.
///
/// @param face_charts Room for `capacity` numbers.
/// @param capacity    At least info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_face_charts(
    uv: *const atlasfit_uv,
    face_charts: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_face_charts", || unsafe {
        copy_out(&handle::get(uv)?.layout.face_chart, face_charts, capacity, "face charts")
    })
}

/// Copies the page of each triangle, 0 to info.pages - 1.
///
/// @param face_pages Room for `capacity` numbers.
/// @param capacity   At least info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_uv_face_pages(
    uv: *const atlasfit_uv,
    face_pages: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_uv_face_pages", || unsafe {
        copy_out(&handle::get(uv)?.layout.face_page, face_pages, capacity, "face pages")
    })
}

/// Copies the split form of the mesh, with one vertex per pair of vertex and UV: what graphics cards and glTF
/// take.
///
/// @param indices         Three new vertices per triangle, in the mesh's order.
/// @param index_capacity  Numbers that `indices` has room for, at least 3 * info.triangles.
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
        if index_capacity < 3 * s.triangles.len() || vertex_capacity < s.source.len() {
            return Err(Failure::new(
                ATLASFIT_BUFFER_TOO_SMALL,
                format!(
                    "the capacities are {index_capacity} indices and {vertex_capacity} vertices, \
                     but there are {} and {}",
                    3 * s.triangles.len(),
                    s.source.len()
                ),
            ));
        }
        copy_out(s.triangles.as_flattened(), indices, index_capacity, "indices")?;
        copy_out(&s.source, sources, vertex_capacity, "sources")?;
        copy_out(s.uv.as_flattened(), vertex_uv, vertex_capacity.saturating_mul(2), "vertex UVs")
    })
}
