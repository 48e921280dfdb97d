//! UVs for a mesh of the caller's.

use crate::handle;
use crate::log;
use crate::mesh::{self, atlasfit_mesh};
use crate::run::{atlasfit_run, core_run, number_out};
use crate::sized::{self, Sized};
use crate::status::{Failure, Outcome, atlasfit_status, guard};
use crate::uv::{Layout, atlasfit_uv};
use atlasfit::unwrap::{Packer, Preset, Stack, Straighten, UnwrapOptions, memory_needed, unwrap};
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

/// atlasfit_unwrap_options.stack: each part of the mesh has texels of its own.
pub const ATLASFIT_STACK_NONE: u32 = 0;
/// atlasfit_unwrap_options.stack: parts that are moved and turned copies of each other get the same UVs.
pub const ATLASFIT_STACK_IDENTICAL: u32 = 1;
/// atlasfit_unwrap_options.stack: these and mirror images, whose UVs run the other way round.
pub const ATLASFIT_STACK_MIRRORED: u32 = 2;

/// atlasfit_unwrap_options.straighten: charts lie as they have least stretch.
pub const ATLASFIT_STRAIGHTEN_OFF: u32 = 0;
/// atlasfit_unwrap_options.straighten: what a person would straighten is straight and parallel to the page's
/// sides.
pub const ATLASFIT_STRAIGHTEN_AUTO: u32 = 1;

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
    /// Most charts: those that only the shape of the page asks for go first, then max_stretch is raised until
    /// they are few enough. More are still made where the topology or the constraints need them. 0 = any
    /// number. Default 0.
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
    /// 1 if the charts are those of the UVs that the mesh already has (atlasfit_mesh.corner_uv): moved,
    /// turned and scaled to one density, and packed; what flips or overlaps in them is cut. 0 makes new
    /// ones. Default 0.
    pub keep_uvs: u32,
    /// Which parts of the mesh lie on each other on the page, corner on corner: #ATLASFIT_STACK_NONE to
    /// #ATLASFIT_STACK_MIRRORED. A part is what hangs together after all cuts; two have one shape where their
    /// triangles are alike one by one, to a ten thousandth of the part's size. Parts of two groups are not
    /// stacked. Not with keep_uvs. Default #ATLASFIT_STACK_NONE.
    pub stack: u32,
    /// Bound on the mean symmetric Dirichlet energy s1^2 + s2^2 + 1/s1^2 + 1/s2^2 by area instead of
    /// max_stretch, more than 4 (isometry): each connected part becomes one chart that is cut open, with
    /// seams as short as can be found. Slower: for up to some ten thousand triangles. 0 = max_stretch counts.
    /// Default 0.
    pub max_energy: f64,
    /// Whether charts are laid straight: #ATLASFIT_STRAIGHTEN_OFF or #ATLASFIT_STRAIGHTEN_AUTO. Strips, tubes
    /// that are cut open and rims become rectangles, long sides of other charts straight lines, within the
    /// bound on the stretch; such charts are turned in quarter turns only, which costs texels where charts
    /// are few and large. Not with keep_uvs. Default #ATLASFIT_STRAIGHTEN_OFF.
    pub straighten: u32,
    /// Must be 0.
    pub reserved_too: u32,
    /// How much seams are to lie where the outside hardly sees them, 0 to 1: 0 = as short as can be. Not with
    /// keep_uvs. Default 0.
    pub seams_hidden: f64,
    /// The direction up, of any length: where seams_hidden counts, nobody looks from below. All 0 = they look
    /// from all around. Default 0.
    pub up: [f64; 3],
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_unwrap_options {
    const NAME: &str = "atlasfit_unwrap_options";
    const FIRST: usize = std::mem::offset_of!(Self, keep_uvs);
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
            keep_uvs: u32::from(d.keep_uvs),
            stack: ATLASFIT_STACK_NONE,
            max_energy: d.max_energy.unwrap_or(0.0),
            straighten: ATLASFIT_STRAIGHTEN_OFF,
            reserved_too: 0,
            seams_hidden: d.seams_hidden,
            up: d.up.unwrap_or_default(),
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
        let keep_uvs = sized::flag(self.keep_uvs, "keep_uvs")?;
        sized::zero(self.reserved)?;
        sized::zero(self.reserved_too)?;
        let stack = match self.stack {
            ATLASFIT_STACK_NONE => Stack::None,
            ATLASFIT_STACK_IDENTICAL => Stack::Identical,
            ATLASFIT_STACK_MIRRORED => Stack::Mirrored,
            other => {
                return Err(Failure::invalid(format!(
                    "stack is {other}. Give ATLASFIT_STACK_NONE to ATLASFIT_STACK_MIRRORED"
                )));
            }
        };
        let straighten = match self.straighten {
            ATLASFIT_STRAIGHTEN_OFF => Straighten::Off,
            ATLASFIT_STRAIGHTEN_AUTO => Straighten::Auto,
            other => {
                return Err(Failure::invalid(format!(
                    "straighten is {other}. Give ATLASFIT_STRAIGHTEN_OFF or ATLASFIT_STRAIGHTEN_AUTO"
                )));
            }
        };
        Ok(UnwrapOptions::default()
            .with_max_stretch(self.max_stretch)
            .with_max_charts((self.max_charts > 0).then_some(self.max_charts as usize))
            .with_page_size([self.page_width, self.page_height])
            .with_padding_px(self.padding)
            .with_texels_per_unit((self.texels_per_unit != 0.0).then_some(self.texels_per_unit))
            .with_pages((self.pages > 0).then_some(self.pages))
            .with_packer(packer)
            .with_keep_uv_seams(keep_uv_seams)
            .with_keep_uvs(keep_uvs)
            .with_stack(stack)
            .with_straighten(straighten)
            .with_seams_hidden(self.seams_hidden)
            .with_up((self.up != [0.0; 3]).then_some(self.up))
            .with_max_energy((self.max_energy != 0.0).then_some(self.max_energy))
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

/// Lays out UVs for a mesh of any topology: charts of low stretch that neither flip nor overlap, packed on
/// pages of the size that the options say. The mesh keeps its vertices and the order of its triangles. A
/// chart so long that it alone would decide the scale on the page is cut across, unless the options set
/// max_charts, a density or several pages.
///
/// @param mesh    The mesh; face_group, face_polygon, seam_edges, seam_price and occupied_uv are read, and
///                corner_uv with keep_uv_seams or keep_uvs. The triangles of a polygon stay together, so that
///                each of its corners has one UV, unless it does not lie flat: see atlasfit_uv_face_torn().
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
        let mut mesh = mesh::mesh(mesh)?;
        let start = Instant::now();
        let (mut layout, after) = run.execute(|ctx| {
            mesh.cut(ctx)?;
            let options = options
                .with_face_group(mesh.face_group.take())
                .with_face_polygon(mesh.face_polygon.take())
                .with_seam_edges(mesh.seam_edges.take())
                .with_seam_price(mesh.seam_price.take())
                .with_occupied(mesh.occupied.take());
            let layout = unwrap(&mesh.mesh, &options, ctx)?;
            ctx.check()?;
            let end = Instant::now();
            Ok((Layout::new(layout, &mesh, ctx)?, end.elapsed()))
        })?;
        layout.seconds = start.elapsed().saturating_sub(after).as_secs_f64();
        log::warn(&layout.layout.warnings);
        handle::give(Arc::new(layout), out);
        Ok(())
    })
}
