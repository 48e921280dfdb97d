//! Opaque handles.
//!
//! A handle is a number that looks like a pointer: a serial that is never used twice, looked up in a table of
//! live objects. A handle that was freed, is of another kind or never was made is therefore found out without
//! touching memory. Freeing one while another thread still works with it is harmless: the object goes when
//! that call returns.
//!
//! The table knows no kind of object: each `Handle` names the type that lies behind it.

use crate::status::{ATLASFIT_INVALID_HANDLE, Failure, Outcome};
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

/// A kind of handle: the opaque type of the header, and what lies behind it.
pub(crate) trait Handle {
    /// The object. No two kinds share a type: the type is what tells them apart.
    type Target: Any + Send + Sync;
    /// The kind's name in error texts.
    const NAME: &str;
}

static LIVE: RwLock<BTreeMap<usize, Arc<dyn Any + Send + Sync>>> = RwLock::new(BTreeMap::new());
static NEXT: AtomicUsize = AtomicUsize::new(1);
/// Serials are this far apart, so that they look like aligned pointers, and none is near NULL.
const STEP: usize = 64;

/// Makes a handle for an object and gives it to `out`.
pub(crate) fn give<H: Handle>(object: Arc<H::Target>, out: *mut *mut H) {
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
pub(crate) fn get<H: Handle>(handle: *const H) -> Outcome<Arc<H::Target>> {
    if handle.is_null() {
        return Err(Failure::invalid(format!("the {} is NULL", H::NAME)));
    }
    let live = LIVE.read().unwrap_or_else(PoisonError::into_inner);
    let object = live.get(&handle.addr()).cloned().ok_or_else(unknown::<H>)?;
    object.downcast().map_err(|_| unknown::<H>())
}

/// Frees a handle; NULL is nothing to free.
pub(crate) fn free<H: Handle>(handle: *mut H) -> Outcome {
    if handle.is_null() {
        return Ok(());
    }
    get::<H>(handle)?;
    let removed = LIVE.write().unwrap_or_else(PoisonError::into_inner).remove(&handle.addr());
    // Dropped here, outside the lock.
    removed.map(drop).ok_or_else(unknown::<H>)
}

/// The number of handles of all kinds that were made and not freed: 0 at the end of a program that frees what
/// it makes. Handles are kept in a table, so a leak checker does not see one that was forgotten.
#[unsafe(no_mangle)]
pub extern "C" fn atlasfit_live_handles() -> usize {
    LIVE.read().unwrap_or_else(PoisonError::into_inner).len()
}
