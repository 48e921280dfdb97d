//! Arrays of the caller: copied in from any stride and alignment, results copied out.
//!
//! In: a pointer, a count, a stride, a scalar type. Out: a vector of the core's numbers, or a status that
//! says what is wrong with them.

use crate::status::{
    ATLASFIT_BUFFER_TOO_SMALL, ATLASFIT_INDEX_OUT_OF_RANGE, ATLASFIT_NOT_AVAILABLE, Failure, Outcome,
};
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
/// Unsigned 64-bit integer.
pub const ATLASFIT_U64: u32 = 8;
/// Signed 64-bit integer.
pub const ATLASFIT_I64: u32 = 9;

/// Points or vertices, at the most: indices are 32 bits, and the largest means "none".
pub(crate) const MOST: usize = u32::MAX as usize - 1;

pub(crate) fn checked_count(count: usize, most: usize, of: &str) -> Outcome {
    if count > most {
        return Err(Failure::invalid(format!("{count} {of}. At most {most} are possible")));
    }
    Ok(())
}

/// A vector with room for `count` elements, or a failure instead of an abort.
pub(crate) fn room<T>(count: usize) -> Outcome<Vec<T>> {
    let mut v = Vec::new();
    v.try_reserve_exact(count).map_err(|_| Failure::memory(count.saturating_mul(size_of::<T>())))?;
    Ok(v)
}

/// Copies `count` elements of `bytes` bytes each, `stride` bytes apart, through `convert`. Elements need no
/// alignment.
pub(crate) unsafe fn strided<T>(
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
            "the stride of {name} is {stride} bytes, less than one element of {bytes}. \
             Give 0 where elements are tightly packed"
        )));
    }
    checked_extent(base, count, step, bytes, name)?;
    let mut out = room(count)?;
    // SAFETY: the caller's array reaches from base over the extent that was checked.
    out.extend((0..count).map(|i| convert(unsafe { base.cast::<u8>().add(i * step) })));
    Ok(out)
}

/// Checks that an array of elements, `step` bytes apart and each reaching over `span` bytes, can be.
pub(crate) fn checked_extent(
    base: *const c_void,
    count: usize,
    step: usize,
    span: usize,
    name: &str,
) -> Outcome {
    let extent = (count - 1).checked_mul(step).and_then(|x| x.checked_add(span));
    if extent.is_none_or(|x| isize::try_from(x).is_err() || base.addr().checked_add(x).is_none()) {
        return Err(Failure::invalid(format!(
            "{count} {name}, {step} bytes apart, do not fit into memory. Check count and stride"
        )));
    }
    Ok(())
}

/// Copies packed elements.
pub(crate) unsafe fn packed<T: Copy>(base: *const T, count: usize, name: &str) -> Outcome<Vec<T>> {
    // SAFETY: `strided` hands out places with size_of::<T>() bytes.
    unsafe { strided(base.cast(), count, 0, size_of::<T>(), name, |p| p.cast::<T>().read_unaligned()) }
}

/// A column that may be left out.
pub(crate) unsafe fn column<T: Copy>(base: *const T, count: usize, name: &str) -> Outcome<Option<Vec<T>>> {
    if base.is_null() { Ok(None) } else { unsafe { packed(base, count, name) }.map(Some) }
}

/// Positions of the caller: where they are, how many, the bytes from one to the next, and from x to y to z.
#[derive(Clone, Copy)]
pub(crate) struct Positions {
    pub base: *const c_void,
    pub count: usize,
    pub stride: usize,
    pub component_stride: usize,
    pub scalar: u32,
}

pub(crate) unsafe fn positions(p: Positions) -> Outcome<Vec<[f64; 3]>> {
    // SAFETY: as `packed`.
    match p.scalar {
        ATLASFIT_F32 => unsafe { triples(p, 4, |at| f64::from(at.cast::<f32>().read_unaligned())) },
        ATLASFIT_F64 => unsafe { triples(p, 8, |at| at.cast::<f64>().read_unaligned()) },
        other => Err(Failure::invalid(format!(
            "scalar of the positions is {other}. Give ATLASFIT_F32 or ATLASFIT_F64"
        ))),
    }
}

/// Triples of numbers of `size` bytes each, which `one` reads.
unsafe fn triples(p: Positions, size: usize, one: impl Fn(*const u8) -> f64) -> Outcome<Vec<[f64; 3]>> {
    if p.component_stride == 0 || p.count == 0 {
        // SAFETY: each place has three numbers.
        return unsafe {
            strided(p.base, p.count, p.stride, 3 * size, "positions", |at| {
                std::array::from_fn(|k| one(at.add(k * size)))
            })
        };
    }
    if p.component_stride < size {
        return Err(Failure::invalid(format!(
            "component_stride of the positions is {} bytes, less than one number of {size}. \
             Give 0 where x, y, z lie beside each other",
            p.component_stride
        )));
    }
    // Where components lie apart, points may lie closer than three numbers.
    let span = p.component_stride.checked_mul(2).and_then(|x| x.checked_add(size)).unwrap_or(usize::MAX);
    let step = if p.stride == 0 { size } else { p.stride };
    // SAFETY: the first number of each point, then those of the checked extent.
    unsafe {
        strided(p.base, p.count, step, size, "positions", |_| ())?;
        checked_extent(p.base, p.count, step, span, "positions")?;
        strided(p.base, p.count, step, size, "positions", |at| {
            std::array::from_fn(|k| one(at.add(k * p.component_stride)))
        })
    }
}

/// Bytes of one index.
pub(crate) fn index_bytes(scalar: u32) -> Outcome<usize> {
    Ok(match scalar {
        ATLASFIT_U8 | ATLASFIT_I8 => 1,
        ATLASFIT_U16 | ATLASFIT_I16 => 2,
        ATLASFIT_U32 | ATLASFIT_I32 => 4,
        ATLASFIT_U64 | ATLASFIT_I64 => 8,
        other => {
            return Err(Failure::invalid(format!(
                "scalar of the faces is {other}. Give ATLASFIT_U8 to ATLASFIT_I64"
            )));
        }
    })
}

/// Indices of a type of the caller's: what is negative or has more than 32 bits is told.
pub(crate) unsafe fn indices(
    base: *const c_void,
    count: usize,
    stride: usize,
    scalar: u32,
    name: &str,
) -> Outcome<Vec<u32>> {
    // SAFETY: as `packed`.
    let mut first_wrong = None;
    let mut at = 0usize;
    let mut keep = |value: Option<u32>, given: i128| {
        let value = value.filter(|&v| v != u32::MAX);
        if value.is_none() && first_wrong.is_none() {
            first_wrong = Some((at, given));
        }
        at += 1;
        value.unwrap_or(u32::MAX)
    };
    macro_rules! of {
        ($t:ty) => {
            unsafe {
                strided(base, count, stride, size_of::<$t>(), name, |p| {
                    let value = p.cast::<$t>().read_unaligned();
                    keep(u32::try_from(value).ok(), i128::from(value))
                })
            }
        };
    }
    let all = match scalar {
        ATLASFIT_U8 => of!(u8),
        ATLASFIT_I8 => of!(i8),
        ATLASFIT_U16 => of!(u16),
        ATLASFIT_I16 => of!(i16),
        ATLASFIT_U32 => of!(u32),
        ATLASFIT_I32 => of!(i32),
        ATLASFIT_U64 => of!(u64),
        ATLASFIT_I64 => of!(i64),
        _ => index_bytes(scalar).map(|_| Vec::new()),
    }?;
    match first_wrong {
        Some((i, value)) => Err(Failure::new(
            ATLASFIT_INDEX_OUT_OF_RANGE,
            format!("number {i} of the {name} is {value}. Give 0 to {}", u32::MAX - 1),
        )),
        None => Ok(all),
    }
}

/// Colours as the caller has them; none for NULL.
pub(crate) struct Colors {
    pub base: *const c_void,
    pub count: usize,
    pub stride: usize,
    pub scalar: u32,
    pub width: u32,
}

pub(crate) unsafe fn colors(c: Colors) -> Outcome<Option<Vec<[f32; 4]>>> {
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

/// Copies lines of text, `\n` between them, to the caller's buffer of `capacity` bytes, with a 0 at the end.
/// `length` is told what they take without it. A buffer of NULL asks for that only.
pub(crate) unsafe fn copy_lines(
    lines: &[String],
    to: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> Outcome {
    if length.is_null() {
        return Err(Failure::invalid("length is NULL. Give the address of a size_t"));
    }
    let mut text = lines.join("\n").into_bytes();
    // SAFETY: the caller's size_t.
    unsafe { length.write_unaligned(text.len()) };
    if to.is_null() {
        return Ok(());
    }
    text.push(0);
    unsafe { copy_out(&text, to.cast(), capacity, "the text, its last 0 included") }
}

/// The bytes of a terminated string of the caller's, without the 0. `longest`: a string without an end within
/// so many bytes is garbage.
pub(crate) unsafe fn text<'t>(base: *const c_char, name: &str, longest: usize) -> Outcome<&'t [u8]> {
    if base.is_null() {
        return Err(Failure::invalid(format!("{name} is NULL")));
    }
    let bytes = base.cast::<u8>();
    // SAFETY: a terminated string, read only up to its end.
    let length = (0..longest).find(|&i| unsafe { *bytes.add(i) } == 0);
    let length =
        length.ok_or_else(|| Failure::invalid(format!("{name} has no end within {longest} bytes")))?;
    Ok(unsafe { std::slice::from_raw_parts(bytes, length) })
}
