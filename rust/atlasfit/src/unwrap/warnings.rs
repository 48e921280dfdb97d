//! What the user should hear about a layout: where it is not what was asked for, or of little use.
//!
//! In: packed charts and what was asked for. Out: sentences.

use super::checked::Checked;
use super::constants::UNWRAP;
use super::options::UnwrapOptions;
use super::pack::PACK;
use super::surface::Surface;
use crate::numeric::wording::counted;

/// Warnings, the gravest last.
pub(super) fn warnings(s: &Surface, checked: &Checked, options: &UnwrapOptions) -> Vec<String> {
    let (packed, charts) = (&checked.packed, counted(checked.charts.len(), "chart"));
    let [width, height] = options.page_size;
    let mut out = Vec::new();
    let density = packed.density / s.unit;
    if let Some(asked) = options.texels_per_unit
        && density < UNWRAP.density_kept * asked
    {
        out.push(format!(
            "the density was lowered from {asked} to {density:.4} texels per unit: the pages have no room \
             for {charts} at more. Allow more or larger pages"
        ));
    }
    if packed.padding < options.padding_px {
        out.push(format!(
            "the padding was lowered from {} to {}: with more, {charts} would have less than {} texels \
             each. Give larger pages or more of them, or allow more stretch for fewer charts",
            options.padding_px,
            counted(packed.padding as usize, "texel"),
            PACK.least_texels
        ));
    }
    let area: f64 = checked.charts.iter().map(|c| c.area).sum();
    let texels = area * packed.density.powi(2) / checked.charts.len().max(1) as f64;
    if texels < PACK.least_texels {
        out.push(format!(
            "{charts} on pages of {width} by {height}: {texels:.2} texels each are too few to hold a \
             picture. Give larger pages or more of them, weld the mesh's vertices where it falls \
             apart, or allow more stretch for fewer charts"
        ));
    }
    out
}
