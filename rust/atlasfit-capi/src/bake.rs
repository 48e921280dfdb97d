//! Colours into a texture.

use crate::arrays::copy_out;
use crate::mesh::{self, atlasfit_mesh};
use crate::points::{self, atlasfit_points};
use crate::run::{atlasfit_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{
    ATLASFIT_BUFFER_TOO_SMALL, ATLASFIT_INDEX_OUT_OF_RANGE, Failure, atlasfit_status, guard,
};
use atlasfit::bake::{BakeOptions, Colors, bake};

/// How to bake. Fill it with atlasfit_bake_options_init(); a NULL pointer to one means the defaults.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_bake_options {
    /// sizeof(atlasfit_bake_options).
    pub struct_size: usize,
    /// Width of the texture in texels, 1 to 65536. Default 1024.
    pub width: u32,
    /// Height of the texture in texels, 1 to 65536. Default 1024.
    pub height: u32,
    /// Texels by which colours spread beyond the borders of the charts, so that filtered look-ups find no
    /// foreign colour. Texels farther out have the mean colour. Default 16.
    pub padding: u32,
    /// The page to bake: triangles of other pages (atlasfit_mesh.face_page) are left out. Default 0.
    pub page: u32,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_bake_options {
    const NAME: &str = "atlasfit_bake_options";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        let BakeOptions { size: [width, height], dilation, .. } = BakeOptions::default();
        Self { struct_size: size_of::<Self>(), width, height, padding: dilation, page: 0 }
    }
}

/// Fills options with their defaults.
///
/// @param options     The struct to fill.
/// @param struct_size sizeof(atlasfit_bake_options).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_bake_options_init(
    options: *mut atlasfit_bake_options,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_bake_options_init", || unsafe { sized::init(options, struct_size) })
}

/// Draws colours into a texture for a mesh's UVs: the colours of its vertices, or those of points that lie
/// near it, for example a scan, which is often finer. Colours are averaged as plain numbers, without gamma
/// correction. Parts of the UVs outside [0, 1] are left out.
///
/// @param mesh     The mesh with its corner_uv, and its colors where `points` is NULL.
/// @param points   Points in the mesh's frame; only their positions and colors are read. NULL = the colours
///                 of the mesh's vertices.
/// @param options  How to bake; NULL = the defaults.
/// @param run      How long work is run; NULL = the defaults.
/// @param rgba     Red, green, blue, alpha of each texel, 0 to 255; row after row, the top row (v = 1) first.
/// @param capacity Bytes that `rgba` has room for, at least 4 * options.width * options.height.
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT, #ATLASFIT_ABI_MISMATCH, #ATLASFIT_INDEX_OUT_OF_RANGE (a
///         triangle names no vertex, or none is on the page), #ATLASFIT_EMPTY_INPUT (no UVs, no colours),
///         #ATLASFIT_BUFFER_TOO_SMALL, #ATLASFIT_CANCELLED, #ATLASFIT_TIMED_OUT, #ATLASFIT_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_bake(
    mesh: *const atlasfit_mesh,
    points: *const atlasfit_points,
    options: *const atlasfit_bake_options,
    run: *const atlasfit_run,
    rgba: *mut u8,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_bake", || unsafe {
        let o = sized::read_or_default(options)?;
        let needed = 4 * u128::from(o.width) * u128::from(o.height);
        if rgba.is_null() {
            return Err(Failure::invalid("the buffer for the texture is NULL"));
        }
        if (capacity as u128) < needed {
            return Err(Failure::new(
                ATLASFIT_BUFFER_TOO_SMALL,
                format!("capacity is {capacity}, but the texture has {needed} bytes"),
            ));
        }
        let mut run = core_run(run)?;
        let mut m = mesh::mesh(mesh)?;
        run.execute(|ctx| m.cut(ctx))?;
        let mesh::Mesh { mut mesh, face_page, .. } = m;
        let page_of = |i: usize| face_page.as_ref().map_or(0, |p| p[i]);
        let here: Vec<usize> = (0..mesh.triangles.len()).filter(|&i| page_of(i) == o.page).collect();
        if here.is_empty() && !mesh.triangles.is_empty() {
            return Err(Failure::new(
                ATLASFIT_INDEX_OUT_OF_RANGE,
                format!("page is {}, but no triangle is on it", o.page),
            ));
        }
        mesh.triangles = here.iter().map(|&i| mesh.triangles[i]).collect();
        if let Some(uv) = &mut mesh.corner_uv {
            *uv = here.iter().map(|&i| uv[i]).collect();
        }
        let cloud = if points.is_null() { None } else { Some(points::colored(points)?) };
        let colors = cloud.as_ref().map_or(Colors::Vertices, Colors::Points);
        let how = BakeOptions::default().with_size([o.width, o.height]).with_dilation(o.padding);
        let image = run.execute(|ctx| bake(&mesh, colors, &how, ctx))?;
        copy_out(image.rgba.as_flattened(), rgba, capacity, "texels")
    })
}
