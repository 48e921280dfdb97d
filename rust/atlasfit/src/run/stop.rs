//! What ends work before it is done: a cancel token, a deadline.
//!
//! A [`Run`](super::Run) looks at both itself. [`Stop`] is for work outside of one, such as reading a file,
//! and for several runs and other work that share one deadline.

use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Cancels a run from any thread. Clones share one flag.
#[derive(Debug, Clone, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// A token that is not cancelled.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
    /// Asks every run that holds this token to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
    /// Whether [`Self::cancel`] was called.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// A moment after which work is given up. Copies name the same moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deadline {
    /// `None`: too far away for the clock, so never.
    at: Option<Instant>,
    limit_s: f64,
}

impl Deadline {
    /// The moment `limit_s` seconds after `start`.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] where the seconds are negative or not finite.
    pub fn new(start: Instant, limit_s: f64) -> Result<Self> {
        if !(limit_s.is_finite() && limit_s >= 0.0) {
            return Err(Error::invalid(
                format!("time_limit_s is {limit_s}"),
                "Give a finite number of seconds, or none",
            ));
        }
        let at = Duration::try_from_secs_f64(limit_s).ok().and_then(|d| start.checked_add(d));
        Ok(Self { at, limit_s })
    }
    /// Whether the moment is over.
    #[must_use]
    pub fn has_passed(&self) -> bool {
        self.at.is_some_and(|at| Instant::now() >= at)
    }
    /// The one that comes first.
    #[must_use]
    pub(super) fn first(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        // `None` is the least, and here stands for "never".
        let key = |d: &Self| (d.at.is_none(), d.at);
        [a, b].into_iter().flatten().min_by_key(key)
    }
    /// The error of work that it ends while it does `stage`.
    pub(super) fn error(&self, stage: &'static str) -> Error {
        Error::TimedOut { limit_s: self.limit_s, stage }
    }
}

/// What ends work before it is done. The default never does.
///
/// ```
/// use atlasfit::{CancelToken, Stop};
/// let token = CancelToken::new();
/// let stop = Stop::default().with_cancel(Some(token.clone()));
/// assert!(stop.check("reading").is_ok());
/// token.cancel();
/// assert_eq!(stop.check("reading"), Err(atlasfit::Error::Cancelled));
/// ```
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Stop {
    /// Ends the work when it is cancelled.
    pub cancel: Option<CancelToken>,
    /// Ends the work when it has passed.
    pub deadline: Option<Deadline>,
}

crate::setters!(Stop {
    with_cancel: cancel: Option<CancelToken>,
    with_deadline: deadline: Option<Deadline>,
});

impl Stop {
    /// Fails when the work is to end; `stage` says what it does now. An atomic load and a look at the clock:
    /// call it every few milliseconds.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::TimedOut`].
    pub fn check(&self, stage: &'static str) -> Result<()> {
        match &self.deadline {
            Some(deadline) if deadline.has_passed() => Err(deadline.error(stage)),
            _ if self.cancel.as_ref().is_some_and(CancelToken::is_cancelled) => Err(Error::Cancelled),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earlier_deadline_counts_and_one_too_far_away_never_passes() {
        let now = Instant::now();
        let [past, far, never] = [0.0, 1e3, 1e300].map(|s| Deadline::new(now, s).unwrap());
        assert!(past.has_passed() && !far.has_passed() && !never.has_passed());
        for (a, b, first) in [(past, far, past), (never, far, far), (far, past, past)] {
            assert_eq!(Deadline::first(Some(a), Some(b)), Some(first));
        }
        assert_eq!(Deadline::first(None, Some(never)), Some(never));
        assert!(Deadline::new(now, f64::NAN).is_err() && Deadline::new(now, -1.0).is_err());
        let stop = Stop::default().with_deadline(Some(past));
        assert_eq!(stop.check("reading"), Err(Error::TimedOut { limit_s: 0.0, stage: "reading" }));
    }
}
