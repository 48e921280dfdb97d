//! What to pack for, and where a chart goes.

use super::packer::PagePacker;
use crate::unwrap::options::Packer;

/// Share of the page expected to be covered, for a first guess.
pub(crate) const EXPECTED_FILL: f64 = 0.62;

/// Cells along the longer side of a page.
pub(super) const CELLS: f64 = 512.0;

/// What to pack for. Lengths on the surface are in its frame.
#[derive(Clone, Copy)]
pub(crate) struct PackJob<'a> {
    /// Page width and height in texels.
    pub page: [u32; 2],
    /// Free texels round every chart.
    pub padding: u32,
    /// Texels per unit; `None` = what fills the pages.
    pub density: Option<f64>,
    /// Most pages.
    pub pages: u32,
    /// Who packs.
    pub packer: Packing<'a>,
    /// For the search.
    pub seed: u64,
}

/// Who packs.
#[derive(Clone, Copy)]
pub(crate) enum Packing<'a> {
    Own(Packer),
    External(&'a dyn PagePacker),
}

/// Where a chart goes: rotate by (c, s), add the shift, scale; the result is in shares of the page, [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    pub page: u32,
    pub rotation: [f64; 2],
    pub shift: [f64; 2],
    pub scale: [f64; 2],
}

impl Default for Placement {
    fn default() -> Self {
        Self { page: 0, rotation: [1.0, 0.0], shift: [0.0; 2], scale: [1.0; 2] }
    }
}

impl Placement {
    /// A chart's vertices on the page.
    pub(crate) fn positions(&self, uv: &[[f64; 2]]) -> Vec<[f32; 2]> {
        let [c, s] = self.rotation;
        uv.iter()
            .map(|q| {
                let p = [c * q[0] - s * q[1], s * q[0] + c * q[1]];
                [0, 1].map(|k| ((p[k] + self.shift[k]) * self.scale[k]).clamp(0.0, 1.0) as f32)
            })
            .collect()
    }
}

/// Packed charts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Packed {
    /// Where each chart goes.
    pub placements: Vec<Placement>,
    /// Texels per unit of the surface's frame.
    pub density: f64,
}
