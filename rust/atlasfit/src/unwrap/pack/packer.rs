//! What a packer that is no part of the library is given, and what it gives back.
//!
//! It places charts at a given size on pages of a given size; which density fills the pages is found by the
//! caller.

use crate::error::Result;
use crate::run::Context;

/// A chart as a packer gets it: flat, free of flips and overlaps, its bounding box of nearly the least area
/// there is.
#[derive(Debug)]
pub struct FlatChart<'a> {
    /// Position per vertex in texels. The least coordinates are 0.
    pub uv: Vec<[f64; 2]>,
    /// Counter-clockwise triangles.
    pub triangles: &'a [[u32; 3]],
}

/// The pages to fill.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pages {
    /// Width and height of each in texels.
    pub size: [u32; 2],
    /// Most pages.
    pub most: u32,
    /// Texels to leave free between charts and at a page's border.
    pub padding: u32,
}

/// Where a chart goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChartPosition {
    /// Page, counted from 0.
    pub page: u32,
    /// Where on it the origin of the chart's positions lies, in texels.
    pub at: [f64; 2],
}

/// Puts charts on pages; see [`unwrap_with`](crate::unwrap::unwrap_with).
pub trait PagePacker: Sync {
    /// A position for every chart, shifted but neither turned nor scaled, or `None` where they do not fit. No
    /// two charts may overlap or be nearer each other than the padding. The same charts must get the same
    /// positions.
    ///
    /// # Errors
    /// Where it cannot pack for such pages at all; those of [`Context::check`].
    fn fill(
        &self,
        charts: &[FlatChart<'_>],
        pages: Pages,
        ctx: &Context<'_>,
    ) -> Result<Option<Vec<ChartPosition>>>;
}
