//! Structs that grow, and checks that their fields share.
//!
//! Each struct begins with `struct_size`, which the caller sets to the `sizeof` of the header it was compiled
//! with. An older, shorter struct gets defaults for the fields it lacks. A newer, longer one is accepted if
//! the fields that this library does not know are zero.

use crate::status::{ATLASFIT_ABI_MISMATCH, Failure, Outcome};

/// A struct of the header.
///
/// # Safety `repr(C)`, first field `struct_size: usize`, plain numbers and raw pointers only (any bytes are a
/// valid value).
pub(crate) unsafe trait Sized: Copy {
    /// Its name in error texts.
    const NAME: &str;
    /// Its size in the first version of the header.
    const FIRST: usize;
    /// Its default, with `struct_size` set to its size.
    fn defaults() -> Self;
}

/// Bytes of a struct, at the most: no version of any struct comes near, so a larger size is garbage.
const LARGEST: usize = 4096;

fn mismatch<T: Sized>(size: usize, advice: &str) -> Failure {
    Failure::new(
        ATLASFIT_ABI_MISMATCH,
        format!("struct_size of {} is {size}, this library's is {}. {advice}", T::NAME, size_of::<T>()),
    )
}

fn checked<T: Sized>(size: usize) -> Outcome<usize> {
    if size < T::FIRST || size > LARGEST {
        return Err(mismatch::<T>(size, "Set it to sizeof of the struct, or call the struct's _init"));
    }
    Ok(size)
}

/// Fills the caller's struct of `size` bytes with defaults.
pub(crate) unsafe fn init<T: Sized>(to: *mut T, size: usize) -> Outcome {
    if to.is_null() {
        return Err(Failure::invalid(format!("the {} is NULL", T::NAME)));
    }
    let size = checked::<T>(size)?;
    unsafe { write_bytes(to, T::defaults(), size) };
    Ok(())
}

/// Writes a result into the caller's struct, as far as its `struct_size` reaches.
pub(crate) unsafe fn write<T: Sized>(to: *mut T, value: T) -> Outcome {
    unsafe {
        let size = checked_target(to)?;
        write_bytes(to, value, size);
    }
    Ok(())
}

/// Checks a struct that a result will be written to, before the work.
pub(crate) unsafe fn checked_target<T: Sized>(to: *mut T) -> Outcome<usize> {
    if to.is_null() {
        return Err(Failure::invalid(format!("the {} is NULL", T::NAME)));
    }
    // SAFETY: every struct begins with its size.
    checked::<T>(unsafe { to.cast::<usize>().read_unaligned() })
}

unsafe fn write_bytes<T: Sized>(to: *mut T, value: T, size: usize) {
    let known = size.min(size_of::<T>());
    // SAFETY: the caller's struct has `size` bytes, T has at least `known`.
    unsafe {
        std::ptr::copy_nonoverlapping((&raw const value).cast::<u8>(), to.cast::<u8>(), known);
        std::ptr::write_bytes(to.cast::<u8>().add(known), 0, size - known);
        to.cast::<usize>().write_unaligned(size);
    }
}

/// Reads the caller's struct; fields that it is too old to have are defaults.
pub(crate) unsafe fn read<T: Sized>(from: *const T) -> Outcome<T> {
    if from.is_null() {
        return Err(Failure::invalid(format!("the {} is NULL", T::NAME)));
    }
    let mut value = T::defaults();
    // SAFETY: every struct begins with its size, and any bytes make a valid T.
    unsafe {
        let size = checked::<T>(from.cast::<usize>().read_unaligned())?;
        let known = size.min(size_of::<T>());
        std::ptr::copy_nonoverlapping(from.cast::<u8>(), (&raw mut value).cast::<u8>(), known);
        for i in known..size {
            if from.cast::<u8>().add(i).read() != 0 {
                return Err(mismatch::<T>(
                    size,
                    "A field is set that this older library does not know: update the library",
                ));
            }
        }
    }
    Ok(value)
}

/// [`read`], or defaults for NULL.
pub(crate) unsafe fn read_or_default<T: Sized>(from: *const T) -> Outcome<T> {
    if from.is_null() { Ok(T::defaults()) } else { unsafe { read(from) } }
}

/// Checks a field that later versions may give a meaning.
pub(crate) fn zero(reserved: u32) -> Outcome {
    if reserved != 0 {
        return Err(Failure::invalid(format!(
            "reserved is {reserved}, not 0. Fill the struct with its _init"
        )));
    }
    Ok(())
}

/// A field that says yes or no.
pub(crate) fn flag(value: u32, name: &str) -> Outcome<bool> {
    match value {
        0 | 1 => Ok(value == 1),
        other => Err(Failure::invalid(format!("{name} is {other}. Give 0 or 1"))),
    }
}
