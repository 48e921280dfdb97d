//! Points of the caller: borrowed arrays, copied into the core's [`PointCloud`].

use crate::arrays::{
    ATLASFIT_F32, ATLASFIT_F64, ATLASFIT_I8, ATLASFIT_I16, ATLASFIT_I32, ATLASFIT_U8, ATLASFIT_U16,
    ATLASFIT_U32, Colors, MOST, Positions, checked_count, colors, packed, positions, room, strided, text,
};
use crate::faces::{self, Faces, atlasfit_faces};
use crate::sized::{self, Sized};
use crate::status::{Failure, Outcome, atlasfit_status, guard};
use atlasfit::geometry::{Attribute, PointCloud, ScalarKind};
use std::ffi::{c_char, c_void};

/// One or a few numbers per point that the surface is to carry: intensity or scan id, for example. Numbers of
/// an integer type are labels, copied from the nearest point; floats are averaged.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_attribute {
    /// sizeof(atlasfit_attribute), in bytes. All attributes of an array have the same: it is the distance
    /// between them.
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
    /// Positions: x, y, z of each point, of type `scalar`, in any unit. Points that are not finite are left
    /// out and counted.
    pub positions: *const c_void,
    /// Number of points, below 2^32 - 1.
    pub count: usize,
    /// Bytes from one point to the next; 0 = tightly packed.
    pub stride: usize,
    /// Type of the positions: #ATLASFIT_F32 or #ATLASFIT_F64. Default #ATLASFIT_F32.
    pub scalar: u32,
    /// Colour channels: 3 (red, green, blue) or 4 (and alpha). Default 4.
    pub color_width: u32,
    /// Normals: 3 floats per point, zeros where none is known. The surface faces their side; the fit
    /// uses them for nothing else.
    /// Points that end up on no chart keep theirs in the result. NULL = none. Default NULL.
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
    /// Where the points are the vertices of a mesh: its triangles, three indices of points each. Outliers
    /// that are kept then follow the surface between their neighbours in the mesh, so that no spike stays.
    /// Those that no vertex on the surface holds stay where they are. NULL = none. Default NULL. Read by
    /// atlasfit_denoise().
    pub triangles: *const u32,
    /// Number of triangles, below 2^32 / 3. Default 0.
    pub triangle_count: usize,
    /// Bytes from x to y to z of a point, where they lie apart; `stride` is then from x to x, 0 = tightly
    /// packed. 0 = x, y, z lie beside each other. Default 0.
    pub component_stride: usize,
    /// The mesh's faces, with `triangles` NULL: polygons, or triangles with indices of other types or
    /// strides. Default none.
    pub faces: atlasfit_faces,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_points {
    const NAME: &str = "atlasfit_points";
    const FIRST: usize = std::mem::offset_of!(Self, triangles);
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
            triangles: std::ptr::null(),
            triangle_count: 0,
            component_stride: 0,
            faces: atlasfit_faces::NONE,
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

/// Numbers per point of one attribute, at the most: a larger number is garbage.
const WIDEST: u32 = 64;
/// Attributes, at the most.
const MOST_ATTRIBUTES: u32 = 1024;
/// Bytes of an attribute's name, at the most: a longer name is taken for one without its end.
const LONGEST_NAME: usize = 4096;

/// An attribute's name; `what` names it in errors.
pub(crate) unsafe fn name(at: *const c_char, what: &str) -> Outcome<String> {
    let text = unsafe { text(at, what, LONGEST_NAME) }?;
    Ok(String::from_utf8_lossy(text).into_owned())
}

unsafe fn attribute(a: &atlasfit_attribute, index: usize, count: usize) -> Outcome<Attribute> {
    let name = if a.name.is_null() {
        format!("attribute {index}")
    } else {
        unsafe { self::name(a.name, &format!("the name of attribute {index}")) }?
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
    unsafe {
        positions(Positions {
            base: p.positions,
            count: p.count,
            stride: p.stride,
            component_stride: p.component_stride,
            scalar: p.scalar,
        })
    }
}

/// The faces between the caller's points; indices are checked by the core.
pub(crate) unsafe fn faces(points: *const atlasfit_points) -> Outcome<(Vec<[u32; 3]>, Option<Faces>)> {
    let p = unsafe { sized::read(points) }?;
    checked_count(p.triangle_count, MOST / 3, "triangles")?;
    unsafe {
        let triangles = packed(p.triangles.cast::<[u32; 3]>(), p.triangle_count, "triangles")?;
        let faces = faces::faces(&p.faces)?;
        if faces.is_some() && !triangles.is_empty() {
            return Err(Failure::invalid("faces and triangles are given. Give either"));
        }
        Ok((triangles, faces))
    }
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
