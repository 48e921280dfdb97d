//! Files of scans and meshes, written.
//!
//! In: a path, the caller's arrays. Out: a file in one of the formats of atlasfit-io, and what it could not
//! hold.

use crate::arrays::{column, packed};
use crate::faces::Faces;
use crate::files::path_of;
use crate::log;
use crate::points::{self, atlasfit_points};
use crate::run::{atlasfit_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{ATLASFIT_BAD_FILE, Failure, Outcome, atlasfit_status, copy_text, guard};
use atlasfit::geometry::{self, PointCloud, TriMesh};
use atlasfit::{Context, Stage, Stop};
use atlasfit_io::{Format, Polygons, SaveCloud, SaveMesh, Saved, Texture};
use std::ffi::c_char;
use std::path::Path;

/// What a file is to hold besides the points, and how it is written. Fill it with
/// atlasfit_save_options_init();
/// a NULL pointer to one means the defaults.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_save_options {
    /// sizeof(atlasfit_save_options).
    pub struct_size: usize,
    /// u, v of each corner of each triangle or face of the points, v up. NULL = none. Default NULL.
    pub corner_uv: *const f32,
    /// UV chart of each triangle or face. NULL = none. Default NULL.
    pub face_charts: *const u32,
    /// The bytes of a PNG file that the UVs show. GLB holds it inside, else it goes to a file beside the
    /// output.
    /// NULL = none. Default NULL.
    pub texture: *const u8,
    /// Number of these bytes.
    pub texture_bytes: usize,
    /// 1 for text where a format has both, 0 for binary. Default 0.
    pub ascii: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Unit normal at each corner of each triangle or face of the points, 3 numbers, where those of a vertex
    /// differ, as at creases: OBJ and GLB hold them. NULL = those of the points. Default NULL.
    pub corner_normals: *const f32,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_save_options {
    const NAME: &str = "atlasfit_save_options";
    const FIRST: usize = std::mem::offset_of!(Self, corner_normals);
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            corner_uv: std::ptr::null(),
            face_charts: std::ptr::null(),
            texture: std::ptr::null(),
            texture_bytes: 0,
            ascii: 0,
            reserved: 0,
            corner_normals: std::ptr::null(),
        }
    }
}

/// Fills options with their defaults.
///
/// @param options     The struct to fill.
/// @param struct_size sizeof(atlasfit_save_options).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_save_options_init(
    options: *mut atlasfit_save_options,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_save_options_init", || unsafe { sized::init(options, struct_size) })
}

/// Writes points, or with their `triangles` or `faces` a mesh, to a file: PLY, OBJ, GLB, OFF, STL, XYZ, by
/// the name's extension. PLY, OBJ and OFF hold polygons as they are, GLB and STL the triangles that they
/// are cut into. Faces of fewer than three corners are left out. The file is written whole or not at all;
/// one that exists is replaced. Images and material libraries go beside it.
///
/// @param path     The file's path: UTF-8, on Unix any bytes.
/// @param points   Positions, normals, colours, attributes, and triangles or faces.
/// @param options  What the file is to hold besides; NULL = nothing.
/// @param run      Memory and time limit, progress and cancel of the writing; NULL = the defaults.
/// @param lost     Room for `capacity` bytes, filled with UTF-8 and a 0: what the format could not hold, a
///                 line each, cut where there is no more room. NULL = not wanted.
/// @param capacity Bytes that `lost` has room for.
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_IO (the file cannot be
///         written), #ATLASFIT_BAD_FILE (an extension that is not written, a triangle that names no vertex,
///         no faces for a format that holds only those), #ATLASFIT_INDEX_OUT_OF_RANGE (a corner of
///         `faces` that names no vertex), #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_file_save(
    path: *const c_char,
    points: *const atlasfit_points,
    options: *const atlasfit_save_options,
    run: *const atlasfit_run,
    lost: *mut c_char,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_file_save", || {
        let (path, o) = unsafe { (path_of(path)?, sized::read_or_default(options)?) };
        sized::zero(o.reserved)?;
        let ascii = sized::flag(o.ascii, "ascii")?;
        // SAFETY: the caller's arrays have an entry per point, triangle or byte.
        let (mut run, mut whole, texture) = unsafe {
            let texture = packed(o.texture, o.texture_bytes, "bytes of the texture")?;
            (core_run(run)?, whole_of(points, &o)?, texture)
        };
        let format = Format::from_path(&path);
        // A cancel that was asked for before is heard here.
        run.execute(|ctx| {
            ctx.stage(Stage::Write, 1);
            whole.cut(ctx)?;
            let uv = whole.mesh.corner_uv.as_ref().map_or(0, |uv| size_of_val(&uv[..]));
            let normals = whole.mesh.corner_normals.as_ref().map_or(0, |n| size_of_val(&n[..]));
            let bytes = whole.mesh.bytes() + texture.len() as u64;
            let needed = format.map_or(0, |f| f.memory_to_write(bytes, (uv + normals) as u64));
            ctx.reserve(needed, "Raise the limit, or write a PLY file")
        })?;
        if whole.mesh.triangles.is_empty() && format.is_some_and(|f| !f.holds_points()) {
            return Err(Failure::new(
                ATLASFIT_BAD_FILE,
                "there are no triangles, and a file of this format holds nothing else. Use .ply or .xyz",
            ));
        }
        let mut written = None;
        let ended = run.execute(|ctx| {
            ctx.stage(Stage::Write, 1);
            written = Some(write(&path, whole, &texture, ascii, &ctx.stop()));
            Ok(())
        });
        let saved = match written {
            // One that arrives when the file is there comes too late.
            Some(saved) => saved?,
            None => return Err(ended.err().unwrap_or(atlasfit::Error::Cancelled).into()),
        };
        log::warn(&saved.lost);
        unsafe { copy_text(&saved.lost.join("\n"), lost, capacity) };
        Ok(())
    })
}

/// What a file is to hold. After [`Whole::cut`] all faces are triangles of the mesh, and `polygons` says what
/// those were cut from.
struct Whole {
    mesh: TriMesh,
    polygons: Option<Polygons>,
    uncut: Option<Uncut>,
}

/// Faces that are still to be cut.
struct Uncut {
    faces: Faces,
    /// UVs of their corners.
    uv: Option<Vec<[f32; 2]>>,
    /// Normals of their corners.
    normals: Option<Vec<[f32; 3]>>,
    /// The chart of each.
    charts: Option<Vec<u32>>,
}

impl Whole {
    fn cut(&mut self, ctx: &Context<'_>) -> atlasfit::Result<()> {
        let Some(Uncut { faces, uv, normals, charts }) = self.uncut.take() else { return Ok(()) };
        let Faces { corners, offsets } = faces;
        let mesh = &mut self.mesh;
        let cut = geometry::Polygons::new(&mesh.positions, corners, offsets, None, ctx)?;
        let (mut sizes, mut corners) = (Vec::with_capacity(cut.len()), Vec::with_capacity(cut.corners.len()));
        for ends in cut.offsets.windows(2).filter(|ends| ends[1] - ends[0] >= 3) {
            sizes.push(ends[1] - ends[0]);
            corners.extend_from_slice(&cut.corners[ends[0] as usize..ends[1] as usize]);
        }
        self.polygons = Some(Polygons { sizes, corners });
        mesh.corner_uv = uv.map(|uv| cut.of_triangle_corners(&uv));
        mesh.corner_normals = normals.map(|normals| cut.of_triangle_corners(&normals));
        mesh.face_chart = charts.map(|charts| cut.of_triangles(&charts));
        mesh.triangles = cut.triangles;
        Ok(())
    }
}

/// The caller's points, triangles or faces, and their columns.
unsafe fn whole_of(points: *const atlasfit_points, o: &atlasfit_save_options) -> Outcome<Whole> {
    // SAFETY: the caller's arrays have an entry per point, triangle, face or corner.
    unsafe {
        let PointCloud { positions, normals, colors, attributes, .. } = points::cloud(points)?;
        let (triangles, faces) = points::faces(points)?;
        let count = faces.as_ref().map_or(triangles.len(), |f| f.offsets.len() - 1);
        let charts = column(o.face_charts, count, "face_charts")?;
        let mut mesh = TriMesh { normals, colors, attributes, ..TriMesh::new(positions, triangles) };
        let uncut = match faces {
            Some(faces) => {
                let uv = column(o.corner_uv.cast::<[f32; 2]>(), faces.corners.len(), "corner_uv")?;
                let normals = o.corner_normals.cast::<[f32; 3]>();
                let normals = column(normals, faces.corners.len(), "corner_normals")?;
                Some(Uncut { faces, uv, normals, charts })
            }
            None => {
                mesh.corner_uv = column(o.corner_uv.cast::<[[f32; 2]; 3]>(), count, "corner_uv")?;
                let normals = o.corner_normals.cast::<[[f32; 3]; 3]>();
                mesh.corner_normals = column(normals, count, "corner_normals")?;
                mesh.face_chart = charts;
                None
            }
        };
        Ok(Whole { mesh, polygons: None, uncut })
    }
}

/// Writes a mesh, or a cloud where there are no triangles.
fn write(path: &Path, whole: Whole, texture: &[u8], ascii: bool, stop: &Stop) -> atlasfit_io::Result<Saved> {
    let Whole { mesh, polygons, .. } = whole;
    if !mesh.triangles.is_empty() {
        let png = (!texture.is_empty()).then_some(Texture::Png(texture));
        let how = SaveMesh::default().with_ascii(ascii).with_stop(stop.clone()).with_texture(png);
        let how = how.with_polygons(polygons.as_ref());
        return atlasfit_io::save_mesh(path, &mesh, &how);
    }
    let TriMesh { positions, normals, colors, attributes, .. } = mesh;
    let cloud = PointCloud { positions, normals, colors, scanners: None, attributes };
    let how = SaveCloud::default().with_ascii(ascii).with_stop(stop.clone());
    atlasfit_io::save_cloud(path, &cloud, &how)
}
