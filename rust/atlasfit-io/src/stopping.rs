//! How readers and writers hear that they are to stop: what they walk over ends early, and the door tells
//! that from a real end.

use atlasfit::Stop;
use std::io::Write;

/// How many lines, rows or points are read or written between two looks at what ends the work: about a
/// millisecond.
pub(crate) const ITEMS_PER_LOOK: usize = 4096;

/// The stages that a time limit's error names.
pub(crate) const READING: &str = "reading";
pub(crate) const WRITING: &str = "writing";

/// Whether the work is to end.
pub(crate) fn is_stopped(stop: Option<&Stop>) -> bool {
    stop.is_some_and(|s| s.check(READING).is_err())
}

/// `items`, which end early when the work is to end.
pub(crate) fn watched<I: Iterator>(stop: Option<&Stop>, items: I) -> impl Iterator<Item = I::Item> {
    let goes_on = move |i: usize| !i.is_multiple_of(ITEMS_PER_LOOK) || !is_stopped(stop);
    items.enumerate().map_while(move |(i, item)| goes_on(i).then_some(item))
}

/// An output that fails when the writing is to end.
pub(crate) struct Watched<'s, W> {
    pub out: W,
    pub stop: &'s Stop,
}

impl<W: Write> Write for Watched<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        // A large piece is cut, so that what ends the writing is looked at about every millisecond.
        const PIECE: usize = 1 << 20;
        self.stop.check(WRITING).map_err(std::io::Error::other)?;
        self.out.write(&bytes[..bytes.len().min(PIECE)])
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}
