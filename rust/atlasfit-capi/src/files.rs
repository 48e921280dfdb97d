//! Files of scans and meshes: read into a handle, written from the caller's arrays.
//!
//! In: a path. Out: a handle with the file's points, faces and columns, and getters that copy them; or a
//! file.
//! The formats are those of atlasfit-io, which the program reads and writes too.

use crate::arrays::{
    ATLASFIT_F32, ATLASFIT_F64, ATLASFIT_I8, ATLASFIT_I16, ATLASFIT_I32, ATLASFIT_U8, ATLASFIT_U16,
    ATLASFIT_U32, available, copy_lines, copy_out, text,
};
use crate::handle::{self, Handle};
use crate::log;
use crate::run::{atlasfit_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{
    ATLASFIT_BAD_FILE, ATLASFIT_INDEX_OUT_OF_RANGE, ATLASFIT_IO, ATLASFIT_OUT_OF_MEMORY, Failure, Outcome,
    atlasfit_status, guard,
};
use atlasfit::Stage;
use atlasfit::geometry::{Attribute, ScalarKind};
use atlasfit_io::{LoadOptions, Loaded};
use std::ffi::c_char;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Once};

/// What a file holds: points, the faces between them if there are any, and columns beside them. Immutable:
/// any number of threads may read one at once.
pub struct atlasfit_file(());

impl Handle for atlasfit_file {
    type Target = Loaded;
    const NAME: &str = "file";
}

/// Frees what was read of a file; NULL is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_free(file: *mut atlasfit_file) -> atlasfit_status {
    guard("atlasfit_file_free", || handle::free(file))
}

impl From<atlasfit_io::Error> for Failure {
    fn from(e: atlasfit_io::Error) -> Self {
        use atlasfit_io::Error::{AllocationFailed, Io, OutOfMemory, Stopped};
        match e {
            Stopped(core) => core.into(),
            Io { .. } => Self::new(ATLASFIT_IO, e.to_string()),
            OutOfMemory { .. } | AllocationFailed { .. } => Self::new(ATLASFIT_OUT_OF_MEMORY, e.to_string()),
            _ => Self::new(ATLASFIT_BAD_FILE, e.to_string()),
        }
    }
}

/// Bytes of a path, at the most: a longer one is taken for one without its end.
const LONGEST_PATH: usize = 1 << 15;

#[cfg(unix)]
pub(crate) unsafe fn path_of(path: *const c_char) -> Outcome<PathBuf> {
    use std::os::unix::ffi::OsStrExt;
    let bytes = unsafe { text(path, "path", LONGEST_PATH) }?;
    Ok(Path::new(std::ffi::OsStr::from_bytes(bytes)).to_owned())
}

#[cfg(not(unix))]
pub(crate) unsafe fn path_of(path: *const c_char) -> Outcome<PathBuf> {
    let bytes = unsafe { text(path, "path", LONGEST_PATH) }?;
    let text = std::str::from_utf8(bytes).map_err(|_| Failure::invalid("the path is no UTF-8"))?;
    Ok(Path::new(text).to_owned())
}

/// Panics of other crates' readers on damaged files become errors, which say more than the panic's own text.
fn silence_handled_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let tell = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !atlasfit_io::panics_become_errors() {
                tell(panic);
            }
        }));
    });
}

/// Reads a file: PLY, OBJ, OFF, STL, XYZ and other columns of numbers, PCD, LAS, LAZ, E57, glTF. Its content
/// decides the format, its name only breaks ties. Polygons are cut into triangles.
///
/// @param path The file's path: UTF-8, on Unix any bytes.
/// @param run  Memory and time limit, progress and cancel of the reading; NULL = the defaults.
/// @param out  Where the handle is put; NULL on failure.
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_IO (the file cannot be
///         opened or read), #ATLASFIT_BAD_FILE (of no known format, or broken beyond repair),
///         #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_load(
    path: *const c_char,
    run: *const atlasfit_run,
    out: *mut *mut atlasfit_file,
) -> atlasfit_status {
    guard("atlasfit_file_load", || {
        handle::checked_out(out)?;
        let path = unsafe { path_of(path) }?;
        let mut run = unsafe { core_run(run) }?;
        silence_handled_panics();
        let limit = run.memory_limit_bytes;
        let loaded = run.execute(|ctx| {
            ctx.stage(Stage::Read, 1);
            let how = LoadOptions::default().with_max_memory_bytes(limit).with_stop(ctx.stop());
            Ok(atlasfit_io::load(&path, &how))
        })??;
        log::warn(&notes(&loaded));
        handle::give(Arc::new(loaded), out);
        Ok(())
    })
}

/// What a file holds.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_file_info {
    /// sizeof(atlasfit_file_info), set by the caller.
    pub struct_size: usize,
    /// Points; of a mesh its vertices.
    pub points: usize,
    /// Triangles; 0 of a cloud.
    pub triangles: usize,
    /// Attributes: columns besides positions, normals and colours.
    pub attributes: usize,
    /// Bytes of the image that colours the faces; 0 without one.
    pub texture_bytes: usize,
    /// 1 if the points have normals, else 0.
    pub has_normals: u32,
    /// 1 if the points have colours, else 0.
    pub has_colors: u32,
    /// 1 if the triangles have UVs, else 0.
    pub has_uv: u32,
    /// 1 if the triangles have UV charts, else 0.
    pub has_face_charts: u32,
    /// 1 if the file says where the one scanner stood that measured it, else 0.
    pub has_viewpoint: u32,
    /// 1 if the normals of some vertices differ between their triangles, else 0.
    pub has_corner_normals: u32,
    /// Where it stood, for viewpoint of atlasfit_denoise_options.
    pub viewpoint: [f64; 3],
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_file_info {
    const NAME: &str = "atlasfit_file_info";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// Tells what a file holds, and how large its arrays are.
///
/// @param info Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_get_info(
    file: *const atlasfit_file,
    info: *mut atlasfit_file_info,
) -> atlasfit_status {
    guard("atlasfit_file_get_info", || unsafe {
        let f = handle::get(file)?;
        let scanners = f.cloud.scanners.as_ref().map_or(&[][..], |s| &s.positions);
        let viewpoint = if let [one] = scanners { Some(*one) } else { None };
        let value = atlasfit_file_info {
            struct_size: size_of::<atlasfit_file_info>(),
            points: f.cloud.len(),
            triangles: f.faces.len(),
            attributes: f.cloud.attributes.len(),
            texture_bytes: f.texture.as_ref().map_or(0, Vec::len),
            has_normals: u32::from(f.cloud.normals.is_some()),
            has_colors: u32::from(f.cloud.colors.is_some()),
            has_uv: u32::from(f.corner_uv.is_some()),
            has_face_charts: u32::from(f.face_chart.is_some()),
            has_viewpoint: u32::from(viewpoint.is_some()),
            has_corner_normals: u32::from(f.corner_normals.is_some()),
            viewpoint: viewpoint.unwrap_or_default(),
        };
        sized::write(info, value)
    })
}

/// Copies what had to be repaired or left out while reading, a line each, in English. No line where all is
/// well.
///
/// @param text     Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
/// @param capacity At least the length and 1, unless `text` is NULL.
/// @param length   Set to the bytes that the lines take, without the 0, also with #ATLASFIT_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_notes(
    file: *const atlasfit_file,
    text: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> atlasfit_status {
    guard("atlasfit_file_notes", || unsafe {
        copy_lines(&notes(&*handle::get(file)?), text, capacity, length)
    })
}

/// What was mended while reading, and what was left out.
fn notes(f: &Loaded) -> Vec<String> {
    let repairs = f.report.notes.iter().map(ToString::to_string);
    let left_out = f.left_out.iter().map(|l| format!("left out: {l}"));
    repairs.chain(left_out).collect()
}

/// Copies the positions: x, y, z per point, in the file's order and unit. Points that are not finite are
/// among them.
///
/// @param xyz      Room for `capacity` numbers.
/// @param capacity At least 3 * info.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_positions(
    file: *const atlasfit_file,
    xyz: *mut f64,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_positions", || unsafe {
        copy_out(handle::get(file)?.cloud.positions.as_flattened(), xyz, capacity, "positions")
    })
}

/// Copies the normals: 3 numbers per point, zeros where none is known. #ATLASFIT_NOT_AVAILABLE without.
///
/// @param normals  Room for `capacity` numbers.
/// @param capacity At least 3 * info.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_normals(
    file: *const atlasfit_file,
    normals: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_normals", || unsafe {
        let f = handle::get(file)?;
        copy_out(available(&f.cloud.normals, "normals")?.as_flattened(), normals, capacity, "normals")
    })
}

/// Copies the colours: red, green, blue, alpha per point, 0 to 1, encoded as they were stored.
/// #ATLASFIT_NOT_AVAILABLE without.
///
/// @param rgba     Room for `capacity` numbers.
/// @param capacity At least 4 * info.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_colors(
    file: *const atlasfit_file,
    rgba: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_colors", || unsafe {
        let f = handle::get(file)?;
        copy_out(available(&f.cloud.colors, "colours")?.as_flattened(), rgba, capacity, "colours")
    })
}

/// Copies the triangles: 3 vertex indices each.
///
/// @param triangles Room for `capacity` numbers.
/// @param capacity  At least 3 * info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_triangles(
    file: *const atlasfit_file,
    triangles: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_triangles", || unsafe {
        copy_out(handle::get(file)?.faces.as_flattened(), triangles, capacity, "triangles")
    })
}

/// Copies the UVs: u, v, v up, for each corner of each triangle. #ATLASFIT_NOT_AVAILABLE without.
///
/// @param corner_uv Room for `capacity` numbers.
/// @param capacity  At least 6 * info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_corner_uv(
    file: *const atlasfit_file,
    corner_uv: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_corner_uv", || unsafe {
        let f = handle::get(file)?;
        let all = available(&f.corner_uv, "UVs")?;
        copy_out(all.as_flattened().as_flattened(), corner_uv, capacity, "corner UVs")
    })
}

/// Copies the unit normals at the corners of the triangles: 3 numbers each. #ATLASFIT_NOT_AVAILABLE where
/// those of the points hold.
///
/// @param corner_normals Room for `capacity` numbers.
/// @param capacity       At least 9 * info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_corner_normals(
    file: *const atlasfit_file,
    corner_normals: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_corner_normals", || unsafe {
        let f = handle::get(file)?;
        let all = available(&f.corner_normals, "normals of corners")?;
        copy_out(all.as_flattened().as_flattened(), corner_normals, capacity, "corner normals")
    })
}

/// Copies the UV chart of each triangle. #ATLASFIT_NOT_AVAILABLE without.
///
/// @param face_charts Room for `capacity` numbers.
/// @param capacity    At least info.triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_face_charts(
    file: *const atlasfit_file,
    face_charts: *mut u32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_face_charts", || unsafe {
        let f = handle::get(file)?;
        copy_out(available(&f.face_chart, "UV charts")?, face_charts, capacity, "face charts")
    })
}

/// Copies the image that colours the faces through their UVs, as the bytes of its file (PNG or JPEG).
/// #ATLASFIT_NOT_AVAILABLE without.
///
/// @param bytes    Room for `capacity` bytes.
/// @param capacity At least info.texture_bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_texture(
    file: *const atlasfit_file,
    bytes: *mut u8,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_texture", || unsafe {
        let f = handle::get(file)?;
        copy_out(available(&f.texture, "texture")?, bytes, capacity, "the texture")
    })
}

fn attribute_of(file: &Loaded, index: usize) -> Outcome<&Attribute> {
    let all = &file.cloud.attributes;
    all.get(index).ok_or_else(|| {
        Failure::new(
            ATLASFIT_INDEX_OUT_OF_RANGE,
            format!("attribute is {index}, but there are only {}", all.len()),
        )
    })
}

/// Tells the name and type of an attribute.
///
/// @param attribute Its place, 0 to info.attributes - 1.
/// @param name      Room for `capacity` bytes, filled with UTF-8 and a 0; NULL to ask for the length.
/// @param capacity  At least the length and 1, unless `name` is NULL.
/// @param length    Set to the bytes that the name takes, without the 0.
/// @param width     Set to the numbers per point; NULL = not wanted.
/// @param scalar    Set to the type that the file keeps them in, #ATLASFIT_F32 to #ATLASFIT_I32; NULL = not
///                  wanted.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_attribute_type(
    file: *const atlasfit_file,
    attribute: usize,
    name: *mut c_char,
    capacity: usize,
    length: *mut usize,
    width: *mut u32,
    scalar: *mut u32,
) -> atlasfit_status {
    guard("atlasfit_file_attribute_type", || unsafe {
        let f = handle::get(file)?;
        let a = attribute_of(&f, attribute)?;
        copy_lines(std::slice::from_ref(&a.name), name, capacity, length)?;
        let kind = match a.kind {
            ScalarKind::F32 => ATLASFIT_F32,
            ScalarKind::F64 => ATLASFIT_F64,
            ScalarKind::U8 => ATLASFIT_U8,
            ScalarKind::I8 => ATLASFIT_I8,
            ScalarKind::U16 => ATLASFIT_U16,
            ScalarKind::I16 => ATLASFIT_I16,
            ScalarKind::U32 => ATLASFIT_U32,
            ScalarKind::I32 => ATLASFIT_I32,
        };
        for (to, value) in [(width, a.width as u32), (scalar, kind)] {
            if !to.is_null() {
                // SAFETY: the caller's number.
                to.write_unaligned(value);
            }
        }
        Ok(())
    })
}

/// Copies an attribute: its numbers per point, exact for all types.
///
/// @param attribute Its place, 0 to info.attributes - 1.
/// @param values    Room for `capacity` numbers.
/// @param capacity  At least the attribute's width * info.points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_attribute(
    file: *const atlasfit_file,
    attribute: usize,
    values: *mut f64,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_attribute", || unsafe {
        let f = handle::get(file)?;
        copy_out(&attribute_of(&f, attribute)?.values, values, capacity, "the attribute")
    })
}
