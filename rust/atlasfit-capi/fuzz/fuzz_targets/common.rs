//! What the targets share: defaults, a run on one thread, and numbers out of bytes.

use atlasfit_capi::run::*;

/// A struct filled by its `_init`.
pub fn init<T>(f: unsafe extern "C" fn(*mut T, usize) -> i32) -> T {
    let mut value = std::mem::MaybeUninit::<T>::uninit();
    assert_eq!(unsafe { f(value.as_mut_ptr(), size_of::<T>()) }, 0);
    unsafe { value.assume_init() }
}

/// One thread, and no longer than a fit of a few hundred points may take.
pub fn run() -> atlasfit_run {
    atlasfit_run { threads: 1, time_limit_s: 20.0, ..init(atlasfit_run_init) }
}

/// Coordinates: bytes as they are for one point in eight, else small numbers, so that there is a shape to
/// fit.
#[allow(dead_code)]
pub fn coordinates(bytes: &[u8], most: usize) -> Vec<f32> {
    let whole = bytes.chunks_exact(4).take(most);
    whole
        .enumerate()
        .map(|(i, b)| match i / 3 % 8 {
            0 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            _ => f32::from(i16::from_le_bytes([b[0], b[1]])) / 256.0,
        })
        .collect()
}

/// A defect of the library, or a status that says it.
pub fn fine(status: i32) {
    assert_ne!(status, atlasfit_capi::status::ATLASFIT_INTERNAL);
}

/// A struct for a result: zeros and its size.
#[allow(dead_code)]
pub fn output<T>() -> T {
    let mut value = std::mem::MaybeUninit::<T>::zeroed();
    unsafe {
        value.as_mut_ptr().cast::<usize>().write(size_of::<T>());
        value.assume_init()
    }
}
