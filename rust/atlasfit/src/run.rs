//! How long work is run: seed, threads, progress (`overall`: of the whole job), cancel and deadline (`stop`),
//! limits.
//!
//! In: a [`Run`] made by the caller. [`Run::execute`] starts a thread pool of its own, runs the job in it,
//! and keeps the calling thread free to report progress: the callback runs on the calling thread only,
//! which is what GUI event loops and Python's lock need. The job gets a [`Context`] and asks
//! [`Context::check`] often enough that a cancel takes effect within 100 ms.

mod memory;
mod overall;
mod stage;
mod stop;
mod threads;
#[cfg(test)]
pub(crate) mod watch;

pub use memory::has_room;
pub(crate) use memory::{total_bytes, with_threads};
pub use stage::Stage;
pub use stop::{CancelToken, Deadline, Stop};
pub use threads::MOST_THREADS;

use crate::error::{Error, Result};
use overall::Overall;
use std::any::Any;
#[cfg(test)]
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex};
use std::time::{Duration, Instant};

/// How often the calling thread wakes to report progress and to look at the cancel token. Well inside the
/// 100 ms that a cancel may take, and slow enough to cost nothing.
const TICK: Duration = Duration::from_millis(20);

/// What a progress callback is told.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// The running stage.
    pub stage: Stage,
    /// Share of the stage that is done, in [0, 1]. It begins at 0 when a stage is entered, also when it is
    /// entered again, and does not fall in between.
    pub fraction: f64,
    /// Share of the whole job that is done, in [0, 1], as far as that can be told beforehand: for a bar. It
    /// never falls.
    pub overall: f64,
}

/// A progress callback: returns false to cancel. Called on the thread that started the run. One that panics
/// cancels too, and its panic comes out of the call.
pub type ProgressFn<'a> = dyn FnMut(Progress) -> bool + 'a;

/// How to run long work. `Run::default()` uses all cores, seed 0, no limits.
#[derive(Default)]
pub struct Run<'a> {
    /// Seed of everything random. Same input + seed + version gives the same bytes on machines of one type:
    /// those with other vector instructions (x86-64 with and without AVX2 and FMA, for example) add in
    /// another order and round the last digits otherwise.
    pub seed: u64,
    /// Worker threads, at most [`MOST_THREADS`]; 0 = all cores. The result does not depend on it. Many times
    /// more than there are cores are not started ([`Self::threads_warning`]).
    pub threads: usize,
    /// Wall-clock limit of each [`Run::execute`] in seconds; `None` = no limit.
    pub time_limit_s: Option<f64>,
    /// A moment that ends the run, which may be shared with other work; `None` = no such moment.
    pub deadline: Option<Deadline>,
    /// Limit on the memory of the work in bytes, its input and its result included: each job compares its
    /// estimate ([`crate::unwrap::memory_needed`] and the like) with it before it starts. `None` = no limit.
    pub memory_limit_bytes: Option<u64>,
    /// Cancels from another thread.
    pub cancel: Option<CancelToken>,
    /// Called a few times a second on the calling thread.
    pub progress: Option<Box<ProgressFn<'a>>>,
    /// Watches the checks, for tests.
    #[cfg(test)]
    pub(crate) watch: Option<Arc<watch::Watch>>,
}

struct Shared {
    stage: AtomicU32,
    done: AtomicU64,
    total: AtomicU64,
    stop: CancelToken,
    times: Mutex<Vec<(Stage, Instant)>>,
    overall: Mutex<Overall>,
}

/// What a running job sees of its [`Run`].
pub struct Context<'s> {
    /// Seed of everything random in this run.
    pub seed: u64,
    shared: &'s Shared,
    cancel: Option<&'s CancelToken>,
    deadline: Option<Deadline>,
    memory_limit: Option<u64>,
    threads: usize,
    #[cfg(test)]
    watch: Option<Arc<watch::Watch>>,
}

impl Context<'_> {
    /// Tells the stages to come in the order in which they are expected, each with its share of the job's
    /// time (in any unit), for [`Progress::overall`]. Only the first call of a run counts: work that is part
    /// of a larger job is in that job's plan.
    pub fn plan(&self, shares: &[(Stage, f64)]) {
        if let Ok(mut overall) = self.shared.overall.lock() {
            overall.plan(shares);
        }
    }
    /// Enters a stage of `total` steps (any unit).
    pub fn stage(&self, stage: Stage, total: usize) {
        // What is reported meanwhile waits: the steps done belong to the stage.
        let Ok(mut overall) = self.shared.overall.lock() else { return };
        overall.at(self.shared.fraction());
        overall.enter(stage);
        self.shared.done.store(0, Ordering::Relaxed);
        self.shared.total.store(total.max(1) as u64, Ordering::Relaxed);
        self.shared.stage.store(stage as u32, Ordering::Relaxed);
        if let Ok(mut times) = self.shared.times.lock() {
            times.push((stage, Instant::now()));
        }
    }
    /// Reports `steps` more steps of the running stage as done.
    pub fn advance(&self, steps: usize) {
        self.shared.done.fetch_add(steps as u64, Ordering::Relaxed);
    }
    /// Fails when the run was cancelled or its time is up. Cheap (two atomic loads); call it at least every
    /// few milliseconds of work.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::TimedOut`].
    #[cfg_attr(test, track_caller)]
    pub fn check(&self) -> Result<()> {
        #[cfg(test)]
        if let Some(watch) = &self.watch {
            watch.seen(std::panic::Location::caller())?;
        }
        if !self.shared.stop.is_cancelled() && !self.cancel.is_some_and(CancelToken::is_cancelled) {
            return Ok(());
        }
        match self.deadline {
            Some(deadline) if deadline.has_passed() => {
                Err(deadline.error(stage_of(self.shared.stage.load(Ordering::Relaxed)).name()))
            }
            _ => Err(Error::Cancelled),
        }
    }
    /// [`Self::check`] at every 4096th item of a loop over light ones.
    ///
    /// # Errors
    /// Those of [`Self::check`].
    #[inline]
    #[cfg_attr(test, track_caller)]
    pub fn check_at(&self, item: usize) -> Result<()> {
        if item.is_multiple_of(4096) { self.check() } else { Ok(()) }
    }
    /// What ends the run, for work that takes no context: reading a file, for example. A cancel is heard
    /// there as soon as the calling thread has looked at it, a few hundredths of a second later.
    #[must_use]
    pub fn stop(&self) -> Stop {
        Stop::default().with_cancel(Some(self.shared.stop.clone())).with_deadline(self.deadline)
    }
    /// Threads that the run works with.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads
    }
    /// Fails when `needed_bytes`, all that the job holds at its peak, its input included, are more than the
    /// run's limit, or more than the system gives; `advice` tells the caller what else than a higher limit
    /// helps. Call it before the work starts.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::AllocationFailed`].
    pub fn reserve(&self, needed_bytes: u64, advice: &'static str) -> Result<()> {
        match self.memory_limit {
            Some(limit_bytes) if needed_bytes > limit_bytes => {
                Err(Error::OutOfMemory { needed_bytes, limit_bytes, advice })
            }
            _ => memory::probe(needed_bytes),
        }
    }
    /// `n` times `value`, for large arrays: an error where there is no room for them, and a cancel is heard.
    pub(crate) fn filled<T: Clone>(&self, value: T, n: usize) -> Result<Vec<T>> {
        memory::filled(value, n, || self.check())
    }
    /// Seconds spent in each stage so far, in the order entered; a stage entered twice is summed.
    #[must_use]
    pub fn stage_seconds(&self) -> Vec<(Stage, f64)> {
        let Ok(times) = self.shared.times.lock() else { return Vec::new() };
        let now = Instant::now();
        let mut out: Vec<(Stage, f64)> = Vec::new();
        for (i, &(stage, from)) in times.iter().enumerate() {
            let to = times.get(i + 1).map_or(now, |t| t.1);
            let s = to.duration_since(from).as_secs_f64();
            match out.iter_mut().find(|o| o.0 == stage) {
                Some(o) => o.1 += s,
                None => out.push((stage, s)),
            }
        }
        out
    }
}

impl Shared {
    /// Share of the running stage that is done.
    fn fraction(&self) -> f64 {
        let done = self.done.load(Ordering::Relaxed) as f64;
        (done / self.total.load(Ordering::Relaxed) as f64).clamp(0.0, 1.0)
    }
    /// What the callback is told.
    fn progress(&self) -> Progress {
        // A poisoned lock stays at the end of the bar: the job is about to fail.
        let Ok(mut overall) = self.overall.lock() else {
            return Progress { stage: Stage::Prepare, fraction: 0.0, overall: 1.0 };
        };
        let fraction = self.fraction();
        let stage = stage_of(self.stage.load(Ordering::Relaxed));
        Progress { stage, fraction, overall: overall.at(fraction) }
    }
}

fn stage_of(value: u32) -> Stage {
    Stage::ALL[(value as usize).min(Stage::ALL.len() - 1)]
}

/// Stops a run when the calling thread panics.
struct StopOnPanic<'s>(&'s CancelToken);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.cancel();
        }
    }
}

/// Whether the job is over.
#[derive(Default)]
struct Finished {
    over: Mutex<bool>,
    changed: Condvar,
}

/// Tells the caller that the job is over, also when it panics.
struct TellsThatItIsOver<'d>(&'d Finished);

impl Drop for TellsThatItIsOver<'_> {
    fn drop(&mut self) {
        if let Ok(mut over) = self.0.over.lock() {
            *over = true;
        }
        self.0.changed.notify_all();
    }
}

/// Reports progress on the calling thread until the job is over, and stops it when the callback or `stopped`
/// says so.
fn attend(
    shared: &Shared,
    finished: &Finished,
    progress: &mut Option<Box<ProgressFn<'_>>>,
    stopped: impl Fn() -> bool,
) -> Result<()> {
    let poisoned = || Error::internal("poisoned lock");
    let mut over = finished.over.lock().map_err(|_| poisoned())?;
    loop {
        let mut go_on = !stopped();
        if go_on && let Some(callback) = progress.as_mut() {
            drop(over);
            go_on = callback(shared.progress());
            over = finished.over.lock().map_err(|_| poisoned())?;
        }
        if !go_on {
            shared.stop.cancel();
        }
        if *over {
            return Ok(());
        }
        over = finished.changed.wait_timeout(over, TICK).map_err(|_| poisoned())?.0;
        if *over && go_on {
            return Ok(());
        }
    }
}

/// The error for a panic of the job.
fn panicked(panic: &(dyn Any + Send)) -> Error {
    let text =
        panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    Error::internal(format!("a worker panicked: {}", text.unwrap_or_default()))
}

impl Run<'_> {
    /// What to tell the user where fewer threads are started than were asked for.
    #[must_use]
    pub fn threads_warning(&self) -> Option<String> {
        threads::warning(self.threads)
    }

    /// Threads that the run works with.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] above [`MOST_THREADS`].
    pub fn thread_count(&self) -> Result<usize> {
        threads::granted(self.threads)
    }

    /// Runs `job` in a thread pool of its own and reports progress on the calling thread until it is done.
    ///
    /// # Errors
    /// What the job returns; [`Error::InvalidArgument`] for a bad time limit or number of threads;
    /// [`Error::ResourceExhausted`] when the threads cannot be started; [`Error::Internal`] when the job
    /// panics.
    pub fn execute<T: Send>(&mut self, job: impl FnOnce(&Context<'_>) -> Result<T> + Send) -> Result<T> {
        let started = Instant::now();
        let limit = self.time_limit_s.map(|s| Deadline::new(started, s)).transpose()?;
        let deadline = Deadline::first(self.deadline, limit);
        let threads = threads::granted(self.threads)?;
        let shared = Shared {
            stage: AtomicU32::new(0),
            done: AtomicU64::new(0),
            total: AtomicU64::new(1),
            stop: CancelToken::new(),
            times: Mutex::new(vec![(Stage::Prepare, started)]),
            overall: Mutex::default(),
        };
        let finished = Finished::default();
        let cancel = self.cancel.clone();
        let context = Context {
            seed: self.seed,
            shared: &shared,
            cancel: cancel.as_ref(),
            deadline,
            memory_limit: self.memory_limit_bytes,
            threads,
            #[cfg(test)]
            watch: self.watch.clone(),
        };
        let progress = &mut self.progress;
        let whole = || {
            context.check()?;
            let result = job(&context)?;
            context.check()?;
            Ok(result)
        };
        // Browsers give a module no threads: the job has this one, and its progress is not told.
        if cfg!(target_family = "wasm") {
            return whole();
        }
        std::thread::scope(|scope| {
            let work = || {
                let _guard = TellsThatItIsOver(&finished);
                threads::in_pool(threads, threads::STACK_BYTES, whole)
            };
            let worker = std::thread::Builder::new()
                .stack_size(threads::WAITING_STACK_BYTES)
                .spawn_scoped(scope, work)
                .map_err(threads::refused)?;
            // A callback that panics stops the run on its way out: the scope waits for the worker.
            let _stop = StopOnPanic(&shared.stop);
            let stopped = || {
                deadline.is_some_and(|d| d.has_passed())
                    || cancel.as_ref().is_some_and(CancelToken::is_cancelled)
            };
            attend(&shared, &finished, progress, stopped)?;
            let result = worker.join().unwrap_or_else(|panic| Err(panicked(panic.as_ref())));
            // A cancel that arrives as the job ends still means: no output.
            if result.is_ok() {
                context.check()?
            }
            result
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_returns_its_value_and_progress_runs_on_the_calling_thread() {
        let caller = std::thread::current().id();
        let mut seen = Vec::new();
        let mut run = Run {
            progress: Some(Box::new(|p| {
                assert_eq!(std::thread::current().id(), caller);
                seen.push(p.stage);
                true
            })),
            ..Run::default()
        };
        let value = run.execute(|c| {
            c.stage(Stage::Fit, 1);
            std::thread::sleep(Duration::from_millis(60));
            Ok(7)
        });
        drop(run);
        assert_eq!(value, Ok(7));
        assert!(seen.contains(&Stage::Fit));
    }

    fn spin(c: &Context<'_>) -> Result<()> {
        loop {
            c.check()?;
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn cancelling_by_callback_token_or_time_is_an_error_of_its_own() {
        let mut run = Run { progress: Some(Box::new(|_| false)), ..Run::default() };
        assert_eq!(run.execute(spin), Err(Error::Cancelled));

        let token = CancelToken::new();
        token.cancel();
        let mut run = Run { cancel: Some(token), ..Run::default() };
        assert_eq!(run.execute(spin), Err(Error::Cancelled));

        let mut run = Run { time_limit_s: Some(0.03), ..Run::default() };
        assert!(matches!(run.execute(spin), Err(Error::TimedOut { .. })));
    }

    #[test]
    fn work_without_a_context_ends_with_the_run() {
        let spin = |c: &Context<'_>| -> Result<()> {
            let stop = c.stop();
            loop {
                stop.check("reading")?;
                std::thread::sleep(Duration::from_millis(1));
            }
        };
        let mut run = Run { progress: Some(Box::new(|_| false)), ..Run::default() };
        assert_eq!(run.execute(spin), Err(Error::Cancelled));
        let mut run = Run { time_limit_s: Some(0.03), ..Run::default() };
        assert!(matches!(run.execute(spin), Err(Error::TimedOut { stage: "reading", .. })));
    }

    #[test]
    fn a_panic_in_the_job_is_an_error() {
        let result = Run::default().execute(|_| -> Result<()> { panic!("boom") });
        assert!(matches!(result, Err(Error::Internal { what }) if what.contains("boom")));
    }
}
