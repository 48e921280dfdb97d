//! Faces of the caller: borrowed indices of any type and stride, polygons too, copied into corners and
//! offsets.

use crate::arrays::{ATLASFIT_U32, MOST, checked_count, index_bytes, indices, room};
use crate::sized;
use crate::status::{Failure, Outcome};
use std::ffi::c_void;

/// Faces of any number of corners, with indices of any type. Part of atlasfit_mesh and atlasfit_points: it
/// does not grow.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_faces {
    /// The vertex of each corner, face after face, counter-clockwise seen from outside, of type `scalar`.
    /// NULL = faces are not given this way. Default NULL.
    pub corners: *const c_void,
    /// Where the corners of each face begin in `corners`, and at last how many there are: count + 1 numbers
    /// of type `scalar` that start at 0 and never fall. NULL = each face has three corners. Default NULL.
    pub offsets: *const c_void,
    /// Number of faces. Their corners are fewer than 2^32 - 1.
    pub count: usize,
    /// Bytes from one corner of a face to the next; 0 = tightly packed.
    pub corner_stride: usize,
    /// Without offsets: bytes from the first corner of one face to that of the next; 0 = three corners.
    pub face_stride: usize,
    /// Type of corners and offsets: #ATLASFIT_U8 to #ATLASFIT_I64. Default #ATLASFIT_U32.
    pub scalar: u32,
    /// Must be 0.
    pub reserved: u32,
}

impl atlasfit_faces {
    pub(crate) const NONE: Self = Self {
        corners: std::ptr::null(),
        offsets: std::ptr::null(),
        count: 0,
        corner_stride: 0,
        face_stride: 0,
        scalar: ATLASFIT_U32,
        reserved: 0,
    };
}

/// Faces as the core takes them.
pub(crate) struct Faces {
    pub corners: Vec<u32>,
    pub offsets: Vec<u32>,
}

/// The caller's faces; none where there are none this way. Indices are checked by the core.
pub(crate) unsafe fn faces(f: &atlasfit_faces) -> Outcome<Option<Faces>> {
    sized::zero(f.reserved)?;
    if f.corners.is_null() {
        return match f.count {
            0 => Ok(None),
            count => Err(Failure::invalid(format!("faces.corners is NULL but faces.count is {count}"))),
        };
    }
    checked_count(f.count, MOST / 3, "faces")?;
    if f.offsets.is_null() {
        let corners = unsafe { triangles(f) }?;
        let offsets = (0..=f.count as u32).map(|i| 3 * i).collect();
        return Ok(Some(Faces { corners, offsets }));
    }
    if f.face_stride != 0 {
        return Err(Failure::invalid("faces.face_stride is set, but offsets say where faces begin. Give 0"));
    }
    // SAFETY: the caller's arrays: an offset more than there are faces, a corner for each up to the last.
    unsafe {
        let offsets = indices(f.offsets, f.count + 1, 0, f.scalar, "face offsets")?;
        let count = offsets.last().map_or(0, |&n| n as usize);
        let corners = indices(f.corners, count, f.corner_stride, f.scalar, "face corners")?;
        Ok(Some(Faces { corners, offsets }))
    }
}

/// The corners of faces of three corners each.
unsafe fn triangles(f: &atlasfit_faces) -> Outcome<Vec<u32>> {
    // SAFETY: the caller's array.
    unsafe {
        if f.face_stride == 0 {
            return indices(f.corners, 3 * f.count, f.corner_stride, f.scalar, "face corners");
        }
        let apart = match f.corner_stride {
            0 => index_bytes(f.scalar)?,
            stride => stride,
        };
        let columns = [0, 1, 2].map(|k| {
            let base = f.corners.cast::<u8>().wrapping_add(apart.saturating_mul(k)).cast();
            indices(base, f.count, f.face_stride, f.scalar, "face corners")
        });
        let [a, b, c] = columns;
        let (a, b, c) = (a?, b?, c?);
        let mut out = room(3 * f.count)?;
        (0..f.count).for_each(|i| out.extend([a[i], b[i], c[i]]));
        Ok(out)
    }
}
