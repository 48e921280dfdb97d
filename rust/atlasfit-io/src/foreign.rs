//! Runs other crates' readers, which are not hardened against every damaged file: a panic there becomes the
//! error of a damaged file.

use std::cell::Cell;

thread_local! {
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread runs a third-party reader whose panics become errors. A program's panic hook should
/// stay silent then: the error tells what happened.
///
/// ```
/// let print = std::panic::take_hook();
/// std::panic::set_hook(Box::new(move |panic| {
///     if !atlasfit_io::panics_become_errors() {
///         print(panic);
///     }
/// }));
/// assert!(!atlasfit_io::panics_become_errors());
/// ```
#[must_use]
pub fn panics_become_errors() -> bool {
    INSIDE.with(Cell::get)
}

/// What `job` gives; `None` if it panics.
#[cfg(any(feature = "laz", feature = "e57"))]
pub(crate) fn guarded<T>(job: impl FnOnce() -> T) -> Option<T> {
    let before = INSIDE.replace(true);
    let out = std::panic::catch_unwind(std::panic::AssertUnwindSafe(job)).ok();
    INSIDE.set(before);
    out
}
