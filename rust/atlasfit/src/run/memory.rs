//! Memory: what work needs before it starts, and large arrays that may be refused.
//!
//! In: counts. Out: bytes, as a number and in words; vectors, or the error that there is no room for them.
//! The bytes for one element that the stages name are measured as peak resident memory by `tests/memory.py`.

use crate::error::{Error, Result};

/// What one worker thread takes at its peak, in bytes: its stack, its scratch arrays and the allocator's pools
/// of its own. Measured as the difference between 8 threads and 1 (`tests/memory.py --measure`).
pub const PER_THREAD_BYTES: u64 = 6 << 20;

/// A number of bytes for people, in the units that `--max-memory` takes: "1.5 GB" is 1.5 * 2^30 bytes.
///
/// ```
/// use atlasfit::run::text_of_bytes;
/// assert_eq!([700, 52_428_800, 3 << 29].map(text_of_bytes), ["700 bytes", "50.0 MB", "1.50 GB"]);
/// ```
#[must_use]
pub fn text_of_bytes(bytes: u64) -> String {
    let of = |unit: u32| bytes as f64 / 2f64.powi(unit as i32);
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..0x4000_0000 => format!("{:.1} MB", of(20)),
        _ => format!("{:.2} GB", of(30)),
    }
}

/// Asks the system for so many bytes and gives them back untouched: where address space or committed memory
/// is limited (`ulimit -v`, containers, Windows), work that cannot end is refused before it starts. What
/// others take in the meantime is not foreseen.
///
/// # Errors
/// [`Error::AllocationFailed`].
pub(super) fn probe(bytes: u64) -> Result<()> {
    let room = usize::try_from(bytes).map_err(|_| Error::AllocationFailed { bytes })?;
    with_room::<u8>(room).map(drop)
}

/// `n` times `value`, for arrays that grow with the input: where the system has no room for them the run ends
/// with an error, not the process.
///
/// # Errors
/// [`Error::AllocationFailed`].
pub fn try_vec<T: Clone>(value: T, n: usize) -> Result<Vec<T>> {
    let mut out = with_room(n)?;
    out.resize(n, value);
    Ok(out)
}

/// The items of an iterator that knows their number.
///
/// # Errors
/// [`Error::AllocationFailed`].
pub fn try_collect<T>(items: impl ExactSizeIterator<Item = T>) -> Result<Vec<T>> {
    let mut out = with_room(items.len())?;
    out.extend(items);
    Ok(out)
}

/// An empty vector with room for `n`.
///
/// # Errors
/// [`Error::AllocationFailed`].
pub fn with_room<T>(n: usize) -> Result<Vec<T>> {
    let mut out = Vec::new();
    let bytes = (n as u64).saturating_mul(size_of::<T>() as u64);
    out.try_reserve_exact(n).map_err(|_| Error::AllocationFailed { bytes })?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_that_no_memory_holds_is_an_error() {
        assert_eq!(try_vec(7u8, 3), Ok(vec![7; 3]));
        assert_eq!(try_collect([1, 2].into_iter()), Ok(vec![1, 2]));
        let refused = try_vec(0u64, usize::MAX / 32);
        assert!(matches!(refused, Err(Error::AllocationFailed { bytes }) if bytes > 1 << 60), "{refused:?}");
        assert_eq!(probe(1 << 20), Ok(()));
        assert_eq!(probe(1 << 60), Err(Error::AllocationFailed { bytes: 1 << 60 }));
    }
}
