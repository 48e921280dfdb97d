//! What reading a file had to repair or leave out: plain data that every reader adds to.

/// One kind of repair or loss, and how often it was met.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Note {
    /// What was met and what was done about it, in words: "faces that name a missing vertex, left out".
    pub what: String,
    /// How many times.
    pub count: u64,
    /// The first of them, for example "line 12".
    pub first: Option<String>,
}

impl std::fmt::Display for Note {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // The same words for one and for many.
        write!(f, "{}: {}", self.what, self.count)?;
        self.first.as_ref().map_or(Ok(()), |at| write!(f, " (first: {at})"))
    }
}

/// What reading had to repair, leave out, or wants known.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct LoadReport {
    /// In the order met; each `what` once.
    pub notes: Vec<Note>,
}

impl LoadReport {
    /// Counts `count` more of `what`. Nothing happens for a count of 0.
    pub(crate) fn add(&mut self, what: impl Into<String>, count: u64, first: Option<String>) {
        if count == 0 {
            return;
        }
        let what = what.into();
        match self.notes.iter_mut().find(|n| n.what == what) {
            Some(note) => note.count += count,
            None => self.notes.push(Note { what, count, first }),
        }
    }
}
