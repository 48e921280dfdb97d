//! What a call tells the caller's log while it runs: stages, warnings, why it fails.
//!
//! In: the `log` of the call's atlasfit_run, kept for the thread until the call's guard ends. Out: lines, on
//! the calling thread. There is no log of the process: two plugins in one host share nothing.

use std::cell::Cell;
use std::ffi::{CString, c_char, c_void};

/// Level of a line of the log: why the call fails. It is the text of atlasfit_last_error().
pub const ATLASFIT_LOG_ERROR: u32 = 1;
/// Level of a line of the log: what the user should hear of the result.
pub const ATLASFIT_LOG_WARNING: u32 = 2;
/// Level of a line of the log: what the call is doing.
pub const ATLASFIT_LOG_INFO: u32 = 3;

/// A callback that is told what happens in a call, a line each, on the thread that called into the library.
/// It must return: no longjmp, no C++ exception. It may call the library.
///
/// @param user  The atlasfit_run's log_user.
/// @param level #ATLASFIT_LOG_ERROR, #ATLASFIT_LOG_WARNING or #ATLASFIT_LOG_INFO; later versions may add
///              levels, with larger numbers for what matters less.
/// @param text  UTF-8 that ends in a 0, in English, without a line's end. It is gone after the call.
pub type atlasfit_log_fn = Option<unsafe extern "C" fn(user: *mut c_void, level: u32, text: *const c_char)>;

/// A caller's log.
#[derive(Clone, Copy)]
pub(crate) struct Log {
    pub tell: unsafe extern "C" fn(user: *mut c_void, level: u32, text: *const c_char),
    pub user: *mut c_void,
}

impl Log {
    /// Tells a text, a line each.
    pub(crate) fn line(self, level: u32, text: &str) {
        for line in text.lines() {
            // Texts of files may hold a zero byte.
            let line = CString::new(line.replace('\0', " ")).unwrap_or_default();
            // SAFETY: the caller's function and pointer, on the caller's thread, within the call.
            unsafe { (self.tell)(self.user, level, line.as_ptr()) };
        }
    }
}

thread_local! {
    /// The log of the call that this thread is in.
    static LOG: Cell<Option<Log>> = const { Cell::new(None) };
}

/// Sets the log of the call that this thread is in; gives the one before, of a call that this one is made
/// within.
pub(crate) fn replace(log: Option<Log>) -> Option<Log> {
    // A thread that is shutting down has none any more.
    LOG.try_with(|l| l.replace(log)).unwrap_or(None)
}

/// Tells the log of the call that this thread is in, if it has one.
pub(crate) fn tell(level: u32, text: &str) {
    if let Some(log) = LOG.try_with(Cell::get).unwrap_or(None) {
        log.line(level, text);
    }
}

/// Tells warnings.
pub(crate) fn warn(lines: &[String]) {
    lines.iter().for_each(|line| tell(ATLASFIT_LOG_WARNING, line));
}
