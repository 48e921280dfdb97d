//! Results in the caller's own layout: numbers of any type, at any stride.

use crate::arrays::{
    ATLASFIT_F32, ATLASFIT_F64, ATLASFIT_I8, ATLASFIT_I16, ATLASFIT_I32, ATLASFIT_I64, ATLASFIT_U8,
    ATLASFIT_U16, ATLASFIT_U32, ATLASFIT_U64, checked_extent,
};
use crate::sized::{self, Sized};
use crate::status::{
    ATLASFIT_BUFFER_TOO_SMALL, ATLASFIT_INDEX_OUT_OF_RANGE, Failure, Outcome, atlasfit_status, guard,
};
use std::ffi::c_void;

/// Where an array of a result is copied to, and how: for each point, vertex, corner or triangle an element of
/// one or a few numbers. Fill it with atlasfit_buffer_init(), then set data, capacity and scalar.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_buffer {
    /// sizeof(atlasfit_buffer).
    pub struct_size: usize,
    /// The first number of the first element.
    pub data: *mut c_void,
    /// Elements that there is room for.
    pub capacity: usize,
    /// Bytes from one element to the next; 0 = tightly packed. Default 0.
    pub stride: usize,
    /// Bytes from one number of an element to the next (x to y); 0 = tightly packed. Default 0.
    pub component_stride: usize,
    /// Type of the numbers. Floats become #ATLASFIT_F32 or #ATLASFIT_F64, colours also #ATLASFIT_U8 (0 to
    /// 255). Indices become any integer type that holds them; UINT32_MAX (none) then becomes -1, or the
    /// largest number of an unsigned type. Default #ATLASFIT_F32.
    pub scalar: u32,
    /// Must be 0.
    pub reserved: u32,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_buffer {
    const NAME: &str = "atlasfit_buffer";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            data: std::ptr::null_mut(),
            capacity: 0,
            stride: 0,
            component_stride: 0,
            scalar: ATLASFIT_F32,
            reserved: 0,
        }
    }
}

/// Fills a buffer with its defaults: no room.
///
/// @param buffer      The struct to fill.
/// @param struct_size sizeof(atlasfit_buffer).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_buffer_init(
    buffer: *mut atlasfit_buffer,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_buffer_init", || unsafe { sized::init(buffer, struct_size) })
}

/// An array of a result.
pub(crate) enum Column<'a> {
    Doubles(&'a [f64]),
    Floats(&'a [f32]),
    /// From 0 to 1.
    Colors(&'a [f32]),
    Indices(&'a [u32]),
}

/// Copies elements of `width` numbers each to the caller's buffer.
pub(crate) unsafe fn copy_to(
    column: &Column<'_>,
    width: usize,
    to: *const atlasfit_buffer,
    name: &str,
) -> Outcome {
    let b = unsafe { sized::read(to) }?;
    sized::zero(b.reserved)?;
    let place = |count: usize, size: usize| unsafe { Place::new(&b, count, width, size, name) };
    macro_rules! put {
        ($values:expr, $t:ty, $convert:expr) => {
            unsafe { place($values.len() / width, size_of::<$t>())?.put::<_, $t>($values, $convert) }
        };
    }
    macro_rules! indices {
        ($values:expr, $unsigned:ty) => {{
            // None has a number of its own; signed types have half as many others, all of them positive.
            let signed = matches!(b.scalar, ATLASFIT_I8 | ATLASFIT_I16 | ATLASFIT_I32 | ATLASFIT_I64);
            let most = if signed { <$unsigned>::MAX >> 1 } else { <$unsigned>::MAX - 1 };
            let fits = |v: &&u32| **v == u32::MAX || u64::from(**v) <= u64::from(most);
            if let Some(large) = $values.iter().find(|v| !fits(v)) {
                return Err(Failure::new(
                    ATLASFIT_INDEX_OUT_OF_RANGE,
                    format!("{name} hold {large}, which the scalar of the buffer does not. Give a wider one"),
                ));
            }
            put!($values, $unsigned, |v: u32| if v == u32::MAX { <$unsigned>::MAX } else { v as $unsigned })
        }};
    }
    let wrong = |advice: &str| {
        Err(Failure::invalid(format!("scalar of the buffer for {name} is {}. Give {advice}", b.scalar)))
    };
    match (column, b.scalar) {
        (Column::Doubles(v), ATLASFIT_F64) => put!(v, f64, |x: f64| x),
        (Column::Doubles(v), ATLASFIT_F32) => put!(v, f32, |x: f64| x as f32),
        (Column::Floats(v) | Column::Colors(v), ATLASFIT_F32) => put!(v, f32, |x: f32| x),
        (Column::Floats(v) | Column::Colors(v), ATLASFIT_F64) => put!(v, f64, |x: f32| f64::from(x)),
        (Column::Colors(v), ATLASFIT_U8) => put!(v, u8, |x: f32| (255.0 * x).round() as u8),
        (Column::Indices(v), ATLASFIT_U8 | ATLASFIT_I8) => indices!(v, u8),
        (Column::Indices(v), ATLASFIT_U16 | ATLASFIT_I16) => indices!(v, u16),
        (Column::Indices(v), ATLASFIT_U32 | ATLASFIT_I32) => indices!(v, u32),
        (Column::Indices(v), ATLASFIT_U64 | ATLASFIT_I64) => indices!(v, u64),
        (Column::Doubles(_) | Column::Floats(_), _) => return wrong("ATLASFIT_F32 or ATLASFIT_F64"),
        (Column::Colors(_), _) => return wrong("ATLASFIT_F32, ATLASFIT_F64 or ATLASFIT_U8"),
        (Column::Indices(_), _) => return wrong("ATLASFIT_U8 to ATLASFIT_I64"),
    }
    Ok(())
}

/// A buffer that was checked.
struct Place {
    base: *mut u8,
    width: usize,
    step: usize,
    apart: usize,
}

impl Place {
    unsafe fn new(b: &atlasfit_buffer, count: usize, width: usize, size: usize, name: &str) -> Outcome<Self> {
        if b.capacity < count {
            return Err(Failure::new(
                ATLASFIT_BUFFER_TOO_SMALL,
                format!("capacity is {}, but there are {count} elements of {name}", b.capacity),
            ));
        }
        let apart = if b.component_stride == 0 { size } else { b.component_stride };
        let step = if b.stride == 0 { width * size } else { b.stride };
        if apart < size || step < size {
            return Err(Failure::invalid(format!(
                "the strides of the buffer for {name} are {} and {} bytes, but a number has {size}",
                b.stride, b.component_stride
            )));
        }
        if count > 0 {
            if b.data.is_null() {
                return Err(Failure::invalid(format!("the buffer for {name} is NULL")));
            }
            let span = apart.saturating_mul(width - 1).saturating_add(size);
            checked_extent(b.data, count, step, span, name)?;
        }
        Ok(Self { base: b.data.cast(), width, step, apart })
    }

    unsafe fn put<S: Copy, T>(&self, values: &[S], convert: impl Fn(S) -> T) {
        for (i, element) in values.chunks_exact(self.width).enumerate() {
            for (k, &value) in element.iter().enumerate() {
                // SAFETY: within the extent that was checked.
                unsafe {
                    let at = self.base.add(i * self.step + k * self.apart);
                    at.cast::<T>().write_unaligned(convert(value));
                }
            }
        }
    }
}
