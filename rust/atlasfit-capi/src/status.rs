//! Statuses, the last error of a thread, and the guard around every entry point.

use crate::log;
use atlasfit::Error;
use std::any::Any;
use std::cell::RefCell;
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Major version of this header.
pub const ATLASFIT_VERSION_MAJOR: u32 = 0;
/// Minor version of this header.
pub const ATLASFIT_VERSION_MINOR: u32 = 1;
/// Patch version of this header.
pub const ATLASFIT_VERSION_PATCH: u32 = 0;

/// The outcome of a call: #ATLASFIT_OK or one of the failures below. New failures may be added: treat an
/// unknown status as a failure.
pub type atlasfit_status = i32;

/// Done.
pub const ATLASFIT_OK: i32 = 0;
/// An argument or option is out of range, or a pointer that must be given is NULL.
pub const ATLASFIT_INVALID_ARGUMENT: i32 = 1;
/// A struct_size fits no version of the struct that this library knows, or a field is set that only a newer
/// library knows.
pub const ATLASFIT_ABI_MISMATCH: i32 = 2;
/// A triangle or seam edge names a vertex that does not exist, or a chart index is too large.
pub const ATLASFIT_INDEX_OUT_OF_RANGE: i32 = 3;
/// A pointer is no live handle of the kind that is asked for: it never was one, was freed, or is of another
/// kind.
pub const ATLASFIT_INVALID_HANDLE: i32 = 4;
/// Nothing usable was given.
pub const ATLASFIT_EMPTY_INPUT: i32 = 5;
/// The caller's buffer is smaller than the result; nothing was written to it.
pub const ATLASFIT_BUFFER_TOO_SMALL: i32 = 6;
/// The progress callback or a cancel token asked to stop.
pub const ATLASFIT_CANCELLED: i32 = 7;
/// The time limit passed.
pub const ATLASFIT_TIMED_OUT: i32 = 8;
/// An iteration left the finite numbers.
pub const ATLASFIT_DIVERGED: i32 = 9;
/// The memory limit would be exceeded, or memory ran out.
pub const ATLASFIT_OUT_OF_MEMORY: i32 = 10;
/// The input has no surface that could be fitted, or no area that could be measured or unwrapped.
pub const ATLASFIT_DEGENERATE: i32 = 11;
/// A file, or bytes, of no known format, damaged beyond repair, or of a newer version; or data that the
/// format of the output cannot hold.
pub const ATLASFIT_BAD_FILE: i32 = 12;
/// The result does not hold what is asked for (UVs of a run without UVs, for example), or the library was
/// built without it.
pub const ATLASFIT_NOT_AVAILABLE: i32 = 13;
/// The system refuses what a run needs beside memory: it starts no more threads.
pub const ATLASFIT_RESOURCE_EXHAUSTED: i32 = 14;
/// A file cannot be opened, read or written: the system refuses.
pub const ATLASFIT_IO: i32 = 15;
/// A defect of this library; please report it with the input that caused it.
pub const ATLASFIT_INTERNAL: i32 = 100;

/// Why a call failed.
pub(crate) struct Failure {
    status: i32,
    text: String,
}

pub(crate) type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    pub fn new(status: i32, text: impl Into<String>) -> Self {
        Self { status, text: text.into() }
    }
    pub fn invalid(text: impl Into<String>) -> Self {
        Self::new(ATLASFIT_INVALID_ARGUMENT, text)
    }
    pub fn memory(bytes: usize) -> Self {
        Self::new(ATLASFIT_OUT_OF_MEMORY, format!("cannot allocate {bytes} bytes. Give less data"))
    }
}

impl From<Error> for Failure {
    fn from(e: Error) -> Self {
        let status = match e {
            Error::EmptyInput { .. } => ATLASFIT_EMPTY_INPUT,
            Error::InvalidArgument { .. } => ATLASFIT_INVALID_ARGUMENT,
            Error::IndexOutOfRange { .. } => ATLASFIT_INDEX_OUT_OF_RANGE,
            Error::Degenerate { .. } => ATLASFIT_DEGENERATE,
            Error::Cancelled => ATLASFIT_CANCELLED,
            Error::TimedOut { .. } => ATLASFIT_TIMED_OUT,
            Error::ResourceExhausted { .. } => ATLASFIT_RESOURCE_EXHAUSTED,
            Error::OutOfMemory { .. } | Error::AllocationFailed { .. } => ATLASFIT_OUT_OF_MEMORY,
            Error::Diverged { .. } => ATLASFIT_DIVERGED,
            Error::BadFile { .. } => ATLASFIT_BAD_FILE,
            // The enum may grow; what is unknown here is a defect until it is given its own status.
            _ => ATLASFIT_INTERNAL,
        };
        Self::new(status, e.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<String> = const { RefCell::new(String::new()) };
}

fn fail(entry: &str, failure: &Failure) -> i32 {
    // A thread that is shutting down has no text any more; the status is still right.
    let text = format!("{entry}: {}", failure.text);
    // First the log: a call that it makes may fail too.
    log::tell(log::ATLASFIT_LOG_ERROR, &text);
    let _ = LAST_ERROR.try_with(|e| *e.borrow_mut() = text);
    failure.status
}

fn panic_text(panic: Box<dyn Any + Send>) -> String {
    let text = panic
        .downcast_ref::<String>()
        .cloned()
        .or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string))
        .unwrap_or_default();
    // A panic's payload may panic when it is dropped.
    std::mem::forget(panic);
    format!("internal error: {text}. Please report this with the input that caused it")
}

/// Runs the body of the entry point `entry`. A failure becomes the thread's last error and a status, a panic
/// becomes [`ATLASFIT_INTERNAL`]: nothing unwinds into the caller. The log that the body's run names is told
/// why, and is forgotten.
pub(crate) fn guard(entry: &str, body: impl FnOnce() -> Outcome) -> i32 {
    let outer = log::replace(None);
    let status = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => ATLASFIT_OK,
        Ok(Err(failure)) => fail(entry, &failure),
        Err(panic) => fail(entry, &Failure::new(ATLASFIT_INTERNAL, panic_text(panic))),
    };
    log::replace(outer);
    status
}

/// The library's version: major << 24 | minor << 16 | patch << 8. Header and library agree where it has the
/// major version of #ATLASFIT_VERSION and, while that is 0, also its minor version.
#[unsafe(no_mangle)]
pub extern "C" fn atlasfit_version() -> u32 {
    ATLASFIT_VERSION_MAJOR << 24 | ATLASFIT_VERSION_MINOR << 16 | ATLASFIT_VERSION_PATCH << 8
}

/// The optional parts that this library was built with, by name and with a space between them; those under
/// the GPL say so: "cgal(GPL)". Empty for the library as it is distributed, which is under MIT or Apache 2.0
/// only. Static text, never NULL.
#[unsafe(no_mangle)]
pub extern "C" fn atlasfit_features() -> *const c_char {
    atlasfit_native::features().as_ptr()
}

/// The name of a status, for logs: "invalid argument" for example, or "unknown status" for a value that is
/// none. Static text, never NULL.
#[unsafe(no_mangle)]
pub extern "C" fn atlasfit_status_name(status: atlasfit_status) -> *const c_char {
    let name = match status {
        ATLASFIT_OK => c"ok",
        ATLASFIT_INVALID_ARGUMENT => c"invalid argument",
        ATLASFIT_ABI_MISMATCH => c"header and library do not match",
        ATLASFIT_INDEX_OUT_OF_RANGE => c"index out of range",
        ATLASFIT_INVALID_HANDLE => c"invalid handle",
        ATLASFIT_EMPTY_INPUT => c"empty input",
        ATLASFIT_BUFFER_TOO_SMALL => c"buffer too small",
        ATLASFIT_CANCELLED => c"cancelled",
        ATLASFIT_TIMED_OUT => c"timed out",
        ATLASFIT_DIVERGED => c"diverged",
        ATLASFIT_OUT_OF_MEMORY => c"out of memory",
        ATLASFIT_DEGENERATE => c"degenerate input",
        ATLASFIT_BAD_FILE => c"bad file",
        ATLASFIT_NOT_AVAILABLE => c"not available",
        ATLASFIT_RESOURCE_EXHAUSTED => c"resource exhausted",
        ATLASFIT_IO => c"file access failed",
        ATLASFIT_INTERNAL => c"internal error",
        _ => c"unknown status",
    };
    name.as_ptr()
}

/// Copies the text of this thread's last failed call: what was wrong, where, and what to do. A call that
/// succeeds keeps the text as it is.
///
/// At most `capacity` bytes are written, the last of them 0; a longer text is cut between two UTF-8
/// characters. To ask for the length only, give NULL as `buffer`.
///
/// @return The length of the whole text in bytes, without the terminating 0; 0 where no call has failed on
///         this thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_last_error(buffer: *mut c_char, capacity: usize) -> usize {
    let mut length = 0;
    let _ = catch_unwind(AssertUnwindSafe(|| {
        let _ = LAST_ERROR.try_with(|text| {
            let Ok(text) = text.try_borrow() else { return };
            length = text.len();
            // SAFETY: the caller gives `capacity` writable bytes.
            unsafe { copy_text(&text, buffer, capacity) };
        });
    }));
    length
}

/// Copies text to the caller's buffer of `capacity` bytes with a 0 at the end, cut between two characters
/// where there is no more room; nowhere for NULL.
pub(crate) unsafe fn copy_text(text: &str, to: *mut c_char, capacity: usize) {
    if to.is_null() || capacity == 0 {
        return;
    }
    let cut = text.floor_char_boundary(capacity - 1);
    // SAFETY: the caller gives `capacity` writable bytes, and cut < capacity.
    unsafe {
        std::ptr::copy_nonoverlapping(text.as_ptr(), to.cast::<u8>(), cut);
        *to.add(cut) = 0;
    }
}
