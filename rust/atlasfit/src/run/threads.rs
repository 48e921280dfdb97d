//! The threads of a run.
//!
//! In: the number that the caller asks for. Out: a pool of that many, or of fewer where the machine has
//! far fewer cores. The environment has no say: neither `RAYON_NUM_THREADS` nor `RUST_MIN_STACK` changes
//! anything.

use super::memory;
use crate::error::{Error, Result};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// A larger number of threads is garbage (an unset variable, for example): no machine has as many cores.
pub const MOST_THREADS: usize = 65_536;
/// Threads for each core, at the most: more only take memory and wait for each other.
const PER_CORE: usize = 4;
/// So many may be had on any machine, so that a result can be compared for different numbers.
const ALWAYS: usize = 16;
/// Stack of a thread in bytes: the standard library's default, which all tests run with.
pub(super) const STACK_BYTES: usize = 2 << 20;
/// Stack in bytes of the thread that only waits for the pool.
pub(super) const WAITING_STACK_BYTES: usize = 256 << 10;

/// What a thread takes beside its stack while it starts, in bytes: guard page, signal stack, thread-local
/// data, its handle. A thread that gets its stack but not these ends the whole process, not the run.
const BESIDE_STACK_BYTES: usize = 256 << 10;

/// Cores that this process may use.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// The most threads that a machine of so many cores gives.
fn most(cores: usize) -> usize {
    (PER_CORE * cores).max(ALWAYS)
}

/// How many threads a run gets that asks for `asked`; 0 = one for each core.
///
/// # Errors
/// [`Error::InvalidArgument`] above [`MOST_THREADS`].
pub(super) fn granted(asked: usize) -> Result<usize> {
    match asked {
        0 => Ok(cores()),
        n if n > MOST_THREADS => {
            Err(Error::invalid(format!("threads is {n}"), format!("Give 0 (all cores) to {MOST_THREADS}")))
        }
        n => Ok(n.min(most(cores()))),
    }
}

/// What to tell a caller who asks for more threads than are started.
pub(super) fn warning(asked: usize) -> Option<String> {
    let given = granted(asked).ok().filter(|&n| n < asked)?;
    Some(format!("{given} threads are used instead of {asked}: this machine has {} cores", cores()))
}

/// The error of a thread that the system does not start.
pub(super) fn refused(cause: impl std::fmt::Display) -> Error {
    Error::ResourceExhausted {
        what: format!("the system starts no more threads ({cause})"),
        advice: "Ask for fewer threads, or raise the limit on processes or memory".into(),
    }
}

/// Runs `job` in a pool of `threads` threads of its own. They have ended when this returns: none is left
/// behind in the caller's process.
///
/// # Errors
/// [`Error::ResourceExhausted`] where a thread cannot be started; what the job returns.
pub(super) fn in_pool<T: Send>(
    threads: usize,
    stack_bytes: usize,
    job: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    let room = threads.saturating_mul(stack_bytes.saturating_add(BESIDE_STACK_BYTES));
    if !memory::has_room(room) {
        return Err(refused("there is no memory for their stacks"));
    }
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(stack_bytes)
        .build_scoped(|thread| thread.run(), |pool: &ThreadPool| pool.install(job))
        .map_err(refused)?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_threads_are_cut_to_a_multiple_of_the_cores_and_that_is_said() {
        assert_eq!(granted(0), Ok(cores()));
        assert_eq!(granted(2), Ok(2));
        assert_eq!(granted(9_999), Ok(most(cores()).min(9_999)));
        assert!((most(1), most(8)) == (16, 32));
        assert!(matches!(granted(MOST_THREADS + 1), Err(Error::InvalidArgument { .. })));
        assert_eq!((warning(0), warning(2)), (None, None));
        let told = warning(MOST_THREADS).expect("no machine has as many cores");
        assert!(told.contains("instead of 65536"), "{told}");
    }

    #[test]
    fn a_thread_that_cannot_be_started_is_an_error_of_its_own() {
        // No address space holds such a stack.
        let result = in_pool(2, 1 << 60, || Ok(()));
        assert!(matches!(result, Err(Error::ResourceExhausted { .. })), "{result:?}");
    }
}
