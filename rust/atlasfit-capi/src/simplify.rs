//! A mesh of the caller's with fewer triangles.

use crate::arrays::{available, copy_lines, copy_out};
use crate::handle::{self, Handle};
use crate::log;
use crate::mesh::{self, atlasfit_mesh};
use crate::run::{atlasfit_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{Outcome, atlasfit_status, guard};
use atlasfit::simplify::{SimplifiedMesh, SimplifyOptions, simplify_mesh};
use std::ffi::c_char;
use std::sync::Arc;

/// How far to simplify. Fill it with atlasfit_simplify_options_init(), then set faces, max_error or both.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_simplify_options {
    /// sizeof(atlasfit_simplify_options).
    pub struct_size: usize,
    /// Triangles that are few enough; 0 = as few as max_error allows. Default 0.
    pub faces: usize,
    /// How far any vertex, and the middle of any edge, may be from the new mesh, in the mesh's unit; 0 = as far
    /// as faces asks for. Default 0.
    pub max_error: f64,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_simplify_options {
    const NAME: &str = "atlasfit_simplify_options";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self { struct_size: size_of::<Self>(), faces: 0, max_error: 0.0 }
    }
}

/// Fills options with their defaults: nothing is asked for.
///
/// @param options     The struct to fill.
/// @param struct_size sizeof(atlasfit_simplify_options).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplify_options_init(
    options: *mut atlasfit_simplify_options,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_simplify_options_init", || unsafe { sized::init(options, struct_size) })
}

/// A mesh with fewer triangles. Immutable: any number of threads may read one at once.
pub struct atlasfit_simplified(());

impl Handle for atlasfit_simplified {
    type Target = SimplifiedMesh;
    const NAME: &str = "simplified mesh";
}

/// Makes a mesh of fewer triangles: larger where it is flat. Its boundary, and the seams of its UVs, stay
/// where they are within the error; both sides of a seam stay together, and no triangle turns over in UV
/// space. What is no surface (edges of three triangles, vertices that hold two sheets together) stays as it
/// is. Vertices at one place are one.
///
/// @param mesh    The mesh; corner_uv and colors are read.
/// @param options How far to simplify: faces, max_error or both.
/// @param run     How long work is run; NULL = the defaults.
/// @param out     Where the mesh is put; NULL on failure. Free it with atlasfit_simplified_free().
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
///         triangle names no vertex), #ATLASFIT_DEGENERATE (no area), #ATLASFIT_CANCELLED,
///         #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplify(
    mesh: *const atlasfit_mesh,
    options: *const atlasfit_simplify_options,
    run: *const atlasfit_run,
    out: *mut *mut atlasfit_simplified,
) -> atlasfit_status {
    guard("atlasfit_simplify", || unsafe {
        handle::checked_out(out)?;
        let o = sized::read_or_default(options)?;
        let options = SimplifyOptions::default()
            .with_faces((o.faces > 0).then_some(o.faces))
            .with_max_error((o.max_error != 0.0).then_some(o.max_error));
        let mut run = core_run(run)?;
        let mut mesh = mesh::mesh(mesh)?;
        let light = run.execute(|ctx| {
            mesh.cut(ctx)?;
            simplify_mesh(&mesh.mesh, &options, ctx)
        })?;
        log::warn(&light.warnings);
        handle::give(Arc::new(light), out);
        Ok(())
    })
}

/// Frees a simplified mesh; NULL is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_free(mesh: *mut atlasfit_simplified) -> atlasfit_status {
    guard("atlasfit_simplified_free", || handle::free(mesh))
}

/// How large a simplified mesh is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_simplified_info {
    /// sizeof(atlasfit_simplified_info), set by the caller.
    pub struct_size: usize,
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// 1 if it has UVs, as the mesh had, else 0.
    pub has_uv: u32,
    /// 1 if it has colours, as the mesh had, else 0.
    pub has_colors: u32,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_simplified_info {
    const NAME: &str = "atlasfit_simplified_info";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// Tells how large a simplified mesh is.
///
/// @param info Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_get_info(
    mesh: *const atlasfit_simplified,
    info: *mut atlasfit_simplified_info,
) -> atlasfit_status {
    guard("atlasfit_simplified_get_info", || unsafe {
        let m = &handle::get(mesh)?.mesh;
        let value = atlasfit_simplified_info {
            struct_size: size_of::<atlasfit_simplified_info>(),
            vertices: m.positions.len(),
            triangles: m.triangles.len(),
            has_uv: u32::from(m.corner_uv.is_some()),
            has_colors: u32::from(m.colors.is_some()),
        };
        sized::write(info, value)
    })
}

/// Copies the warnings of simplifying: what the user should hear, a line each, in English.
///
/// @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
/// @param capacity At least the length and 1, unless `text` is NULL.
/// @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_warnings(
    mesh: *const atlasfit_simplified,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> atlasfit_status {
    guard("atlasfit_simplified_warnings", || unsafe {
        copy_lines(&handle::get(mesh)?.warnings, text, capacity, length)
    })
}

/// A column of a simplified mesh to the caller's buffer.
unsafe fn copied<T: Copy>(
    mesh: *const atlasfit_simplified,
    to: *mut T,
    capacity: usize,
    name: &str,
    column: impl Fn(&SimplifiedMesh) -> Outcome<&[T]>,
) -> Outcome {
    let held = handle::get(mesh)?;
    unsafe { copy_out(column(&held)?, to, capacity, name) }
}

/// Copies the vertex positions: x, y, z per vertex.
///
/// @param xyz      Room for `capacity` numbers.
/// @param capacity At least 3 * info.vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_positions(
    mesh: *const atlasfit_simplified,
    xyz: *mut f64,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_simplified_positions", || unsafe {
        copied(mesh, xyz, capacity, "positions", |m| Ok(m.mesh.positions.as_flattened()))
    })
}

/// Copies the triangles: 3 vertex indices each.
///
/// @param triangles Room for `capacity` numbers.
/// @param capacity  At least 3 * info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_triangles(
    mesh: *const atlasfit_simplified,
    triangles: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_simplified_triangles", || unsafe {
        copied(mesh, triangles, capacity, "triangles", |m| Ok(m.mesh.triangles.as_flattened()))
    })
}

/// Copies, for each vertex, a vertex of the given mesh that is near: for columns of the caller's own.
///
/// @param sources  Room for `capacity` numbers.
/// @param capacity At least info.vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_sources(
    mesh: *const atlasfit_simplified,
    sources: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_simplified_sources", || unsafe {
        copied(mesh, sources, capacity, "sources", |m| Ok(&m.source))
    })
}

/// Copies the UVs: u, v for each corner of each triangle, those of the same places on the given mesh.
/// #ATLASFIT_NOT_AVAILABLE where that had none.
///
/// @param corner_uv Room for `capacity` numbers.
/// @param capacity  At least 6 * info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_corner_uv(
    mesh: *const atlasfit_simplified,
    corner_uv: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_simplified_corner_uv", || unsafe {
        copied(mesh, corner_uv, capacity, "corner UVs", |m| {
            Ok(available(&m.mesh.corner_uv, "UVs")?.as_flattened().as_flattened())
        })
    })
}

/// Copies the colours: red, green, blue, alpha per vertex, 0 to 1. #ATLASFIT_NOT_AVAILABLE where the given
/// mesh had none.
///
/// @param rgba     Room for `capacity` numbers.
/// @param capacity At least 4 * info.vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_simplified_colors(
    mesh: *const atlasfit_simplified,
    rgba: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_simplified_colors", || unsafe {
        copied(mesh, rgba, capacity, "colours", |m| Ok(available(&m.mesh.colors, "colours")?.as_flattened()))
    })
}
