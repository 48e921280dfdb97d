//! Memory: what work needs before it starts, and large arrays that may be refused.
//!
//! In: counts. Out: vectors, or the error that there is no room for them.
//! The bytes for one element that the stages name are fitted to peaks of resident memory; `tests/memory.py`
//! checks that they hold.

use crate::error::{Error, Result};
use std::hint::black_box;

/// What one worker thread takes at its peak, in bytes: its stack, its scratch arrays and the allocator's
/// pools of its own. Fitted by hand to the difference between 8 threads and 1; `tests/memory.py`
/// checks that it holds.
const PER_THREAD_BYTES: u64 = 10 << 20;

/// Smaller needs are not asked for: any system has as many.
const SMALL_BYTES: u64 = 128 << 10;
/// The least that is asked for: the address space that glibc's allocator wants for a new thread. A thread
/// that did not get it works all the same, but takes a page of its own for every small block, and with those
/// the process runs into the limit and is aborted. (It is also above 32 MiB, the most up to which that
/// allocator learns from a freed block to keep later ones for itself: asking leaves the process no larger.)
const LEAST_ASKED_BYTES: u64 = 128 << 20;

/// Bytes that a job needs of which one thread would need `work`: what the threads hold of their own is no
/// more than that again.
pub(crate) fn with_threads(work: u64, threads: usize) -> u64 {
    work.saturating_add(PER_THREAD_BYTES.saturating_mul(threads as u64).min(work))
}

/// The bytes of several kinds of things: the sum of how many there are times the bytes for one, at most
/// `u64::MAX`.
pub(crate) fn total_bytes(kinds: &[(usize, u64)]) -> u64 {
    kinds.iter().fold(0u64, |sum, &(n, each)| sum.saturating_add(each.saturating_mul(n as u64)))
}

/// Asks the system for so many bytes and gives them back untouched: where address space or committed memory
/// is limited (`ulimit -v`, containers, Windows), work that cannot end is refused before it starts. What
/// others take in the meantime is not foreseen.
///
/// # Errors
/// [`Error::AllocationFailed`].
pub(super) fn probe(bytes: u64) -> Result<()> {
    if bytes < SMALL_BYTES {
        return Ok(());
    }
    let bytes = bytes.max(LEAST_ASKED_BYTES);
    let room = usize::try_from(bytes).unwrap_or(usize::MAX);
    if has_room(room) { Ok(()) } else { Err(Error::AllocationFailed { bytes }) }
}

/// Whether the system gives so many bytes: they are asked for and given back untouched.
#[must_use]
pub fn has_room(bytes: usize) -> bool {
    // Without the hint the compiler leaves out memory that nobody writes to, and asks for none.
    with_room::<u8>(bytes).map(|room| drop(black_box(room))).is_ok()
}

/// Bytes that are filled between two looks at the run: memory that is touched for the first time comes at a
/// millisecond for each of them (on a virtual machine; a third of it otherwise).
const FILLED_AT_ONCE: usize = 1 << 20;

/// `n` times `value`, for arrays that grow with the input: where the system has no room for them the run ends
/// with an error, not the process. `check` looks at the run.
///
/// # Errors
/// [`Error::AllocationFailed`]; those of `check`.
pub(super) fn filled<T: Clone>(value: T, n: usize, check: impl Fn() -> Result<()>) -> Result<Vec<T>> {
    let mut out = with_room(n)?;
    let piece = FILLED_AT_ONCE / size_of::<T>().max(1);
    while out.len() < n {
        check()?;
        out.resize(n.min(out.len() + piece.max(1)), value.clone());
    }
    Ok(out)
}

/// An empty vector with room for `n`.
fn with_room<T>(n: usize) -> Result<Vec<T>> {
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
        let made = |n| filled(7u64, n, || Ok(()));
        assert_eq!(made(3), Ok(vec![7; 3]));
        assert_eq!(made(FILLED_AT_ONCE), Ok(vec![7; FILLED_AT_ONCE]));
        let refused = made(usize::MAX / 32);
        assert!(matches!(refused, Err(Error::AllocationFailed { bytes }) if bytes > 1 << 60), "{refused:?}");
        assert_eq!([1 << 20, 1 << 27].map(probe), [Ok(()), Ok(())]);
        assert_eq!(probe(1 << 60), Err(Error::AllocationFailed { bytes: 1 << 60 }));
    }
}
