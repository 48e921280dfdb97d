//! What charts need to know of the pages that they will lie on.

use super::options::UnwrapOptions;

/// What counts of the page while charts are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PageLimits {
    /// Whether it counts at all. Not where there are to be fewer charts, whatever the page then wastes.
    pub counts: bool,
    /// Squared length of the longest chart that makes the page no larger; the area of the surface is one.
    /// Source: chosen, the diagonal of a page as large as the surface; charts cover 0.62 of theirs.
    pub length2: f64,
}

impl PageLimits {
    /// The page that options ask for: of its shape, and where a density is asked for as large as it takes,
    /// since charts that are too long for it are halved later.
    pub(crate) fn of(options: &UnwrapOptions) -> Self {
        let [width, height] = options.page_size.map(f64::from);
        let diagonal2 = width / height + height / width;
        let endless = options.texels_per_unit.is_some();
        let length2 = if endless { f64::INFINITY } else { diagonal2 };
        Self { counts: true, length2 }
    }
}

impl Default for PageLimits {
    fn default() -> Self {
        Self::of(&UnwrapOptions::default())
    }
}
