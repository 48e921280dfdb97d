//! Counts the lines of a text file that cannot be read, and remembers the first for a message.

use crate::error::{Error, Location};
use crate::input::Input;
use crate::text::{self, Line};

/// The lines that could not be read.
#[derive(Default)]
pub(crate) struct BadLines {
    /// How many.
    pub count: u64,
    /// Number and text of the first.
    first: Option<(u64, String)>,
}

impl BadLines {
    /// Counts a line.
    pub fn add(&mut self, line: Line<'_>) {
        self.count += 1;
        self.first.get_or_insert_with(|| (line.number, text::quote(line.text)));
    }

    /// Where the first is, for the report.
    pub fn first(&self) -> Option<String> {
        self.first.as_ref().map(|f| format!("line {}", f.0))
    }

    /// The error for a file with too many of them, or with nothing that can be read. It shows the first.
    pub fn error(self, input: &Input<'_>, expected: impl Into<String>, advice: impl Into<String>) -> Error {
        let (number, found) = self.first.unwrap_or_else(|| (1, "no row of numbers".into()));
        input.malformed(Location::Line(number), found, expected, advice)
    }
}
