//! The errors of tiles: what was wrong, where, what to do.

use std::path::Path;

/// Why a scan could not be worked on in tiles.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] atlasfit_io::Error),
    /// A tile could not be computed.
    #[error("{0}")]
    Core(#[from] atlasfit::Error),
    /// What was asked for cannot be done.
    #[error("{what}. {advice}")]
    Refused {
        /// What was wrong.
        what: String,
        /// What to do.
        advice: String,
    },
}

/// A result of tiles.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    pub(crate) fn io(file: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::File(atlasfit_io::Error::io(file, action, source))
    }
    pub(crate) fn refused(what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::Refused { what: what.into(), advice: advice.into() }
    }
    pub(crate) fn damaged(file: &Path) -> Self {
        Self::refused(
            format!("{}: this is no file of this program, or it is cut off", file.display()),
            "Delete it and run the plan again",
        )
    }
}
