//! A fitted atlas: what it holds, projection onto it, evaluation of its charts.

use crate::arrays;
use crate::handle::{self, Handle};
use crate::points::{self, atlasfit_points};
use crate::run::{atlasfit_run, brief_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{
    ATLASFIT_BUFFER_TOO_SMALL, ATLASFIT_INDEX_OUT_OF_RANGE, Failure, atlasfit_status, guard,
};
use atlasfit::atlas::file;
use atlasfit::atlas::query::{Atlas, OnAtlas};
use atlasfit::numeric::vec3::{self, Vec3};
use std::sync::Arc;

/// A fitted atlas: overlapping charts, each a smooth map from plane coordinates (u, v) in [-1, 1] into space.
/// Most charts are sheets over the unit disk; charts of thin tubes have u along the tube and v = angle / pi
/// around it. Immutable: any number of threads may use one at once.
pub struct atlasfit_atlas(());

impl Handle for atlasfit_atlas {
    type Target = Atlas;
    const NAME: &str = "atlas";
}

/// Frees an atlas; NULL is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_atlas_free(atlas: *mut atlasfit_atlas) -> atlasfit_status {
    guard("atlasfit_atlas_free", || handle::free(atlas))
}

/// What an atlas holds.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_atlas_info {
    /// sizeof(atlasfit_atlas_info), set by the caller.
    pub struct_size: usize,
    /// Number of charts.
    pub charts: usize,
    /// Origin of the frame that the charts are held in, in the scan's frame.
    pub origin: [f64; 3],
    /// Length of that frame's unit in the scan's unit: about the scan's longest side.
    pub unit: f64,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_atlas_info {
    const NAME: &str = "atlasfit_atlas_info";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self { struct_size: size_of::<Self>(), charts: 0, origin: [0.0; 3], unit: 0.0 }
    }
}

/// Tells what an atlas holds.
///
/// @param info Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_atlas_get_info(
    atlas: *const atlasfit_atlas,
    info: *mut atlasfit_atlas_info,
) -> atlasfit_status {
    guard("atlasfit_atlas_get_info", || unsafe {
        let a = handle::get(atlas)?;
        let value = atlasfit_atlas_info {
            struct_size: size_of::<atlasfit_atlas_info>(),
            charts: a.charts().len(),
            origin: a.origin().into(),
            unit: a.unit(),
        };
        sized::write(info, value)
    })
}

/// Where projection puts its results: arrays of the caller. Each has room for `capacity` points, or is NULL
/// where it is not wanted.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_projection {
    /// sizeof(atlasfit_projection).
    pub struct_size: usize,
    /// Points that each array has room for; at least as many as are projected.
    pub capacity: usize,
    /// x, y, z per point.
    pub positions: *mut f64,
    /// Unit normal per point, 3 numbers, in the atlas's orientation.
    pub normals: *mut f32,
    /// Nearest chart per point. UINT32_MAX for a point that is not finite: its position is given back, its
    /// other numbers are 0.
    pub charts: *mut u32,
    /// Coordinates in that chart, 2 numbers per point.
    pub chart_uv: *mut f32,
    /// Distance from the point to its projection.
    pub distances: *mut f64,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_projection {
    const NAME: &str = "atlasfit_projection";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            capacity: 0,
            positions: std::ptr::null_mut(),
            normals: std::ptr::null_mut(),
            charts: std::ptr::null_mut(),
            chart_uv: std::ptr::null_mut(),
            distances: std::ptr::null_mut(),
        }
    }
}

/// Fills a projection with its defaults: no array.
///
/// @param projection  The struct to fill.
/// @param struct_size sizeof(atlasfit_projection).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_projection_init(
    projection: *mut atlasfit_projection,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_projection_init", || unsafe { sized::init(projection, struct_size) })
}

/// Moves each point to the nearest place on the atlas's surface; results are in the order of the points. This
/// denoises points that the atlas was not fitted to, or the vertices of any mesh. It is accurate for points
/// whose distance to the surface is less than the surface's radius of curvature.
///
/// @param atlas  The atlas.
/// @param points Points; only their positions are read.
/// @param run    How long work is run; NULL = the defaults.
/// @param out    Where results are put. Its arrays may not overlap the points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_atlas_project(
    atlas: *const atlasfit_atlas,
    points: *const atlasfit_points,
    run: *const atlasfit_run,
    out: *const atlasfit_projection,
) -> atlasfit_status {
    guard("atlasfit_atlas_project", || unsafe {
        let a = handle::get(atlas)?;
        let out = sized::read(out)?;
        let mut run = core_run(run)?;
        let queries = points::cloud_positions(points)?;
        if out.capacity < queries.len() {
            return Err(Failure::new(
                ATLASFIT_BUFFER_TOO_SMALL,
                format!("capacity is {}, but there are {} points", out.capacity, queries.len()),
            ));
        }
        let found = run.execute(|ctx| a.project(vec3::of(&queries), ctx))?;
        let found: Vec<OnAtlas> = found
            .into_iter()
            .zip(&queries)
            .map(|(f, &position)| {
                f.unwrap_or(OnAtlas {
                    position: Vec3(position),
                    normal: Vec3::ZERO,
                    chart: u32::MAX,
                    uv: [0.0; 2],
                    distance: 0.0,
                })
            })
            .collect();
        write(out.positions, found.iter().map(|f| f.position));
        write(out.normals, found.iter().map(|f| f.normal.to_f32()));
        write(out.charts, found.iter().map(|f| f.chart));
        write(out.chart_uv, found.iter().map(|f| f.uv.map(|x| x as f32)));
        write(out.distances, found.iter().map(|f| f.distance));
        Ok(())
    })
}

/// Writes values one after the other, as groups of `Number`s; nowhere for NULL.
unsafe fn write<Number, Group>(to: *mut Number, values: impl Iterator<Item = Group>) {
    if !to.is_null() {
        for (i, value) in values.enumerate() {
            // SAFETY: the caller's array has room for every point's numbers.
            unsafe { to.cast::<Group>().add(i).write_unaligned(value) };
        }
    }
}

/// Evaluates a chart: the places of chart coordinates. Takes well under a microsecond per place.
///
/// @param atlas    The atlas.
/// @param chart    Index of the chart, 0 to info.charts - 1.
/// @param uv       u, v of each place, from -1 to 1.
/// @param count    Number of places.
/// @param xyz      x, y, z per place; NULL = not wanted.
/// @param normals  Unit normal per place, 3 numbers; NULL = not wanted.
/// @param inside   How far inside the surface each place is, from 0 (outside the chart's domain) to 1; one
///                 half at the surface's edge. NULL = not wanted.
/// @param capacity Places that each array has room for, at least `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_atlas_eval(
    atlas: *const atlasfit_atlas,
    chart: usize,
    uv: *const f64,
    count: usize,
    xyz: *mut f64,
    normals: *mut f32,
    inside: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_atlas_eval", || unsafe {
        let a = handle::get(atlas)?;
        if chart >= a.charts().len() {
            return Err(Failure::new(
                ATLASFIT_INDEX_OUT_OF_RANGE,
                format!("chart is {chart}, but there are only {}", a.charts().len()),
            ));
        }
        if capacity < count {
            return Err(Failure::new(
                ATLASFIT_BUFFER_TOO_SMALL,
                format!("capacity is {capacity}, but there are {count} places"),
            ));
        }
        let uv = arrays::packed(uv.cast::<[f64; 2]>(), count, "uv")?;
        if let Some(i) = uv.iter().position(|uv| !uv.iter().all(|x| x.abs() <= 1.0)) {
            return Err(Failure::invalid(format!(
                "uv of place {i} is {:?}. Give coordinates from -1 to 1",
                uv[i]
            )));
        }
        let places: Vec<_> = uv.iter().filter_map(|&uv| a.place(chart, uv)).collect();
        write(xyz, places.iter().map(|p| p.position));
        write(normals, places.iter().map(|p| p.normal.to_f32()));
        write(inside, places.iter().map(|p| p.inside as f32));
        Ok(())
    })
}

/// Writes an atlas as the bytes of a safetensors file, about 1 KB per chart. The same atlas gives the same
/// bytes.
///
/// @param atlas    The atlas.
/// @param bytes    Room for `capacity` bytes; NULL to ask for the size.
/// @param capacity At least the size, unless `bytes` is NULL.
/// @param size     Set to the number of bytes that the atlas takes, also with #ATLASFIT_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_atlas_save(
    atlas: *const atlasfit_atlas,
    bytes: *mut u8,
    capacity: usize,
    size: *mut usize,
) -> atlasfit_status {
    guard("atlasfit_atlas_save", || unsafe {
        let a = handle::get(atlas)?;
        if size.is_null() {
            return Err(Failure::invalid("size is NULL. Give the address of a size_t"));
        }
        let all = file::to_bytes(&a)?;
        size.write_unaligned(all.len());
        if bytes.is_null() {
            return Ok(());
        }
        arrays::copy_out(&all, bytes, capacity, "bytes")
    })
}

/// Reads an atlas from bytes that atlasfit_atlas_save() made. The bytes need not be trusted: any that are not
/// a valid atlas give #ATLASFIT_BAD_FILE.
///
/// @param bytes The bytes, borrowed for the call.
/// @param size  Their number.
/// @param out   Where the atlas is put; NULL on failure. Free it with atlasfit_atlas_free().
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_BAD_FILE, #ATLASFIT_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_atlas_load(
    bytes: *const u8,
    size: usize,
    out: *mut *mut atlasfit_atlas,
) -> atlasfit_status {
    guard("atlasfit_atlas_load", || unsafe {
        handle::checked_out(out)?;
        if bytes.is_null() || isize::try_from(size).is_err() {
            return Err(Failure::invalid(format!(
                "bytes is NULL, or {size} bytes are more than memory holds"
            )));
        }
        // SAFETY: the caller gives `size` bytes.
        let bytes = std::slice::from_raw_parts(bytes, size);
        let atlas = brief_run().execute(|ctx| file::from_bytes(bytes, ctx))?;
        handle::give(Arc::new(atlas), out);
        Ok(())
    })
}
