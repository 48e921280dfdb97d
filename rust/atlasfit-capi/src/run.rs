//! How long work is run: seed, threads, limits, progress, cancel.

use crate::handle::{self, Handle};
use crate::log::{self, ATLASFIT_LOG_INFO, Log, atlasfit_log_fn};
use crate::sized::{self, Sized};
use crate::status::{Failure, Outcome, atlasfit_status, guard};
use atlasfit::{CancelToken, Run, Stage};
use std::ffi::{CString, c_char, c_void};
use std::sync::{Arc, LazyLock};

/// A token that cancels runs from another thread. Any number of runs may hold it; once asked, it stays asked.
pub struct atlasfit_cancel(());

impl Handle for atlasfit_cancel {
    type Target = CancelToken;
    const NAME: &str = "cancel token";
}

/// Makes a cancel token. Free it with atlasfit_cancel_free().
///
/// @param out Where the token is put; NULL on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_cancel_new(out: *mut *mut atlasfit_cancel) -> atlasfit_status {
    guard("atlasfit_cancel_new", || {
        handle::checked_out(out)?;
        handle::give(Arc::new(CancelToken::new()), out);
        Ok(())
    })
}

/// Asks every run that holds the token to stop: it returns #ATLASFIT_CANCELLED within 100 ms and leaves no
/// output. May be called from any thread, but not from a signal handler: set a flag there, and return 0 from
/// the progress callback.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_cancel_request(token: *const atlasfit_cancel) -> atlasfit_status {
    guard("atlasfit_cancel_request", || {
        handle::get(token)?.cancel();
        Ok(())
    })
}

/// Frees a token; NULL is allowed. Runs that hold it go on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_cancel_free(token: *mut atlasfit_cancel) -> atlasfit_status {
    guard("atlasfit_cancel_free", || handle::free(token))
}

/// A callback that is told how far a run is, on the thread that called into the library, at most 50 times a
/// second. It must return: no longjmp, no C++ exception.
///
/// @param user     The atlasfit_run's progress_user.
/// @param stage    The running stage; atlasfit_stage_name() gives its name. A stage may come again, and later
///                 versions may add stages.
/// @param fraction Share of the stage that is done, in [0, 1]. See also overall of the atlasfit_run.
/// @return 0 to cancel, anything else to go on.
pub type atlasfit_progress_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, stage: u32, fraction: f64) -> i32>;

/// How long work is run. Fill it with atlasfit_run_init(); a NULL pointer to one means the defaults.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_run {
    /// sizeof(atlasfit_run).
    pub struct_size: usize,
    /// Seed of everything random. Same input, options, seed and version give the same bytes on machines of
    /// one type, which have the same vector instructions. Default 0.
    pub seed: u64,
    /// Worker threads of this call, 0 = all cores, at most 65536. No more than these work at once, the
    /// calling thread waits meanwhile, and all have ended when the call returns. Many times more than there
    /// are cores are not started: the report of a denoised scan says so. The result does not depend on it.
    /// Default 0.
    pub threads: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Seconds after which the run gives up with #ATLASFIT_TIMED_OUT; 0 = no limit. Default 0.
    pub time_limit_s: f64,
    /// Bytes of memory for the work, its input and its result: a run whose own estimate is larger fails with
    /// #ATLASFIT_OUT_OF_MEMORY before it works; 0 = no limit. Default 0.
    pub memory_limit_bytes: u64,
    /// The callback that is told how far the run is; may be NULL. Default NULL.
    pub progress: atlasfit_progress_fn,
    /// Handed to the callback as it is. Default NULL.
    pub progress_user: *mut c_void,
    /// A token that cancels the run from another thread; may be NULL. Borrowed for the call. Default NULL.
    pub cancel: *const atlasfit_cancel,
    /// Where the share of the whole call that is done, in [0, 1], is put before each call of progress, for
    /// one bar: it never falls, while fraction begins anew with each stage. NULL = nowhere. Default NULL.
    pub overall: *mut f64,
    /// A callback that is told what happens: each stage that begins and takes more than a few hundredths of a
    /// second, what the user should hear of the result, why the call fails; may be NULL. Default NULL.
    pub log: atlasfit_log_fn,
    /// Handed to that callback as it is. Default NULL.
    pub log_user: *mut c_void,
}

// SAFETY: numbers and pointers, size first.
unsafe impl Sized for atlasfit_run {
    const NAME: &str = "atlasfit_run";
    const FIRST: usize = std::mem::offset_of!(Self, overall);
    fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            seed: 0,
            threads: 0,
            reserved: 0,
            time_limit_s: 0.0,
            memory_limit_bytes: 0,
            progress: None,
            progress_user: std::ptr::null_mut(),
            cancel: std::ptr::null(),
            overall: std::ptr::null_mut(),
            log: None,
            log_user: std::ptr::null_mut(),
        }
    }
}

/// Fills a run with its defaults.
///
/// @param run         The struct to fill.
/// @param struct_size sizeof(atlasfit_run).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_run_init(run: *mut atlasfit_run, struct_size: usize) -> atlasfit_status {
    guard("atlasfit_run_init", || unsafe { sized::init(run, struct_size) })
}

/// The core's run. It calls the caller's callbacks, so it must stay on this thread. The run's log becomes
/// that of the call.
pub(crate) unsafe fn core_run(run: *const atlasfit_run) -> Outcome<Run<'static>> {
    let r = unsafe { sized::read_or_default(run) }?;
    let log = r.log.map(|tell| Log { tell, user: r.log_user });
    log::replace(log);
    sized::zero(r.reserved)?;
    if !(r.time_limit_s >= 0.0 && r.time_limit_s.is_finite()) {
        return Err(Failure::invalid(format!(
            "time_limit_s is {}. Give a finite number of seconds, or 0 for no limit",
            r.time_limit_s
        )));
    }
    let cancel = if r.cancel.is_null() { None } else { Some(CancelToken::clone(&*handle::get(r.cancel)?)) };
    Ok(Run {
        seed: r.seed,
        threads: r.threads as usize,
        time_limit_s: (r.time_limit_s > 0.0).then_some(r.time_limit_s),
        memory_limit_bytes: (r.memory_limit_bytes > 0).then_some(r.memory_limit_bytes),
        cancel,
        progress: (r.progress.is_some() || log.is_some()).then(|| progress(r, log)),
        ..Run::default()
    })
}

/// Calls the caller's callbacks.
fn progress(r: atlasfit_run, log: Option<Log>) -> Box<dyn FnMut(atlasfit::Progress) -> bool> {
    let mut last = None;
    Box::new(move |p| {
        if let Some(log) = log
            && last.replace(p.stage) != Some(p.stage)
        {
            log.line(ATLASFIT_LOG_INFO, p.stage.name());
        }
        // SAFETY: the caller's function, with the caller's pointers, on the caller's thread.
        unsafe {
            if let Some(overall) = r.overall.as_mut() {
                *overall = p.overall;
            }
            r.progress.is_none_or(|callback| callback(r.progress_user, p.stage as u32, p.fraction) != 0)
        }
    })
}

/// A run for work that takes milliseconds and is not cancelled.
pub(crate) fn brief_run() -> Run<'static> {
    Run { threads: 1, ..Run::default() }
}

/// Length of stage_seconds in #atlasfit_report: no version numbers more stages.
pub const ATLASFIT_STAGE_LIMIT: usize = 16;

/// The core's names of the stages, by number.
static STAGE_NAMES: LazyLock<Vec<CString>> = LazyLock::new(|| {
    // No name holds a zero byte.
    Stage::ALL.iter().map(|s| CString::new(s.name()).unwrap_or_default()).collect()
});

/// A short name for a stage, in lower case: "fitting charts" for example, or "working" for a number that is
/// no stage. Static text, never NULL.
#[unsafe(no_mangle)]
pub extern "C" fn atlasfit_stage_name(stage: u32) -> *const c_char {
    STAGE_NAMES.get(stage as usize).map_or(c"working", CString::as_c_str).as_ptr()
}

/// Where a number is put, set to 0 until it is known.
pub(crate) unsafe fn number_out<'o>(out: *mut u64) -> Outcome<&'o mut u64> {
    let out = unsafe { out.as_mut() }.ok_or_else(|| Failure::invalid("where the number is put is NULL"))?;
    *out = 0;
    Ok(out)
}
