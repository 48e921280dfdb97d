//! The one error type of the core. Each text says what was wrong, where, and what to do.

/// What went wrong. The core never panics on data: every failure is one of these.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Nothing usable was given.
    #[error("empty input: {what}. {advice}")]
    EmptyInput {
        /// What was missing.
        what: String,
        /// What the caller can do.
        advice: String,
    },
    /// An option or argument is outside its range.
    #[error("invalid argument: {what}. {advice}")]
    InvalidArgument {
        /// Which argument, its value, and the range.
        what: String,
        /// What the caller can do.
        advice: String,
    },
    /// An index refers to nothing.
    #[error("index out of range: {what} holds {value} but there are only {limit} {of}")]
    IndexOutOfRange {
        /// Where the index stands, for example "triangle 7".
        what: String,
        /// The index.
        value: u64,
        /// The number of things it may refer to.
        limit: u64,
        /// What is counted, for example "vertices".
        of: &'static str,
    },
    /// The input has no surface that could be fitted.
    #[error("the input is degenerate: {what}. {advice}")]
    Degenerate {
        /// What was found.
        what: String,
        /// What the caller can do.
        advice: String,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The time limit passed.
    #[error("the time limit of {limit_s} s passed during {stage}. Raise the limit or give fewer points")]
    TimedOut {
        /// The limit, seconds.
        limit_s: f64,
        /// The stage that was running.
        stage: &'static str,
    },
    /// The memory limit would be exceeded.
    #[error(
        "this needs about {} of memory, more than the limit of {}. {advice}",
        text_of_bytes(*needed_bytes), text_of_bytes(*limit_bytes)
    )]
    OutOfMemory {
        /// Estimated need.
        needed_bytes: u64,
        /// The limit.
        limit_bytes: u64,
        /// What the caller can do.
        advice: &'static str,
    },
    /// The system gives no more memory.
    #[error(
        "out of memory: the system gives no {}. Close other programs, or give less data",
        text_of_bytes(*bytes)
    )]
    AllocationFailed {
        /// What was asked for.
        bytes: u64,
    },
    /// The system refuses something that is no memory: threads.
    #[error("{what}. {advice}")]
    ResourceExhausted {
        /// What was refused.
        what: String,
        /// What the caller can do.
        advice: String,
    },
    /// An iteration left the finite numbers.
    #[error("the fit diverged: {what}. {advice}")]
    Diverged {
        /// Which quantity.
        what: String,
        /// What the caller can do.
        advice: String,
    },
    /// Bytes that are not what they should be.
    #[error("no atlas can be read from these bytes: {what}. {advice}")]
    BadFile {
        /// What is wrong with them, and where.
        what: String,
        /// What the caller can do.
        advice: String,
    },
    /// A defect of this library; please report it.
    #[error("internal error: {what}. Please report this with the input that caused it")]
    Internal {
        /// What was violated.
        what: String,
    },
}

/// The core's result type.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// [`Error::EmptyInput`]: `what` is missing, and what to do about it.
    pub fn empty(what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::EmptyInput { what: what.into(), advice: advice.into() }
    }
    /// [`Error::InvalidArgument`]: `what` is out of range, and what to give.
    pub fn invalid(what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::InvalidArgument { what: what.into(), advice: advice.into() }
    }
    /// [`Error::Degenerate`]: `what` the data lack, and what to do about it.
    pub fn degenerate(what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::Degenerate { what: what.into(), advice: advice.into() }
    }
    /// What kind of error this is, in a word or two that stay the same from version to version.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::EmptyInput { .. } => "empty input",
            Self::InvalidArgument { .. } => "invalid argument",
            Self::IndexOutOfRange { .. } => "index out of range",
            Self::Degenerate { .. } => "degenerate",
            Self::Cancelled => "cancelled",
            Self::TimedOut { .. } => "timed out",
            Self::OutOfMemory { .. } | Self::AllocationFailed { .. } => "out of memory",
            Self::ResourceExhausted { .. } => "resource exhausted",
            Self::Diverged { .. } => "diverged",
            Self::BadFile { .. } => "bad file",
            Self::Internal { .. } => "internal",
        }
    }
    /// [`Error::Internal`]: `what` should not have happened.
    pub fn internal(what: impl Into<String>) -> Self {
        Self::Internal { what: what.into() }
    }
}

/// A number of bytes for people, in the units that `--max-memory` takes: "1.5 GB" is 1.5 * 2^30 bytes.
///
/// ```
/// use atlasfit::error::text_of_bytes;
/// assert_eq!([700, 52_428_800, 3 << 29].map(text_of_bytes), ["700 bytes", "50.0 MB", "1.50 GB"]);
/// ```
#[must_use]
pub fn text_of_bytes(bytes: u64) -> String {
    let of = |unit: u32| bytes as f64 / 2f64.powi(unit as i32);
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..0x4000_0000 => format!("{:.1} MB", of(20)),
        _ => format!("{:.2} GB", of(30)),
    }
}
