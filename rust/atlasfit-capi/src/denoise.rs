//! Denoising: points in, one handle with everything that came out, getters for its arrays.

use crate::atlas::atlasfit_atlas;
use crate::handle::{self, Handle, Object};
use crate::input::{self, atlasfit_points, available, copy_out};
use crate::run::{ATLASFIT_STAGE_LIMIT, atlasfit_run, brief_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{self, ATLASFIT_INDEX_OUT_OF_RANGE, Failure, atlasfit_status, guard};
use atlasfit::atlas::query::Atlas;
use atlasfit::pipeline::{DenoiseOptions, Denoised, Outliers, denoise_guided};
use atlasfit_net::Prior;
use atlasfit_net::explicit::{Network, NetworkOptions, Recipe};
use atlasfit_net::level_set::LevelSetOptions;
use std::sync::Arc;

/// atlasfit_denoise_options.prior: the Gaussian-process limit of the paper's networks.
pub const ATLASFIT_PRIOR_GP: u32 = 0;
/// atlasfit_denoise_options.prior: the paper's fully connected networks, trained on the scan first: many times slower.
pub const ATLASFIT_PRIOR_MLP: u32 = 1;
/// atlasfit_denoise_options.prior: the paper's convolutional networks.
pub const ATLASFIT_PRIOR_CONV: u32 = 2;
/// atlasfit_denoise_options.prior: the paper's level set: closed surfaces only.
pub const ATLASFIT_PRIOR_LEVEL_SET: u32 = 3;
/// atlasfit_denoise_options.recipe: from coarse to fine, learning rates that fall.
pub const ATLASFIT_RECIPE_FAST: u32 = 0;
/// atlasfit_denoise_options.recipe: as in the paper: all samples at every step.
pub const ATLASFIT_RECIPE_PAPER: u32 = 1;
/// atlasfit_denoise_options.outliers: they stay where they were among the denoised points, which stay in input order.
pub const ATLASFIT_OUTLIERS_KEEP: u32 = 0;
/// atlasfit_denoise_options.outliers: they are left out of the denoised points.
pub const ATLASFIT_OUTLIERS_DROP: u32 = 1;

/// How to denoise. Fill it with atlasfit_denoise_options_init(); a NULL pointer to one means the defaults, which suit an ordinary scan.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_denoise_options {
    /// sizeof(atlasfit_denoise_options).
    pub struct_size: usize,
    /// Standard deviation of the noise along the normal, in the points' unit; 0 = estimate it. Default 0.
    pub noise: f64,
    /// Fineness of the surface, 0.1 to 10: 1 = what the data supports, 0.5 = voxels twice as large. Default 1.
    pub detail: f64,
    /// Holes with a boundary shorter than this are filled, in the points' unit; 0 = only gaps of the sampling. Default 0.
    pub fill_holes: f64,
    /// Number of charts to aim for; 0 = as many as the shape needs. Default 0.
    pub charts: u32,
    /// #ATLASFIT_PRIOR_GP to #ATLASFIT_PRIOR_LEVEL_SET. Default #ATLASFIT_PRIOR_GP.
    pub prior: u32,
    /// #ATLASFIT_OUTLIERS_KEEP or #ATLASFIT_OUTLIERS_DROP. Default #ATLASFIT_OUTLIERS_KEEP.
    pub outliers: u32,
    /// Whether to lay out UVs: 0 = no, 1 = yes. Default 1.
    pub uv: u32,
    /// Side of the texture page in texels, 16 to 65536, for the padding between UV charts. Default 1024.
    pub texture_size: u32,
    /// #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV: number of charts that are trained, 1 or more. Default 8.
    pub network_charts: u32,
    /// With #ATLASFIT_RECIPE_PAPER: steps of training, at most. Default 1000.
    pub network_iterations: u32,
    /// How #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV are trained: #ATLASFIT_RECIPE_FAST or #ATLASFIT_RECIPE_PAPER. Default #ATLASFIT_RECIPE_FAST.
    pub recipe: u32,
    /// #ATLASFIT_PRIOR_MLP and #ATLASFIT_PRIOR_CONV: weight of the stretch against the Chamfer distance, 0 or more. Default 1.
    pub network_stretch_weight: f64,
    /// With #ATLASFIT_RECIPE_PAPER: learning rate of Adam, more than 0. Default 0.001.
    pub network_learning_rate: f64,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_denoise_options {
    const NAME: &str = "atlasfit_denoise_options";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        let (d, network) = (DenoiseOptions::default(), NetworkOptions::default());
        Self {
            struct_size: size_of::<Self>(),
            noise: d.noise.unwrap_or(0.0),
            detail: d.detail,
            fill_holes: d.fill_holes,
            charts: d.charts.map_or(0, |n| n as u32),
            prior: ATLASFIT_PRIOR_GP,
            outliers: match d.outliers {
                Outliers::Keep => ATLASFIT_OUTLIERS_KEEP,
                Outliers::Drop => ATLASFIT_OUTLIERS_DROP,
            },
            uv: u32::from(d.uv),
            texture_size: d.texture_size,
            network_charts: network.charts as u32,
            network_iterations: network.iterations as u32,
            recipe: match network.recipe {
                Recipe::Fast => ATLASFIT_RECIPE_FAST,
                Recipe::Paper => ATLASFIT_RECIPE_PAPER,
            },
            network_stretch_weight: network.stretch_weight,
            network_learning_rate: network.learning_rate,
        }
    }
}

impl atlasfit_denoise_options {
    fn core(&self) -> status::Outcome<(DenoiseOptions, Prior)> {
        let unknown = |name: &str, value: u32, advice: &str| {
            Err(Failure::invalid(format!("{name} is {value}. Give {advice}")))
        };
        let recipe = match self.recipe {
            ATLASFIT_RECIPE_FAST => Recipe::Fast,
            ATLASFIT_RECIPE_PAPER => Recipe::Paper,
            other => return unknown("recipe", other, "ATLASFIT_RECIPE_FAST or ATLASFIT_RECIPE_PAPER"),
        };
        let network = |network| {
            Prior::Network(NetworkOptions {
                network,
                recipe,
                charts: self.network_charts as usize,
                iterations: self.network_iterations as usize,
                stretch_weight: self.network_stretch_weight,
                learning_rate: self.network_learning_rate,
                ..NetworkOptions::default()
            })
        };
        let prior = match self.prior {
            ATLASFIT_PRIOR_GP => Prior::Gp,
            ATLASFIT_PRIOR_MLP => network(Network::Dense),
            ATLASFIT_PRIOR_CONV => network(Network::Conv),
            ATLASFIT_PRIOR_LEVEL_SET => Prior::LevelSet(LevelSetOptions::default()),
            other => return unknown("prior", other, "ATLASFIT_PRIOR_GP to ATLASFIT_PRIOR_LEVEL_SET"),
        };
        let outliers = match self.outliers {
            ATLASFIT_OUTLIERS_KEEP => Outliers::Keep,
            ATLASFIT_OUTLIERS_DROP => Outliers::Drop,
            other => return unknown("outliers", other, "ATLASFIT_OUTLIERS_KEEP or ATLASFIT_OUTLIERS_DROP"),
        };
        let uv = input::flag(self.uv, "uv")?;
        let options = DenoiseOptions::default()
            // 0 asks for an estimate; whatever else is no positive length is refused by the core.
            .with_noise((self.noise != 0.0).then_some(self.noise))
            .with_detail(self.detail)
            .with_charts((self.charts > 0).then_some(self.charts as usize))
            .with_fill_holes(self.fill_holes)
            .with_texture_size(self.texture_size)
            .with_outliers(outliers)
            .with_uv(uv);
        Ok((options, prior))
    }
}

/// Fills options with their defaults.
///
/// @param options     The struct to fill.
/// @param struct_size sizeof(atlasfit_denoise_options).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_denoise_options_init(
    options: *mut atlasfit_denoise_options,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_denoise_options_init", || unsafe { sized::init(options, struct_size) })
}

/// What denoising made: denoised points, the surface, the atlas, a report. Immutable: any number of threads may read one at once.
pub struct atlasfit_result(());

/// What a result handle holds.
pub(crate) struct Outcome {
    denoised: Denoised,
    atlas: Arc<Atlas>,
}

impl Handle for atlasfit_result {
    type Target = Arc<Outcome>;
    const NAME: &str = "result";
    fn of(object: Object) -> Option<Arc<Outcome>> {
        match object {
            Object::Result(result) => Some(result),
            _ => None,
        }
    }
}

/// Denoises a scan: denoised points, one connected surface with UVs, and the fitted atlas.
///
/// @param points  The scan, at least a few hundred points on a surface.
/// @param options How to denoise; NULL = the defaults.
/// @param run     How long work is run; NULL = the defaults.
/// @param out     Where the result is put; NULL on failure. Free it with atlasfit_result_free().
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_EMPTY_INPUT (no finite point), #ATLASFIT_DEGENERATE
///         (the points are no surface), #ATLASFIT_DIVERGED, #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_denoise(
    points: *const atlasfit_points,
    options: *const atlasfit_denoise_options,
    run: *const atlasfit_run,
    out: *mut *mut atlasfit_result,
) -> atlasfit_status {
    guard("atlasfit_denoise", || unsafe {
        handle::checked_out(out)?;
        let (options, prior) = sized::read_or_default(options)?.core()?;
        let mut run = core_run(run)?;
        let cloud = input::cloud(points)?;
        let mut denoised = denoise_guided(&cloud, &options, prior.guide(), &mut run)?;
        drop(cloud);
        let charts = std::mem::take(&mut denoised.charts);
        let atlas = brief_run().execute(|ctx| Atlas::new(charts, denoised.origin, denoised.scale, ctx))?;
        let atlas = Arc::new(atlas);
        handle::give(Object::Result(Arc::new(Outcome { denoised, atlas })), out);
        Ok(())
    })
}

/// Frees a result; NULL is allowed. Atlases taken from it stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_free(result: *mut atlasfit_result) -> atlasfit_status {
    guard("atlasfit_result_free", || handle::free(result))
}

/// What was found and done. Lengths are in the points' unit.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_report {
    /// sizeof(atlasfit_report), set by the caller.
    pub struct_size: usize,
    /// Points given.
    pub points_given: usize,
    /// Points given with a coordinate that is not finite. They are no part of the surface.
    pub not_finite: usize,
    /// Points that repeat the position of an earlier one; they move with it.
    pub duplicates: usize,
    /// Points that no chart claims: they belong to no surface.
    pub outliers: usize,
    /// Denoised points; as many as were given unless outliers are dropped.
    pub points: usize,
    /// Vertices of the surface.
    pub vertices: usize,
    /// Triangles of the surface.
    pub triangles: usize,
    /// Charts of the atlas.
    pub charts: usize,
    /// UV charts of the surface; 0 without UVs.
    pub uv_charts: usize,
    /// Connected parts of the surface.
    pub parts: usize,
    /// Boundary loops of the surface.
    pub boundary_loops: usize,
    /// Edges on the boundary.
    pub boundary_edges: usize,
    /// Holes that were filled.
    pub filled_holes: usize,
    /// Columns of attributes that the surface carries, as many as were given.
    pub attributes: usize,
    /// 1 if some part of the surface is one-sided, else 0.
    pub one_sided: u32,
    /// 1 if the surface has UVs, else 0.
    pub has_uv: u32,
    /// 1 if the surface has colours, else 0.
    pub has_colors: u32,
    /// 0.
    pub reserved: u32,
    /// Median distance between neighbouring points.
    pub spacing: f64,
    /// Noise (standard deviation along the normal), estimated or as given.
    pub noise: f64,
    /// Side of the voxels that the surface was contoured with.
    pub voxel: f64,
    /// Seconds spent in each stage, by the stage's number.
    pub stage_seconds: [f64; ATLASFIT_STAGE_LIMIT],
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_report {
    const NAME: &str = "atlasfit_report";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// Tells what was found and done, and how large the result's arrays are.
///
/// @param report Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_report(
    result: *const atlasfit_result,
    report: *mut atlasfit_report,
) -> atlasfit_status {
    guard("atlasfit_result_report", || unsafe {
        let result = handle::get(result)?;
        let (d, r) = (&result.denoised, &result.denoised.report);
        let mut stage_seconds = [0.0; ATLASFIT_STAGE_LIMIT];
        for (stage, seconds) in &r.seconds {
            if let Some(s) = stage_seconds.get_mut(*stage as usize) {
                *s += seconds;
            }
        }
        let value = atlasfit_report {
            struct_size: size_of::<atlasfit_report>(),
            points_given: r.points,
            not_finite: r.not_finite,
            duplicates: r.duplicates,
            outliers: r.outliers,
            points: d.points.len(),
            vertices: d.surface.positions.len(),
            triangles: d.surface.triangles.len(),
            charts: r.charts,
            uv_charts: r.uv_charts,
            parts: r.parts,
            boundary_loops: r.boundary_loops,
            boundary_edges: r.boundary_edges,
            filled_holes: r.filled_holes,
            attributes: d.surface.attributes.len(),
            one_sided: u32::from(r.one_sided),
            has_uv: u32::from(d.surface.corner_uv.is_some()),
            has_colors: u32::from(d.surface.colors.is_some()),
            reserved: 0,
            spacing: r.spacing,
            noise: r.noise,
            voxel: r.voxel,
            stage_seconds,
        };
        sized::write(report, value)
    })
}

/// Copies the denoised positions: x, y, z per point, in input order. Outliers (where kept) and points that are not finite are where they were.
///
/// @param xyz      Room for `capacity` numbers.
/// @param capacity At least 3 * report.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_point_positions(
    result: *const atlasfit_result,
    xyz: *mut f64,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_point_positions", || unsafe {
        let r = handle::get(result)?;
        copy_out(r.denoised.points.positions.as_flattened(), xyz, capacity, "point positions")
    })
}

/// Copies the denoised points' unit normals: 3 numbers per point. Points that are on no chart have the normal that was given, or zeros.
///
/// @param normals  Room for `capacity` numbers.
/// @param capacity At least 3 * report.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_point_normals(
    result: *const atlasfit_result,
    normals: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_point_normals", || unsafe {
        let r = handle::get(result)?;
        let all = available(&r.denoised.points.normals, "point normals")?;
        copy_out(all.as_flattened(), normals, capacity, "point normals")
    })
}

/// Copies, for each denoised point, the index of the given point that it was. Without dropped outliers these are 0, 1, 2, ...
///
/// @param sources  Room for `capacity` numbers.
/// @param capacity At least report.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_point_sources(
    result: *const atlasfit_result,
    sources: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_point_sources", || unsafe {
        let r = handle::get(result)?;
        copy_out(&r.denoised.point_source, sources, capacity, "point sources")
    })
}

/// Copies, for each denoised point, the chart of the atlas that weighs most there; UINT32_MAX for a point on no chart: an outlier, or not finite.
///
/// @param charts   Room for `capacity` numbers.
/// @param capacity At least report.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_point_charts(
    result: *const atlasfit_result,
    charts: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_point_charts", || unsafe {
        let r = handle::get(result)?;
        copy_out(&r.denoised.point_chart, charts, capacity, "point charts")
    })
}

/// Copies the surface's vertex positions: x, y, z per vertex.
///
/// @param xyz      Room for `capacity` numbers.
/// @param capacity At least 3 * report.vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_surface_positions(
    result: *const atlasfit_result,
    xyz: *mut f64,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_surface_positions", || unsafe {
        let r = handle::get(result)?;
        copy_out(r.denoised.surface.positions.as_flattened(), xyz, capacity, "surface positions")
    })
}

/// Copies the surface's unit normals: 3 numbers per vertex.
///
/// @param normals  Room for `capacity` numbers.
/// @param capacity At least 3 * report.vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_surface_normals(
    result: *const atlasfit_result,
    normals: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_surface_normals", || unsafe {
        let r = handle::get(result)?;
        let all = available(&r.denoised.surface.normals, "surface normals")?;
        copy_out(all.as_flattened(), normals, capacity, "surface normals")
    })
}

/// Copies the surface's triangles: 3 vertex indices each, counter-clockwise seen from outside.
///
/// @param triangles Room for `capacity` numbers.
/// @param capacity  At least 3 * report.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_surface_triangles(
    result: *const atlasfit_result,
    triangles: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_surface_triangles", || unsafe {
        let r = handle::get(result)?;
        copy_out(r.denoised.surface.triangles.as_flattened(), triangles, capacity, "triangles")
    })
}

/// Copies the surface's UVs: u, v in [0, 1], v up, for each corner of each triangle. #ATLASFIT_NOT_AVAILABLE without UVs.
///
/// @param corner_uv Room for `capacity` numbers.
/// @param capacity  At least 6 * report.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_surface_corner_uv(
    result: *const atlasfit_result,
    corner_uv: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_surface_corner_uv", || unsafe {
        let r = handle::get(result)?;
        let all = available(&r.denoised.surface.corner_uv, "UVs")?;
        copy_out(all.as_flattened().as_flattened(), corner_uv, capacity, "corner UVs")
    })
}

/// Copies the UV chart of each triangle, 0 to report.uv_charts - 1; UINT32_MAX where there is none. #ATLASFIT_NOT_AVAILABLE without UVs.
///
/// @param face_charts Room for `capacity` numbers.
/// @param capacity    At least report.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_surface_face_charts(
    result: *const atlasfit_result,
    face_charts: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_surface_face_charts", || unsafe {
        let r = handle::get(result)?;
        let all = available(&r.denoised.surface.face_chart, "UV charts")?;
        copy_out(all, face_charts, capacity, "face charts")
    })
}

/// Copies the surface's colours: red, green, blue, alpha per vertex, 0 to 1. #ATLASFIT_NOT_AVAILABLE where the points had none.
///
/// @param rgba     Room for `capacity` numbers.
/// @param capacity At least 4 * report.vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_surface_colors(
    result: *const atlasfit_result,
    rgba: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_surface_colors", || unsafe {
        let r = handle::get(result)?;
        let all = available(&r.denoised.surface.colors, "colours")?;
        copy_out(all.as_flattened(), rgba, capacity, "colours")
    })
}

/// Copies one attribute of the surface: as many numbers per vertex as it was given with.
///
/// @param attribute Its place in the array that was given, 0 to report.attributes - 1.
/// @param values    Room for `capacity` numbers.
/// @param capacity  At least the attribute's width * report.vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_surface_attribute(
    result: *const atlasfit_result,
    attribute: usize,
    values: *mut f64,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_result_surface_attribute", || unsafe {
        let r = handle::get(result)?;
        let all = &r.denoised.surface.attributes;
        let one = all.get(attribute).ok_or_else(|| {
            Failure::new(
                ATLASFIT_INDEX_OUT_OF_RANGE,
                format!("attribute is {attribute}, but there are only {}", all.len()),
            )
        })?;
        copy_out(&one.values, values, capacity, "the attribute")
    })
}

/// The atlas that was fitted, as a handle of its own: it outlives the result, shares its memory, and is freed with atlasfit_atlas_free().
///
/// @param out Where the atlas is put; NULL on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_atlas(
    result: *const atlasfit_result,
    out: *mut *mut atlasfit_atlas,
) -> atlasfit_status {
    guard("atlasfit_result_atlas", || {
        handle::checked_out(out)?;
        let r = handle::get(result)?;
        handle::give(Object::Atlas(r.atlas.clone()), out);
        Ok(())
    })
}
