//! What went wrong. Each text says what was wrong, where, and what to do.

/// What went wrong in learning.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// From the core: cancelled, out of time, degenerate input.
    #[error(transparent)]
    Core(#[from] atlasfit::Error),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] atlasfit_io::Error),
    /// A file is not what it should be.
    #[error("{file}: {what}. {advice}")]
    BadFile {
        /// Its name.
        file: String,
        /// What is wrong, and where.
        what: String,
        /// What to do.
        advice: String,
    },
    /// A recipe asks for something that cannot be.
    #[error("the recipe: {what}. {advice}")]
    Recipe {
        /// Which key, its value, and the range.
        what: String,
        /// What to do.
        advice: String,
    },
    /// The loss left the finite numbers.
    #[error("training diverged in epoch {epoch}: the loss is {loss}. {kept}Lower the learning rate (rate)")]
    Diverged {
        /// The epoch, from 1.
        epoch: usize,
        /// The loss.
        loss: f64,
        /// Which checkpoint is left.
        kept: String,
    },
    /// The tensor library failed.
    #[error("the tensor library failed: {0}")]
    Tensor(#[from] candle_core::Error),
}

/// The result type of learning.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// [`Error::BadFile`].
    pub fn bad_file(file: &std::path::Path, what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::BadFile { file: file.display().to_string(), what: what.into(), advice: advice.into() }
    }
    /// [`Error::Recipe`].
    pub fn recipe(what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::Recipe { what: what.into(), advice: advice.into() }
    }
}
