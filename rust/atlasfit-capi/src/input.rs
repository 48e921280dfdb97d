//! Borrowed arrays of the caller, copied into the core's plain data; results copied out.

use crate::sized::{self, Sized};
use crate::status::{
    ATLASFIT_BUFFER_TOO_SMALL, ATLASFIT_NOT_AVAILABLE, Failure, Outcome, atlasfit_status, guard,
};
use atlasfit::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
use std::ffi::{c_char, c_void};

/// 32-bit float.
pub const ATLASFIT_F32: u32 = 0;
/// 64-bit float.
pub const ATLASFIT_F64: u32 = 1;
/// Unsigned 8-bit integer.
pub const ATLASFIT_U8: u32 = 2;
/// Signed 8-bit integer.
pub const ATLASFIT_I8: u32 = 3;
/// Unsigned 16-bit integer.
pub const ATLASFIT_U16: u32 = 4;
/// Signed 16-bit integer.
pub const ATLASFIT_I16: u32 = 5;
/// Unsigned 32-bit integer.
pub const ATLASFIT_U32: u32 = 6;
/// Signed 32-bit integer.
pub const ATLASFIT_I32: u32 = 7;

/// One number per point, or a few, that the surface is to carry: intensity, scan id. Numbers of an integer type are labels, copied from the
/// nearest point; floats are averaged.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_attribute {
    /// sizeof(atlasfit_attribute); the same for all attributes of an array, whose elements are this far apart.
    pub struct_size: usize,
    /// Name in UTF-8, for error texts; may be NULL.
    pub name: *const c_char,
    /// The numbers: `width` per point.
    pub values: *const c_void,
    /// Bytes from one point's first number to the next point's; 0 = tightly packed.
    pub stride: usize,
    /// Numbers per point, 1 to 64. Default 1.
    pub width: u32,
    /// Type of the numbers: #ATLASFIT_F32 to #ATLASFIT_I32. Default #ATLASFIT_F32.
    pub scalar: u32,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_attribute {
    const NAME: &str = "atlasfit_attribute";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            name: std::ptr::null(),
            values: std::ptr::null(),
            stride: 0,
            width: 1,
            scalar: ATLASFIT_F32,
        }
    }
}

/// Points, borrowed for the call. Fill it with atlasfit_points_init(), then set what there is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_points {
    /// sizeof(atlasfit_points).
    pub struct_size: usize,
    /// Positions: x, y, z of each point, of type `scalar`, in any unit. Points that are not finite are left out and counted.
    pub positions: *const c_void,
    /// Number of points, below 2^32 - 1.
    pub count: usize,
    /// Bytes from one point to the next; 0 = tightly packed.
    pub stride: usize,
    /// Type of the positions: #ATLASFIT_F32 or #ATLASFIT_F64. Default #ATLASFIT_F32.
    pub scalar: u32,
    /// Colour channels: 3 (red, green, blue) or 4 (and alpha). Default 4.
    pub color_width: u32,
    /// Normals: 3 floats per point. They do not steer the fit, which finds normals and the outside by itself: points that end up on no
    /// chart keep theirs in the result. NULL = none. Default NULL.
    pub normals: *const f32,
    /// Bytes from one normal to the next; 0 = tightly packed.
    pub normal_stride: usize,
    /// Colours, carried over to the surface. NULL = none. Default NULL.
    pub colors: *const c_void,
    /// Bytes from one colour to the next; 0 = tightly packed.
    pub color_stride: usize,
    /// Type of the colours: #ATLASFIT_F32 (0 to 1) or #ATLASFIT_U8 (0 to 255). Default #ATLASFIT_F32.
    pub color_scalar: u32,
    /// Number of attributes, at most 1024. Default 0.
    pub attribute_count: u32,
    /// Other attributes, carried over to the surface.
    pub attributes: *const atlasfit_attribute,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_points {
    const NAME: &str = "atlasfit_points";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            positions: std::ptr::null(),
            count: 0,
            stride: 0,
            scalar: ATLASFIT_F32,
            color_width: 4,
            normals: std::ptr::null(),
            normal_stride: 0,
            colors: std::ptr::null(),
            color_stride: 0,
            color_scalar: ATLASFIT_F32,
            attribute_count: 0,
            attributes: std::ptr::null(),
        }
    }
}

/// A triangle mesh, borrowed for the call and never changed. Fill it with atlasfit_mesh_init(), then set what there is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_mesh {
    /// sizeof(atlasfit_mesh).
    pub struct_size: usize,
    /// Vertex positions: x, y, z of each, of type `scalar`, in any unit.
    pub positions: *const c_void,
    /// Number of vertices, below 2^32 - 1.
    pub vertex_count: usize,
    /// Bytes from one vertex to the next; 0 = tightly packed.
    pub stride: usize,
    /// Type of the positions: #ATLASFIT_F32 or #ATLASFIT_F64. Default #ATLASFIT_F32.
    pub scalar: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Three vertex indices per triangle, counter-clockwise seen from outside.
    pub triangles: *const u32,
    /// Number of triangles, below 2^32 / 3.
    pub triangle_count: usize,
    /// Texture coordinates: u, v of each corner of each triangle (6 floats per triangle), v up. NULL = none. Read by atlasfit_measure_uv(),
    /// atlasfit_bake(), and atlasfit_unwrap() with keep_uv_seams.
    pub corner_uv: *const f32,
    /// A group (material, for example) per triangle: no UV chart spans two. NULL = one group. Read by atlasfit_unwrap().
    pub face_group: *const u32,
    /// The polygon that each triangle was cut from, any numbers: triangles of one polygon stay in one chart. NULL = all are triangles. Read by
    /// atlasfit_unwrap().
    pub face_polygon: *const u32,
    /// Edges that must be seams, as pairs of vertex indices; pairs that are no edge are left out. NULL = none. Read by atlasfit_unwrap().
    pub seam_edges: *const u32,
    /// Number of seam edges.
    pub seam_edge_count: usize,
    /// The page that each triangle's UVs are on, 0 to 4095. NULL = all are on page 0. Read by atlasfit_measure_uv() and atlasfit_bake().
    pub face_page: *const u32,
    /// Width and height of a page, in texels or any other unit; 0 and 0 = square. Read by atlasfit_measure_uv().
    pub page_width: u32,
    /// See page_width.
    pub page_height: u32,
    /// Colours of the vertices. NULL = none. Read by atlasfit_bake().
    pub colors: *const c_void,
    /// Bytes from one colour to the next; 0 = tightly packed.
    pub color_stride: usize,
    /// Type of the colours: #ATLASFIT_F32 (0 to 1) or #ATLASFIT_U8 (0 to 255). Default #ATLASFIT_F32.
    pub color_scalar: u32,
    /// Colour channels: 3 (red, green, blue) or 4 (and alpha). Default 4.
    pub color_width: u32,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_mesh {
    const NAME: &str = "atlasfit_mesh";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            positions: std::ptr::null(),
            vertex_count: 0,
            stride: 0,
            scalar: ATLASFIT_F32,
            reserved: 0,
            triangles: std::ptr::null(),
            triangle_count: 0,
            corner_uv: std::ptr::null(),
            face_group: std::ptr::null(),
            face_polygon: std::ptr::null(),
            seam_edges: std::ptr::null(),
            seam_edge_count: 0,
            face_page: std::ptr::null(),
            page_width: 0,
            page_height: 0,
            colors: std::ptr::null(),
            color_stride: 0,
            color_scalar: ATLASFIT_F32,
            color_width: 4,
        }
    }
}

/// Fills an attribute with its defaults.
///
/// @param attribute   The struct to fill.
/// @param struct_size sizeof(atlasfit_attribute).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_attribute_init(
    attribute: *mut atlasfit_attribute,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_attribute_init", || unsafe { sized::init(attribute, struct_size) })
}

/// Fills points with their defaults: none.
///
/// @param points      The struct to fill.
/// @param struct_size sizeof(atlasfit_points).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_points_init(
    points: *mut atlasfit_points,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_points_init", || unsafe { sized::init(points, struct_size) })
}

/// Fills a mesh with its defaults: no triangle.
///
/// @param mesh        The struct to fill.
/// @param struct_size sizeof(atlasfit_mesh).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_mesh_init(mesh: *mut atlasfit_mesh, struct_size: usize) -> atlasfit_status {
    guard("atlasfit_mesh_init", || unsafe { sized::init(mesh, struct_size) })
}

/// A field that later versions may give a meaning.
pub(crate) fn zero(reserved: u32) -> Outcome {
    if reserved != 0 {
        return Err(Failure::invalid(format!(
            "reserved is {reserved}, not 0. Fill the struct with its _init"
        )));
    }
    Ok(())
}

/// A yes or no.
pub(crate) fn flag(value: u32, name: &str) -> Outcome<bool> {
    match value {
        0 | 1 => Ok(value == 1),
        other => Err(Failure::invalid(format!("{name} is {other}. Give 0 or 1"))),
    }
}

/// Indices are 32 bits, and the largest means "none".
const MOST: usize = u32::MAX as usize - 1;

fn checked_count(count: usize, most: usize, of: &str) -> Outcome {
    if count > most {
        return Err(Failure::invalid(format!("{count} {of}. At most {most} are possible")));
    }
    Ok(())
}

/// A vector with room for `count` elements, or a failure instead of an abort.
fn room<T>(count: usize) -> Outcome<Vec<T>> {
    let mut v = Vec::new();
    v.try_reserve_exact(count).map_err(|_| Failure::memory(count.saturating_mul(size_of::<T>())))?;
    Ok(v)
}

/// Copies `count` elements of `bytes` bytes each, `stride` bytes apart, through `convert`. Elements need no alignment.
unsafe fn strided<T>(
    base: *const c_void,
    count: usize,
    stride: usize,
    bytes: usize,
    name: &str,
    mut convert: impl FnMut(*const u8) -> T,
) -> Outcome<Vec<T>> {
    if count == 0 {
        return Ok(Vec::new());
    }
    if base.is_null() {
        return Err(Failure::invalid(format!("{name} is NULL but there should be {count}")));
    }
    let step = if stride == 0 { bytes } else { stride };
    if step < bytes {
        return Err(Failure::invalid(format!(
            "the stride of {name} is {stride} bytes, less than one element of {bytes}. Give 0 where elements are tightly packed"
        )));
    }
    let extent = (count - 1).checked_mul(step).and_then(|x| x.checked_add(bytes));
    if extent.is_none_or(|x| isize::try_from(x).is_err() || base.addr().checked_add(x).is_none()) {
        return Err(Failure::invalid(format!(
            "{count} {name}, {step} bytes apart, do not fit into memory. Check count and stride"
        )));
    }
    let mut out = room(count)?;
    // SAFETY: the caller's array reaches from base over `extent` bytes.
    out.extend((0..count).map(|i| convert(unsafe { base.cast::<u8>().add(i * step) })));
    Ok(out)
}

/// Copies packed elements.
pub(crate) unsafe fn packed<T: Copy>(base: *const T, count: usize, name: &str) -> Outcome<Vec<T>> {
    // SAFETY: `strided` hands out places with size_of::<T>() bytes.
    unsafe { strided(base.cast(), count, 0, size_of::<T>(), name, |p| p.cast::<T>().read_unaligned()) }
}

unsafe fn positions(base: *const c_void, count: usize, stride: usize, scalar: u32) -> Outcome<Vec<[f64; 3]>> {
    // SAFETY: as `packed`.
    match scalar {
        ATLASFIT_F32 => unsafe {
            strided(base, count, stride, 12, "positions", |p| {
                p.cast::<[f32; 3]>().read_unaligned().map(f64::from)
            })
        },
        ATLASFIT_F64 => unsafe {
            strided(base, count, stride, 24, "positions", |p| p.cast::<[f64; 3]>().read_unaligned())
        },
        other => Err(Failure::invalid(format!(
            "scalar of the positions is {other}. Give ATLASFIT_F32 or ATLASFIT_F64"
        ))),
    }
}

/// Colours as the caller has them; none for NULL.
struct Colors {
    base: *const c_void,
    count: usize,
    stride: usize,
    scalar: u32,
    width: u32,
}

unsafe fn colors(c: Colors) -> Outcome<Option<Vec<[f32; 4]>>> {
    if c.base.is_null() {
        return Ok(None);
    }
    let width = c.width as usize;
    if !(3..=4).contains(&width) {
        return Err(Failure::invalid(format!("color_width is {width}. Give 3 or 4")));
    }
    let size = match c.scalar {
        ATLASFIT_F32 => 4,
        ATLASFIT_U8 => 1,
        other => {
            return Err(Failure::invalid(format!(
                "color_scalar is {other}. Give ATLASFIT_F32 or ATLASFIT_U8"
            )));
        }
    };
    // SAFETY: each place has width * size bytes.
    let all = unsafe {
        strided(c.base, c.count, c.stride, width * size, "colors", |at| {
            let mut color = [1f32; 4];
            for (k, c) in color.iter_mut().enumerate().take(width) {
                *c = match size {
                    4 => at.cast::<f32>().add(k).read_unaligned(),
                    _ => f32::from(*at.add(k)) / 255.0,
                };
            }
            color
        })
    };
    all.map(Some)
}

/// Numbers per point of one attribute, at the most: a larger one is garbage.
const WIDEST: u32 = 64;
/// Attributes, at the most.
const MOST_ATTRIBUTES: u32 = 1024;
/// Bytes of an attribute's name, at the most: a longer one is not terminated.
const LONGEST_NAME: usize = 4096;

unsafe fn attribute(a: &atlasfit_attribute, index: usize, count: usize) -> Outcome<Attribute> {
    let name = if a.name.is_null() {
        format!("attribute {index}")
    } else {
        let bytes = a.name.cast::<u8>();
        // SAFETY: a terminated string, read only up to its end.
        let length = (0..LONGEST_NAME).find(|&i| unsafe { *bytes.add(i) } == 0);
        let length = length.ok_or_else(|| {
            Failure::invalid(format!("the name of attribute {index} has no end within {LONGEST_NAME} bytes"))
        })?;
        let text = unsafe { std::slice::from_raw_parts(bytes, length) };
        String::from_utf8_lossy(text).into_owned()
    };
    if a.width == 0 || a.width > WIDEST {
        return Err(Failure::invalid(format!(
            "width of attribute {index} (\"{name}\") is {}. Give 1 to {WIDEST}",
            a.width
        )));
    }
    let (kind, size) = match a.scalar {
        ATLASFIT_F32 => (ScalarKind::F32, 4),
        ATLASFIT_F64 => (ScalarKind::F64, 8),
        ATLASFIT_U8 => (ScalarKind::U8, 1),
        ATLASFIT_I8 => (ScalarKind::I8, 1),
        ATLASFIT_U16 => (ScalarKind::U16, 2),
        ATLASFIT_I16 => (ScalarKind::I16, 2),
        ATLASFIT_U32 => (ScalarKind::U32, 4),
        ATLASFIT_I32 => (ScalarKind::I32, 4),
        other => {
            return Err(Failure::invalid(format!(
                "scalar of attribute {index} (\"{name}\") is {other}. Give ATLASFIT_F32 to ATLASFIT_I32"
            )));
        }
    };
    let width = a.width as usize;
    // SAFETY: each place has size bytes per number.
    let one = |at: *const u8, k: usize| unsafe {
        let at = at.add(k * size);
        match kind {
            ScalarKind::F32 => f64::from(at.cast::<f32>().read_unaligned()),
            ScalarKind::F64 => at.cast::<f64>().read_unaligned(),
            ScalarKind::U8 => f64::from(at.read()),
            ScalarKind::I8 => f64::from(at.cast::<i8>().read()),
            ScalarKind::U16 => f64::from(at.cast::<u16>().read_unaligned()),
            ScalarKind::I16 => f64::from(at.cast::<i16>().read_unaligned()),
            ScalarKind::U32 => f64::from(at.cast::<u32>().read_unaligned()),
            ScalarKind::I32 => f64::from(at.cast::<i32>().read_unaligned()),
        }
    };
    let mut values = room(count.saturating_mul(width))?;
    let what = format!("values of attribute {index} (\"{name}\")");
    unsafe {
        strided(a.values, count, a.stride, width * size, &what, |at| {
            for k in 0..width {
                values.push(one(at, k));
            }
        })?;
    }
    Ok(Attribute { name, width, kind, values })
}

/// The caller's points as the core's.
pub(crate) unsafe fn cloud(points: *const atlasfit_points) -> Outcome<PointCloud> {
    // SAFETY: the caller's arrays have an entry per point.
    unsafe {
        let p = sized::read(points)?;
        let colored = colored(points)?;
        let normals = if p.normals.is_null() {
            None
        } else {
            Some(strided(p.normals.cast(), p.count, p.normal_stride, 12, "normals", |at| {
                at.cast::<[f32; 3]>().read_unaligned()
            })?)
        };
        Ok(PointCloud { normals, attributes: attributes(&p)?, ..colored })
    }
}

/// Only the positions and colours of the caller's points.
pub(crate) unsafe fn colored(points: *const atlasfit_points) -> Outcome<PointCloud> {
    // SAFETY: as `cloud`.
    unsafe {
        let positions = cloud_positions(points)?;
        let p = sized::read(points)?;
        let colors = colors(Colors {
            base: p.colors,
            count: p.count,
            stride: p.color_stride,
            scalar: p.color_scalar,
            width: p.color_width,
        })?;
        Ok(PointCloud { colors, ..PointCloud::from_positions(positions) })
    }
}

/// Only the positions of the caller's points.
pub(crate) unsafe fn cloud_positions(points: *const atlasfit_points) -> Outcome<Vec<[f64; 3]>> {
    let p = unsafe { sized::read(points) }?;
    checked_count(p.count, MOST, "points")?;
    unsafe { positions(p.positions, p.count, p.stride, p.scalar) }
}

unsafe fn attributes(p: &atlasfit_points) -> Outcome<Vec<Attribute>> {
    if p.attribute_count == 0 {
        return Ok(Vec::new());
    }
    if p.attribute_count > MOST_ATTRIBUTES {
        return Err(Failure::invalid(format!(
            "attribute_count is {}. At most {MOST_ATTRIBUTES} are possible",
            p.attribute_count
        )));
    }
    if p.attributes.is_null() {
        return Err(Failure::invalid(format!(
            "attributes is NULL but attribute_count is {}",
            p.attribute_count
        )));
    }
    let mut out = Vec::new();
    // SAFETY: elements are as far apart as the first one's struct_size says, which `read` checks.
    unsafe {
        let step = p.attributes.cast::<usize>().read_unaligned();
        for i in 0..p.attribute_count as usize {
            let a = sized::read(p.attributes.cast::<u8>().add(i * step).cast::<atlasfit_attribute>())?;
            if a.struct_size != step {
                return Err(Failure::invalid(format!(
                    "struct_size of attribute {i} is {}, of the first {step}. Set it in each element",
                    a.struct_size
                )));
            }
            out.push(attribute(&a, i, p.count)?);
        }
    }
    Ok(out)
}

/// A mesh as the core's, and what the core's has no column for.
pub(crate) struct Mesh {
    pub mesh: TriMesh,
    pub face_page: Option<Vec<u32>>,
    pub page_size: [f64; 2],
    pub face_group: Option<Vec<u32>>,
    pub face_polygon: Option<Vec<u32>>,
    pub seam_edges: Option<Vec<[u32; 2]>>,
}

/// The caller's mesh as the core's; indices are checked there.
pub(crate) unsafe fn mesh(mesh: *const atlasfit_mesh) -> Outcome<Mesh> {
    let m = unsafe { sized::read(mesh) }?;
    zero(m.reserved)?;
    checked_count(m.vertex_count, MOST, "vertices")?;
    checked_count(m.triangle_count, MOST / 3, "triangles")?;
    checked_count(m.seam_edge_count, MOST, "seam edges")?;
    // SAFETY: the caller's arrays have an entry per vertex or triangle.
    unsafe {
        let positions = positions(m.positions, m.vertex_count, m.stride, m.scalar)?;
        let triangles = packed(m.triangles.cast::<[u32; 3]>(), m.triangle_count, "triangles")?;
        let corner_uv = if m.corner_uv.is_null() {
            None
        } else {
            Some(packed(m.corner_uv.cast::<[[f32; 2]; 3]>(), m.triangle_count, "corner_uv")?)
        };
        let column = |base: *const u32, name: &str| {
            if base.is_null() { Ok(None) } else { packed(base, m.triangle_count, name).map(Some) }
        };
        let face_page = column(m.face_page, "face_page")?;
        let colors = colors(Colors {
            base: m.colors,
            count: m.vertex_count,
            stride: m.color_stride,
            scalar: m.color_scalar,
            width: m.color_width,
        })?;
        let face_group = column(m.face_group, "face_group")?;
        let face_polygon = column(m.face_polygon, "face_polygon")?;
        let seam_edges = if m.seam_edge_count == 0 {
            None
        } else {
            Some(packed(m.seam_edges.cast::<[u32; 2]>(), m.seam_edge_count, "seam_edges")?)
        };
        Ok(Mesh {
            mesh: TriMesh { corner_uv, colors, ..TriMesh::new(positions, triangles) },
            face_page,
            page_size: if [m.page_width, m.page_height] == [0; 2] {
                [1.0; 2]
            } else {
                [m.page_width, m.page_height].map(f64::from)
            },
            face_group,
            face_polygon,
            seam_edges,
        })
    }
}

/// Copies a result to the caller's buffer of `capacity` elements.
pub(crate) unsafe fn copy_out<T: Copy>(from: &[T], to: *mut T, capacity: usize, name: &str) -> Outcome {
    if capacity < from.len() {
        return Err(Failure::new(
            ATLASFIT_BUFFER_TOO_SMALL,
            format!("capacity is {capacity}, but there are {} values of {name}", from.len()),
        ));
    }
    if from.is_empty() {
        return Ok(());
    }
    if to.is_null() {
        return Err(Failure::invalid(format!("the buffer for {name} is NULL")));
    }
    // SAFETY: the caller's buffer has room for `capacity` elements, and is no part of a result.
    unsafe { std::ptr::copy_nonoverlapping(from.as_ptr().cast::<u8>(), to.cast::<u8>(), size_of_val(from)) };
    Ok(())
}

/// Fails where a result was not asked for.
pub(crate) fn available<'a, T>(column: &'a Option<Vec<T>>, name: &str) -> Outcome<&'a [T]> {
    column
        .as_deref()
        .ok_or_else(|| Failure::new(ATLASFIT_NOT_AVAILABLE, format!("this result has no {name}")))
}
