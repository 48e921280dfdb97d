//! Watches the checks of a run, for tests: how long a worker goes without one, and what happens when the run
//! ends at any of them.
//!
//! In: the place of each check. Out: the longest times between two checks of a thread, or a cancel at one.

use crate::error::{Error, Result};
use std::collections::{BTreeMap, HashMap};
use std::panic::Location;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

pub(crate) type Place = (&'static str, u32);
/// When the last check was, when the last look at the time this thread has run for, what that was, and
/// where the check was.
type Last = (Instant, Instant, u64, Place);
/// That time is looked at this often at the most: asking the system is slow.
const LOOK: Duration = Duration::from_millis(3);

#[derive(Default)]
pub(crate) struct Watch {
    /// The run is cancelled at the check of this number.
    pub(crate) stop_at: Option<usize>,
    /// Whether to measure the time between checks.
    pub(crate) timed: bool,
    pub(crate) checks: AtomicUsize,
    pub(crate) last: Mutex<HashMap<ThreadId, Last>>,
    pub(crate) gaps: Mutex<BTreeMap<(Place, Place), u64>>,
}

impl Watch {
    pub(crate) fn seen(&self, at: &'static Location<'static>) -> Result<()> {
        let count = self.checks.fetch_add(1, Ordering::Relaxed);
        if self.timed
            && let (Ok(mut last), Ok(mut gaps)) = (self.last.lock(), self.gaps.lock())
        {
            let (now, place) = (Instant::now(), (at.file(), at.line()));
            let last = last.entry(std::thread::current().id()).or_insert((now, now, busy(), place));
            if now - last.0 > LOOK {
                let gap = gaps.entry((last.3, place)).or_default();
                *gap = (*gap).max(busy() - last.2);
            }
            if now - last.1 > LOOK {
                (last.1, last.2) = (now, busy());
            }
            (last.0, last.3) = (Instant::now(), place);
        }
        if self.stop_at.is_some_and(|n| count >= n) { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// The longest times between two checks of one thread: milliseconds, from where, to where.
    pub(crate) fn longest(&self) -> Vec<(f64, String)> {
        let gaps = self.gaps.lock().expect("no test panics while it holds the lock");
        let mut out: Vec<(f64, String)> = gaps
            .iter()
            .map(|((a, b), g)| (*g as f64 * 1e-6, format!("{}:{} to {}:{}", a.0, a.1, b.0, b.1)))
            .collect();
        out.sort_by(|a, b| b.0.total_cmp(&a.0));
        out
    }
}

/// Nanoseconds that this thread has run for, where the system tells (the machine's other work does not
/// count then); else those of the clock.
fn busy() -> u64 {
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split(' ').next()?.parse().ok())
        .unwrap_or_else(|| START.elapsed().as_nanos() as u64)
}
