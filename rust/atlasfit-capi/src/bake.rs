//! Colours into a texture.

use crate::arrays::{checked_count, copy_out, packed};
use crate::mesh::{self, atlasfit_mesh};
use crate::points::{self, atlasfit_points};
use crate::run::{atlasfit_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{
    ATLASFIT_BUFFER_TOO_SMALL, ATLASFIT_INDEX_OUT_OF_RANGE, Failure, Outcome, atlasfit_status, guard,
};
use atlasfit::bake::{BakeOptions, Colors, Image, Textures, bake, texture_page};

/// An image of a mesh's old textures, borrowed for the call.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_image {
    /// sizeof(atlasfit_image), in bytes. All images of an array have the same: it is the distance between
    /// them.
    pub struct_size: usize,
    /// Red, green, blue, alpha of each pixel, 0 to 255; row after row, the top row (v = 1) first.
    pub rgba: *const u8,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_image {
    const NAME: &str = "atlasfit_image";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self { struct_size: size_of::<Self>(), rgba: std::ptr::null(), width: 0, height: 0 }
    }
}

/// Old textures of one kind (colours, or roughness, ...) of a mesh, borrowed for the call. Fill it with
/// atlasfit_textures_init(), then set what there is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_textures {
    /// sizeof(atlasfit_textures).
    pub struct_size: usize,
    /// The images; outside of [0, 1] they repeat.
    pub images: *const atlasfit_image,
    /// Number of images.
    pub image_count: usize,
    /// The UVs that the images are for: u, v of each corner of each triangle of the mesh, v up.
    pub corner_uv: *const f32,
    /// The image of each triangle; UINT32_MAX for one without. NULL = the first for all. Default NULL.
    pub face_image: *const u32,
    /// 1 where the images are normal maps, whose directions are turned to the new UVs; else 0. Default 0.
    pub normals: u32,
    /// Must be 0.
    pub reserved: u32,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_textures {
    const NAME: &str = "atlasfit_textures";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            images: std::ptr::null(),
            image_count: 0,
            corner_uv: std::ptr::null(),
            face_image: std::ptr::null(),
            normals: 0,
            reserved: 0,
        }
    }
}

/// Fills an image with its defaults: none.
///
/// @param image       The struct to fill.
/// @param struct_size sizeof(atlasfit_image).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_image_init(
    image: *mut atlasfit_image,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_image_init", || unsafe { sized::init(image, struct_size) })
}

/// Fills textures with their defaults: none.
///
/// @param textures    The struct to fill.
/// @param struct_size sizeof(atlasfit_textures).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_textures_init(
    textures: *mut atlasfit_textures,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_textures_init", || unsafe { sized::init(textures, struct_size) })
}

/// Images, at the most.
const MOST_IMAGES: usize = 4096;

/// The caller's textures, copied.
struct Old {
    images: Vec<Image>,
    corner_uv: Vec<[[f32; 2]; 3]>,
    face_image: Option<Vec<u32>>,
    normals: bool,
}

impl Old {
    /// Those of the triangles that are in `here`.
    fn only(mut self, here: &[usize]) -> Self {
        self.corner_uv = here.iter().map(|&i| self.corner_uv[i]).collect();
        self.face_image = self.face_image.map(|of| here.iter().map(|&i| of[i]).collect());
        self
    }
    fn textures(&self) -> Textures<'_> {
        Textures {
            images: &self.images,
            corner_uv: &self.corner_uv,
            face_image: self.face_image.as_deref(),
            normals: self.normals,
        }
    }
}

/// The caller's textures for a mesh of so many triangles.
unsafe fn old(textures: *const atlasfit_textures, triangles: usize) -> Outcome<Old> {
    // SAFETY: the caller's arrays have an entry per image, triangle or texel.
    unsafe {
        let t = sized::read(textures)?;
        sized::zero(t.reserved)?;
        checked_count(t.image_count, MOST_IMAGES, "images")?;
        if t.images.is_null() && t.image_count > 0 {
            return Err(Failure::invalid(format!("images is NULL but image_count is {}", t.image_count)));
        }
        let mut images = Vec::new();
        for i in 0..t.image_count {
            // Elements are as far apart as the first one's struct_size says, which `read` checks.
            let step = t.images.cast::<usize>().read_unaligned();
            let image = sized::read(t.images.cast::<u8>().add(i * step).cast::<atlasfit_image>())?;
            if image.struct_size != step {
                let size = image.struct_size;
                return Err(Failure::invalid(format!(
                    "struct_size of image {i} is {size}, of the first {step}. Set it in each element"
                )));
            }
            let texels = image.width as usize * image.height as usize;
            let rgba = packed(image.rgba.cast::<[u8; 4]>(), texels, "texels of an image")?;
            images.push(Image { width: image.width, height: image.height, rgba });
        }
        let corner_uv = packed(t.corner_uv.cast::<[[f32; 2]; 3]>(), triangles, "old corner_uv")?;
        let face_image =
            if t.face_image.is_null() { None } else { Some(packed(t.face_image, triangles, "face_image")?) };
        Ok(Old { images, corner_uv, face_image, normals: sized::flag(t.normals, "normals")? })
    }
}

/// Tells how large a page must be to keep the detail of a mesh's old textures when they are drawn anew for
/// other UVs.
///
/// @param mesh     The mesh; only its positions and triangles are read.
/// @param textures Its old textures of one kind; of several the largest page counts.
/// @param run      How long work is run; NULL = the defaults.
/// @param side     Set to the side of a square page, 256 to 8192: page_width and page_height of
///                 atlasfit_unwrap_options.
/// @param padding  Set to the free texels between charts that keep colours apart when the page is seen from
///                 far away: padding of atlasfit_unwrap_options.
/// @param density  Set to the texels per unit of length that the old textures have. Where texels_per_unit of
///                 the new UVs is less, bake them twice as large, or four times; 0 where no face has a
///                 texture.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_textures_page(
    mesh: *const atlasfit_mesh,
    textures: *const atlasfit_textures,
    run: *const atlasfit_run,
    side: *mut u32,
    padding: *mut u32,
    density: *mut f64,
) -> atlasfit_status {
    guard("atlasfit_textures_page", || unsafe {
        if side.is_null() || padding.is_null() || density.is_null() {
            return Err(Failure::invalid("side, padding or density is NULL"));
        }
        let mut run = core_run(run)?;
        let mesh::Mesh { mesh, .. } = mesh::mesh(mesh)?;
        let old = old(textures, mesh.triangles.len())?;
        let page = run.execute(|ctx| texture_page(&mesh, &[old.textures()], ctx))?;
        side.write_unaligned(page.side);
        padding.write_unaligned(page.padding);
        density.write_unaligned(page.density);
        Ok(())
    })
}

/// Side in texels of a square texture that keeps the colours of so many points, 512 to 8192.
#[unsafe(no_mangle)]
pub extern "C" fn atlasfit_texture_side(points: usize) -> u32 {
    atlasfit::bake::side_for(points)
}

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
    /// Old textures of the mesh, which are drawn anew for its corner_uv, in place of colours of vertices or
    /// points. NULL = none. Default NULL.
    pub textures: *const atlasfit_textures,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_bake_options {
    const NAME: &str = "atlasfit_bake_options";
    const FIRST: usize = std::mem::offset_of!(Self, textures);
    fn defaults() -> Self {
        let BakeOptions { size: [width, height], dilation, .. } = BakeOptions::default();
        Self {
            struct_size: size_of::<Self>(),
            width,
            height,
            padding: dilation,
            page: 0,
            textures: std::ptr::null(),
        }
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

/// Draws colours into a texture for a mesh's UVs: the colours of its vertices, those of points that lie near
/// it, for example a scan, which is often finer, or the textures that it has with other UVs. Colours are
/// averaged as plain numbers, without gamma correction. Parts of the UVs outside [0, 1] are left out.
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
        let triangles = mesh.triangles.len();
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
        let textures = match o.textures.is_null() {
            true => None,
            false if cloud.is_some() => {
                return Err(Failure::invalid("points and textures are given. Give one of them"));
            }
            false => Some(old(o.textures, triangles)?.only(&here)),
        };
        let colors = match &textures {
            Some(old) => Colors::Textures(old.textures()),
            None => cloud.as_ref().map_or(Colors::Vertices, Colors::Points),
        };
        let how = BakeOptions::default().with_size([o.width, o.height]).with_dilation(o.padding);
        let image = run.execute(|ctx| bake(&mesh, colors, &how, ctx))?;
        copy_out(image.rgba.as_flattened(), rgba, capacity, "texels")
    })
}
