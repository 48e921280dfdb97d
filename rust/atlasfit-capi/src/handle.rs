//! Opaque handles.
//!
//! A handle is a number dressed as a pointer: a serial that is never used twice, looked up in a table of live objects. A handle that was freed, is
//! of another kind or never was one is therefore found out without touching memory, and freeing one while another thread still works with
//! it is harmless: the object goes when that call returns.

use crate::status::{ATLASFIT_INVALID_HANDLE, Failure, Outcome};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

/// What a handle stands for.
#[derive(Clone)]
pub(crate) enum Object {
    Cancel(atlasfit::CancelToken),
    Result(Arc<crate::denoise::Outcome>),
    Atlas(Arc<atlasfit::atlas::query::Atlas>),
    Uv(Arc<crate::unwrap::Layout>),
}

/// A kind of handle: the opaque type of the header, and what lies behind it.
pub(crate) trait Handle {
    type Target;
    /// The kind's name in error texts.
    const NAME: &str;
    fn of(object: Object) -> Option<Self::Target>;
}

static LIVE: RwLock<BTreeMap<usize, Object>> = RwLock::new(BTreeMap::new());
static NEXT: AtomicUsize = AtomicUsize::new(1);
/// Serials are this far apart, so that they look like aligned pointers, and none is near NULL.
const STEP: usize = 64;

/// Makes a handle for an object and gives it to `out`.
pub(crate) fn give<H: Handle>(object: Object, out: *mut *mut H) {
    let id = NEXT.fetch_add(1, Ordering::Relaxed).wrapping_mul(STEP);
    LIVE.write().unwrap_or_else(PoisonError::into_inner).insert(id, object);
    // SAFETY: `checked_out` has looked at `out`.
    unsafe { out.write_unaligned(std::ptr::without_provenance_mut(id)) };
}

/// Checks where a handle is to be put, and puts NULL there: what stays on failure.
pub(crate) fn checked_out<H: Handle>(out: *mut *mut H) -> Outcome {
    if out.is_null() {
        return Err(Failure::invalid("out is NULL. Give the address of a handle"));
    }
    // SAFETY: the caller gives a place for a pointer.
    unsafe { out.write_unaligned(std::ptr::null_mut()) };
    Ok(())
}

fn unknown<H: Handle>() -> Failure {
    Failure::new(
        ATLASFIT_INVALID_HANDLE,
        format!(
            "the {} is no live handle of its kind. It was freed, is of another kind, or never was made",
            H::NAME
        ),
    )
}

/// The object behind a handle.
pub(crate) fn get<H: Handle>(handle: *const H) -> Outcome<H::Target> {
    if handle.is_null() {
        return Err(Failure::invalid(format!("the {} is NULL", H::NAME)));
    }
    let live = LIVE.read().unwrap_or_else(PoisonError::into_inner);
    live.get(&handle.addr()).cloned().and_then(H::of).ok_or_else(unknown::<H>)
}

/// Frees a handle; NULL is nothing to free.
pub(crate) fn free<H: Handle>(handle: *mut H) -> Outcome {
    if handle.is_null() {
        return Ok(());
    }
    get::<H>(handle)?;
    let gone = LIVE.write().unwrap_or_else(PoisonError::into_inner).remove(&handle.addr());
    // Dropped here, outside the lock.
    gone.map(drop).ok_or_else(unknown::<H>)
}

/// The number of handles that were made and not freed, of all kinds: 0 at the end of a program that frees what it makes. Handles are kept in a
/// table, so that a leak checker alone does not see one that was forgotten.
#[unsafe(no_mangle)]
pub extern "C" fn atlasfit_live_handles() -> usize {
    LIVE.read().unwrap_or_else(PoisonError::into_inner).len()
}
