//! A failure: its kind, its exit code, its text.

use crate::console::Usage;

/// How a command failed.
pub struct Failure {
    /// In a word or two that stay the same from version to version.
    pub kind: &'static str,
    /// The program's exit code.
    pub code: u8,
    /// What was wrong, where, and what to do.
    pub text: String,
}

impl Failure {
    /// What an error means for the program.
    pub fn of(error: &anyhow::Error) -> Self {
        use atlasfit::Error::{Cancelled, InvalidArgument};
        let core = match error.downcast_ref::<atlasfit_io::Error>() {
            Some(atlasfit_io::Error::Stopped(core)) => Some(core),
            _ => error.downcast_ref::<atlasfit::Error>(),
        };
        let code = match core {
            Some(Cancelled) => 130,
            Some(InvalidArgument { .. }) => 2,
            _ if error.is::<Usage>() => 2,
            _ => 1,
        };
        let kind = match (core, error.downcast_ref::<atlasfit_io::Error>()) {
            (Some(core), _) => core.kind(),
            (None, Some(file)) => file.kind(),
            _ if code == 2 => "usage",
            _ => "other",
        };
        // Some errors name their cause themselves.
        let mut text = error.to_string();
        for cause in error.chain().skip(1).map(ToString::to_string) {
            if !text.contains(&cause) {
                text = format!("{text}: {cause}");
            }
        }
        Self { kind, code, text }
    }
}
