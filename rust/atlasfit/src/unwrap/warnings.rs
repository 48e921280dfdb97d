//! What the user should hear about a layout: where it is not what was asked for, or of little use.
//!
//! In: packed charts and what was asked for. Out: sentences.

use super::checked::Checked;
use super::constants::UNWRAP;
use super::options::UnwrapOptions;
use super::pack::PACK;
use super::surface::Surface;
use crate::geometry::TriMesh;
use crate::numeric::wording::counted;
use rustc_hash::FxHashSet;

/// Warnings, the gravest last.
pub(super) fn warnings(
    mesh: &TriMesh,
    s: &Surface,
    checked: &Checked,
    options: &UnwrapOptions,
) -> Vec<String> {
    let (packed, charts) = (&checked.packed, counted(checked.charts.len(), "chart"));
    let [width, height] = options.page_size;
    let mut out: Vec<String> = no_edges(mesh, options).into_iter().collect();
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

/// What is to be said of seams between vertices that no edge joins.
fn no_edges(mesh: &TriMesh, options: &UnwrapOptions) -> Option<String> {
    let seams = options.seam_edges.as_ref()?;
    let ascending = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(ascending);
    let edges: FxHashSet<[u32; 2]> = mesh.triangles.iter().flat_map(sides).collect();
    let none = seams.iter().filter(|&&seam| !edges.contains(&ascending(seam))).count();
    (none > 0).then(|| {
        format!(
            "{none} of {} are no edges of the mesh: nothing was cut there. Number vertices from 0, in the \
             file's order",
            counted(seams.len(), "seam edge")
        )
    })
}
