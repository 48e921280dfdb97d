//! What the user should hear about a layout: where it is not what was asked for, or of little use.
//!
//! In: packed charts and what was asked for. Out: sentences.

use super::checked::Checked;
use super::options::UnwrapOptions;
use super::pack::LEAST_TEXELS;
use super::surface::Surface;

/// A density below this share of what was asked for is worth a warning.
const DENSITY_KEPT: f64 = 0.999;

/// Warnings, the gravest last.
pub(super) fn warnings(s: &Surface, checked: &Checked, options: &UnwrapOptions) -> Vec<String> {
    let (packed, charts) = (&checked.packed, checked.charts.len());
    let [width, height] = options.page_size;
    let mut out = Vec::new();
    let density = packed.density / s.unit;
    if let Some(asked) = options.texels_per_unit
        && density < DENSITY_KEPT * asked
    {
        out.push(format!(
            "the density was lowered from {asked} to {density:.4} texels per unit: the {charts} charts do \
             not fit the pages. Allow more or larger pages"
        ));
    }
    if packed.padding < options.padding_px {
        out.push(format!(
            "the padding was lowered from {} to {} texels: with more, the {charts} charts would have less \
             than {LEAST_TEXELS} texels each. Give larger pages or more of them, or allow more stretch for \
             fewer charts",
            options.padding_px, packed.padding
        ));
    }
    let area: f64 = checked.charts.iter().map(|c| c.area).sum();
    let texels = area * packed.density.powi(2) / charts.max(1) as f64;
    if texels < LEAST_TEXELS {
        out.push(format!(
            "the {charts} charts have {texels:.2} texels each on pages of {width} by {height}: too few to \
             hold a picture. Give larger pages or more of them, weld the mesh's vertices where it falls apart, or \
             allow more stretch for fewer charts"
        ));
    }
    out
}
