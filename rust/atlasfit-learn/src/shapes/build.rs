//! Parts of a shape in the making.

use super::loft::Loft;

/// A part, and what it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// What it is, the same for all shapes of the family.
    pub slot: u8,
    /// Its surface.
    pub loft: Loft,
}

/// Parts so far.
pub(super) struct Build {
    pub(super) parts: Vec<Part>,
}

impl Build {
    /// One more.
    pub(super) fn add(&mut self, slot: u8, loft: Loft) {
        self.parts.push(Part { slot, loft });
    }
}
