//! What to pack for, and where a chart goes.

use super::constants::PACK;
use super::packer::PagePacker;
use crate::unwrap::chart::Chart;
use crate::unwrap::options::Packer;
use crate::unwrap::planar::turned;

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
    /// Triangles of the first page that charts keep free of, in shares of it.
    pub occupied: &'a [[[f32; 2]; 3]],
    /// Who packs.
    pub packer: Packing<'a>,
    /// For the search.
    pub seed: u64,
}

impl PackJob<'_> {
    /// The page's texels.
    pub(super) fn texels(&self) -> f64 {
        f64::from(self.page[0]) * f64::from(self.page[1])
    }

    /// The least density at which the padding is kept: islands have `PACK.least_texels` on average there, or
    /// as many as the density asked for gives them.
    pub(super) fn least_density(&self, charts: &[Chart]) -> f64 {
        let area: f64 = charts.iter().map(|c| c.area).sum();
        let least = (PACK.least_texels * charts.len() as f64 / area).sqrt();
        self.density.map_or(least, |d| d.min(least))
    }

    /// Whether the padding alone is more than the pages hold, at the least density too. Half of it round each
    /// chart is on no other's, and within half of it from the pages' borders.
    pub(super) fn is_hopeless(&self, charts: &[Chart]) -> bool {
        let area: f64 = charts.iter().map(|c| c.area).sum();
        let padding = f64::from(self.padding);
        let needed = area * self.least_density(charts).powi(2)
            + charts.len() as f64 * std::f64::consts::PI * (0.5 * padding).powi(2);
        let [width, height] = self.page.map(|p| f64::from(p) - padding);
        needed > width * height * f64::from(self.pages)
    }
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
        uv.iter()
            .map(|&q| {
                let p = turned(q, self.rotation);
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
    /// Texels kept free between charts and at the page's border.
    pub padding: u32,
}
