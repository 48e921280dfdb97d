//! The one error type of this crate: file, place, what was found, what was expected, what to do.

use atlasfit::error::text_of_bytes;
use std::fmt;
use std::path::Path;

/// Where in a file something was met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// A line of a text file, counted from 1.
    Line(u64),
    /// A byte offset, counted from 0.
    Byte(u64),
    /// The file as a whole.
    Whole,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(n) => write!(f, "line {n}"),
            Self::Byte(n) => write!(f, "byte {n}"),
            Self::Whole => write!(f, "whole file"),
        }
    }
}

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The system refused.
    #[error("{file}: cannot {action}: {source}")]
    Io {
        /// The file.
        file: String,
        /// What was tried, for example "open it".
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The content breaks its format's rules in a way that cannot be repaired.
    #[error("{file}, {at}: found {found}, expected {expected}. {advice}")]
    Malformed {
        /// The file.
        file: String,
        /// Where.
        at: Location,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
        /// What the caller can do.
        advice: String,
    },
    /// The file may be valid, but this build does not read or write such files.
    #[error("{file}: {what}. {advice}")]
    Unsupported {
        /// The file.
        file: String,
        /// What was met.
        what: String,
        /// What the caller can do.
        advice: String,
    },
    /// The data would not fit the memory limit.
    #[error(
        "{file}: this needs about {} of memory, more than the limit of {}. Raise the limit or give a smaller \
         file",
        text_of_bytes(*needed_bytes), text_of_bytes(*limit_bytes)
    )]
    OutOfMemory {
        /// The file.
        file: String,
        /// Estimated need.
        needed_bytes: u64,
        /// The limit.
        limit_bytes: u64,
    },
    /// The system gives no more memory.
    #[error(
        "{file}: out of memory: the system gives no {}. Close other programs, or give a smaller file",
        text_of_bytes(*bytes)
    )]
    AllocationFailed {
        /// The file.
        file: String,
        /// What was asked for.
        bytes: u64,
    },
    /// The caller cancelled, or the time limit passed.
    #[error(transparent)]
    Stopped(atlasfit::Error),
}

impl Error {
    /// The system refused to do `action` with a file, for example "open it".
    #[must_use]
    pub fn io(file: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { file: file.display().to_string(), action, source }
    }

    /// What kind of error this is, in a word or two that stay the same from version to version. The core's
    /// kinds are those of [`atlasfit::Error::kind`].
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Io { .. } => "io",
            Self::Malformed { .. } => "malformed",
            Self::Unsupported { .. } => "unsupported",
            Self::OutOfMemory { .. } | Self::AllocationFailed { .. } => "out of memory",
            Self::Stopped(e) => e.kind(),
        }
    }
}

/// This crate's result type.
pub type Result<T> = std::result::Result<T, Error>;
