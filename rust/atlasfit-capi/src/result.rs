//! What denoising made: one handle, its report, getters that copy its arrays, the atlas as a handle of its
//! own.

use crate::arrays::{available, copy_lines, copy_out};
use crate::atlas::atlasfit_atlas;
use crate::handle::{self, Handle};
use crate::run::{ATLASFIT_STAGE_LIMIT, brief_run};
use crate::sized::{self, Sized};
use crate::status::{ATLASFIT_INDEX_OUT_OF_RANGE, Failure, Outcome, atlasfit_status, guard};
use atlasfit::atlas::query::Atlas;
use atlasfit::pipeline::{DenoiseOptions, Denoised};
use std::ffi::c_char;
use std::sync::Arc;

/// What denoising made: denoised points, the surface, the atlas, a report. Immutable: any number of threads
/// may read one at once.
pub struct atlasfit_result(());

/// What a result handle holds.
pub(crate) struct DenoiseResult {
    pub denoised: Denoised,
    atlas: Arc<Atlas>,
    /// Whether uncertainty was asked for.
    pub unsure: bool,
    /// Whether it was asked for what of the surface was invented.
    pub invented: bool,
}

impl DenoiseResult {
    /// Takes the charts out of the core's result: the atlas holds them.
    pub fn new(mut denoised: Denoised, options: &DenoiseOptions) -> Outcome<Self> {
        let charts = std::mem::take(&mut denoised.charts);
        let atlas = brief_run().execute(|ctx| Atlas::new(charts, denoised.origin, denoised.scale, ctx))?;
        let unsure = options.uncertainty;
        Ok(Self { denoised, atlas: Arc::new(atlas), unsure, invented: unsure || options.watertight })
    }
}

impl Handle for atlasfit_result {
    type Target = DenoiseResult;
    const NAME: &str = "result";
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
    /// Points that repeat the position of an earlier one, or are copies of it, far nearer than the next. They
    /// move with it.
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
    /// Columns of attributes that the surface carries: as many as were given, then what watertight and
    /// uncertainty of the options add.
    pub attributes: usize,
    /// 1 if some part of the surface is one-sided, else 0.
    pub one_sided: u32,
    /// 1 if the surface has UVs, else 0.
    pub has_uv: u32,
    /// 1 if the surface has colours, else 0.
    pub has_colors: u32,
    /// 0.
    pub reserved: u32,
    /// Median distance between neighbouring points; where many lie in rows far apart, between those that are
    /// left when the points of a row are averaged.
    pub spacing: f64,
    /// Noise (standard deviation along the normal), estimated or as given.
    pub noise: f64,
    /// Side of the finest voxels that the surface was contoured with; they are wider where points lie far
    /// apart.
    pub voxel: f64,
    /// Seconds spent in each stage, by the stage's number.
    pub stage_seconds: [f64; ATLASFIT_STAGE_LIMIT],
    /// Connected parts of the surface that were left out, as min_part and largest of the options asked for.
    pub dropped_parts: usize,
    /// Points given that lie on those parts. They are denoised all the same, and no outliers.
    pub dropped_points: usize,
    /// Outliers that follow the surface between their neighbours in the mesh, as triangles of atlasfit_points
    /// says; the other outliers stay where they are.
    pub followed_outliers: usize,
    /// By how much the charts' own standard deviations were widened, as the residuals of points beside each
    /// other ask for: 1 or more; 0 where uncertainty was not asked for, or the residuals do not tell.
    pub uncertainty_factor: f64,
    /// Sweeps that were looked at to be moved together, as sweeps of the options asked for; else 0.
    pub sweeps: usize,
    /// How far the sweeps were apart along the normal (standard deviation, noise and misfit together) before
    /// they were moved; 0 without sweeps.
    pub apart_before: f64,
    /// The same after they were moved.
    pub apart_after: f64,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_report {
    const NAME: &str = "atlasfit_report";
    const FIRST: usize = std::mem::offset_of!(Self, dropped_parts);
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
        let moved = r.registration.as_ref();
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
            dropped_parts: r.dropped_parts,
            dropped_points: r.dropped_points,
            followed_outliers: r.followed_outliers,
            uncertainty_factor: r.uncertainty_factor.unwrap_or(0.0),
            sweeps: moved.map_or(0, |m| m.sweeps.len()),
            apart_before: moved.map_or(0.0, |m| m.apart_before),
            apart_after: moved.map_or(0.0, |m| m.apart_after),
        };
        sized::write(report, value)
    })
}

/// Copies the warnings of denoising: what the user should hear, a line each, in English. No line where all
/// is well.
///
/// @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
/// @param capacity At least the length and 1, unless `text` is NULL.
/// @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_warnings(
    result: *const atlasfit_result,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> atlasfit_status {
    guard("atlasfit_result_warnings", || unsafe {
        copy_lines(&handle::get(result)?.denoised.report.warnings, text, capacity, length)
    })
}

/// How a sweep was moved, as sweeps of atlasfit_denoise_options asked for.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_sweep {
    /// sizeof(atlasfit_sweep), set by the caller.
    pub struct_size: usize,
    /// Its number, as the attribute has it.
    pub sweep: u32,
    /// 0.
    pub reserved: u32,
    /// Its points that are finite.
    pub points: usize,
    /// Its points that were seen on other sweeps, of those that were looked at. 0: it is where it was.
    pub pairs: usize,
    /// How far its points were moved, root mean square, in their unit.
    pub moved: f64,
    /// Where its points go: three rows of four, a rotation and a shift, in the points' frame and unit.
    pub matrix: [f64; 12],
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_sweep {
    const NAME: &str = "atlasfit_sweep";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// Tells how a sweep was moved. #ATLASFIT_INDEX_OUT_OF_RANGE where there are not that many.
///
/// @param index Its place among the sweeps, which are sorted by their numbers: 0 to report.sweeps - 1.
/// @param sweep Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_sweep(
    result: *const atlasfit_result,
    index: usize,
    sweep: *mut atlasfit_sweep,
) -> atlasfit_status {
    guard("atlasfit_result_sweep", || unsafe {
        sized::checked_target(sweep)?;
        let result = handle::get(result)?;
        let sweeps = result.denoised.report.registration.as_ref().map_or(&[][..], |r| &r.sweeps);
        let found = sweeps.get(index).ok_or_else(|| {
            Failure::new(
                ATLASFIT_INDEX_OUT_OF_RANGE,
                format!("index is {index}, but the sweeps that were moved are {}", sweeps.len()),
            )
        })?;
        let (turn, shift) = (&found.motion.rotation, found.motion.shift);
        let value = atlasfit_sweep {
            sweep: found.sweep,
            points: found.points,
            pairs: found.pairs,
            moved: found.moved,
            matrix: std::array::from_fn(|k| if k % 4 < 3 { turn[k / 4][k % 4] } else { shift[k / 4] }),
            ..atlasfit_sweep::defaults()
        };
        sized::write(sweep, value)
    })
}

/// Copies the denoised positions: x, y, z per point, in input order. Outliers that are kept, unless they
/// follow their neighbours in a mesh, and points that are not finite, are where they were.
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

/// Copies the denoised points' unit normals: 3 numbers per point. Points that are on no chart have the normal
/// that was given, or zeros; outliers that follow their neighbours in a mesh a mean of theirs.
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

/// Copies, for each denoised point, the index of the given point that it came from: 0, 1, 2, ... unless
/// outliers are dropped.
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

/// Copies, for each denoised point, the chart of the atlas that has the largest weight there; UINT32_MAX for
/// a point on no chart, which is an outlier or not finite.
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

/// Copies the surface's UVs: u, v in [0, 1], v up, for each corner of each triangle. #ATLASFIT_NOT_AVAILABLE
/// where the surface has none.
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

/// Copies the UV chart of each triangle, 0 to report.uv_charts - 1, or UINT32_MAX for a triangle on no chart.
/// #ATLASFIT_NOT_AVAILABLE where the surface has no UVs.
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

/// Copies the surface's colours: red, green, blue, alpha per vertex, 0 to 1. #ATLASFIT_NOT_AVAILABLE where
/// the points had none.
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
/// @param attribute Its place in the array that was given, 0 to report.attributes - 1. What watertight and
///                  uncertainty of the options add comes after those: the uncertainty, then whether a vertex
///                  was invented, each of width 1.
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

/// Gives the atlas that was fitted, as a handle of its own. It outlives the result and shares its memory.
/// Free it with atlasfit_atlas_free().
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
        handle::give(r.atlas.clone(), out);
        Ok(())
    })
}
