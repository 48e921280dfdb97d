//! Unwraps a given mesh: charts, low-stretch UVs that neither flip nor overlap, packed on square pages.
//!
//! In: a [`TriMesh`] (any topology; never changed) and [`UnwrapOptions`]. Out: a [`UvLayout`] with a UV per
//! corner of every triangle, in the mesh's own order.
//!
//! Flow: `surface` (adjacency, cuts) → `prices` (what seams cost) → `segment` (small flat patches) → `first`
//! (laid flat, by `flatten` with its exact checks; `cut` where they fail) → `merge` (fewer, larger charts
//! with short borders, within the stretch bound) → `straighten` (strips, tubes, rims, panels) → `shorten` (no
//! chart decides the page) → `pack`, `checked` → `layout`. Of small meshes `tries` makes several layouts from
//! `segment` to `merge` and keeps the best. Large meshes are merged on a coarse stand-in (`large`). With a
//! bound on the energy, `seams` cuts parts open instead of merging patches. `stack` finds parts of one shape:
//! one of them is laid out, the others take its UVs.

// Corners and faces are indexed in several arrays at once; an index says so plainly.
#![allow(clippy::needless_range_loop)]

#[cfg(feature = "benchmarks")]
#[doc(hidden)]
pub mod benchmarks;
mod bounded;
mod chart;
mod checked;
mod constants;
mod cut;
mod first;
mod flatten;
mod kept;
mod large;
mod layout;
mod memory;
mod merge;
mod options;
mod pack;
mod page_limits;
mod planar;
mod polygons;
mod preset;
mod prices;
mod seams;
mod segment;
mod shorten;
mod split;
mod stack;
mod straighten;
mod surface;
mod tries;
mod warnings;

pub use layout::UvLayout;
pub use memory::memory_needed;
pub use options::{PAGE_TEXELS, Packer, STRETCH_LIMIT, Stack, Straighten, UnwrapOptions};
pub use pack::{ChartPosition, FlatChart, PagePacker, Pages};
pub use polygons::PolygonLayout;
pub use preset::Preset;
pub use split::{SplitCorners, SplitMesh};

use crate::error::Result;
use crate::geometry::TriMesh;
use crate::run::{Context, Stage};
use bounded::{Bounded, bounded};
use chart::Chart;
use checked::pack_checked;
use first::first_charts;
use large::{LARGE, Level, Patches, coarsen, refine};
use layout::layout;
use merge::Charts;
use pack::Packing;
use prices::prices;
use segment::{FirstCut, Segmentation};
use stack::stacks;
use straighten::straighten;
use surface::Surface;
use tries::{best_charts, usual_flatness};
use warnings::warnings;

#[cfg(test)]
mod tests;

/// Shares of the time, for the overall progress: per cent, measured with `atlasfit unwrap` on a mesh of
/// 45,000 faces.
const SHARES: [(Stage, f64); 3] = [(Stage::Segment, 17.0), (Stage::Parametrize, 40.0), (Stage::Pack, 43.0)];

/// Unwraps `mesh`. Deterministic for any number of threads.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, unwrap::{UnwrapOptions, unwrap}};
///
/// let tetrahedron = TriMesh::new(
///     vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
///     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
/// );
/// let options = UnwrapOptions::default().with_page_size([256; 2]);
/// let layout = Run::default().execute(|ctx| unwrap(&tetrahedron, &options, ctx))?;
/// assert_eq!(layout.corner_uv.len(), 4);
/// assert!(layout.charts >= 1 && layout.over_stretched <= 0.05);
/// # Ok::<(), atlasfit::Error>(())
/// ```
///
/// # Errors
/// [`Error::InvalidArgument`](crate::Error::InvalidArgument) for options out of range,
/// [`Error::IndexOutOfRange`](crate::Error::IndexOutOfRange) for a bad triangle or seam edge,
/// [`Error::Degenerate`](crate::Error::Degenerate) for a mesh without any area, and those of
/// [`Context::check`].
pub fn unwrap(mesh: &TriMesh, options: &UnwrapOptions, ctx: &Context<'_>) -> Result<UvLayout> {
    packed_by(mesh, options, Packing::Own(options.packer), ctx)
}

/// Unwraps `mesh` as [`unwrap`] does, but another packer than the library's own puts the charts on their
/// pages; `options.packer` is not used.
///
/// # Errors
/// Those of [`unwrap`] and of the packer; [`Error::Internal`](crate::Error::Internal) where it puts a chart
/// off its page.
///
/// ```
/// use atlasfit::geometry::TriMesh;
/// use atlasfit::unwrap::{ChartPosition, FlatChart, PagePacker, Pages, UnwrapOptions, unwrap_with};
/// use atlasfit::{Context, Result, Run};
///
/// /// All charts in one row.
/// struct Row;
/// impl PagePacker for Row {
///     fn fill(
///         &self,
///         charts: &[FlatChart<'_>],
///         pages: Pages,
///         _: &Context<'_>,
///     ) -> Result<Option<Vec<ChartPosition>>> {
///         let padding = f64::from(pages.padding);
///         let [width, height] = pages.size.map(|s| f64::from(s) - padding);
///         let (mut x, mut tallest, mut out) = (padding, 0.0_f64, Vec::new());
///         for chart in charts {
///             out.push(ChartPosition { page: 0, at: [x, padding] });
///             x += chart.uv.iter().map(|p| p[0]).fold(0.0, f64::max) + padding;
///             tallest = chart.uv.iter().map(|p| p[1]).fold(tallest, f64::max);
///         }
///         Ok((x <= width + padding && tallest + padding <= height).then_some(out))
///     }
/// }
///
/// let mesh = TriMesh::new(
///     vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
///     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
/// );
/// let options = UnwrapOptions::default();
/// let layout = Run::default().execute(|ctx| unwrap_with(&mesh, &options, &Row, ctx))?;
/// assert!(layout.pages == 1 && layout.corner_uv.len() == 4);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn unwrap_with(
    mesh: &TriMesh,
    options: &UnwrapOptions,
    packer: &dyn PagePacker,
    ctx: &Context<'_>,
) -> Result<UvLayout> {
    packed_by(mesh, options, Packing::External(packer), ctx)
}

/// Unwraps, with the packer given.
fn packed_by(
    mesh: &TriMesh,
    options: &UnwrapOptions,
    packing: Packing<'_>,
    ctx: &Context<'_>,
) -> Result<UvLayout> {
    options.validate(mesh)?;
    memory::reserve(mesh, options, ctx)?;
    ctx.plan(&SHARES);
    ctx.stage(Stage::Segment, mesh.triangles.len());
    let mut s = Surface::new(mesh, options, ctx)?;
    ctx.check()?;
    let stacks = stacks(&s, options.stack, options.face_group.as_deref(), rounding(mesh, s.unit), ctx)?;
    if stacks.parts > 0 {
        let mut left_out = vec![false; s.faces()];
        stacks.copies.iter().for_each(|c| left_out[c.face as usize] = true);
        s = Surface::without(mesh, &left_out, options, ctx)?;
        ctx.check()?;
    }
    s.price = prices(mesh, &s, options, ctx)?;
    let uvs = mesh.corner_uv.as_deref().unwrap_or_default();
    let Bounded { charts: list, bound } =
        bounded(&mut s, uvs, options, |s, bound| charts_within(s, bound, options.max_charts, ctx), ctx)?;
    ctx.stage(Stage::Pack, list.len());
    ctx.check()?;
    let list = straighten(&s, list, options, bound, ctx)?;
    let whole = list.len();
    let mut list = shorten::shorten(&s, list, options, bound, ctx)?;
    if list.len() > whole {
        // What was cut across has new sides.
        list = straighten(&s, list, options, bound, ctx)?;
    }
    let checked = pack_checked(&s, list, options, packing, ctx)?;
    let [width, height] = options.page_size;
    let known = UvLayout {
        width,
        height,
        padding_px: checked.packed.padding,
        texels_per_unit: checked.packed.density / s.unit,
        stretch_bound: bound,
        repaired_charts: checked.repaired,
        stacked_parts: stacks.parts,
        straightened_charts: checked.charts.iter().filter(|c| c.straight).count(),
        warnings: warnings(mesh, &s, &checked, options),
        ..UvLayout::default()
    };
    ctx.check()?;
    layout(&s, &checked, &stacks.copies, options.face_polygon.as_deref(), known, ctx)
}

/// What files in single precision round off a mesh's positions, in units of its surface.
fn rounding(mesh: &TriMesh, unit: f64) -> f64 {
    let finite = mesh.positions.iter().flatten().filter(|x| x.is_finite());
    f64::from(f32::EPSILON) * finite.fold(0.0, |most: f64, x| most.max(x.abs())) / unit
}

/// The surface in charts that are stretched by `bound` at most, of which `fewest` counts more than short
/// seams.
fn charts_within(s: &Surface, bound: f64, most: Option<usize>, ctx: &Context<'_>) -> Result<Vec<Chart>> {
    if s.faces() <= LARGE.faces {
        return best_charts(s, bound, most, ctx);
    }
    let patches = segment::patches(s, FirstCut { flatness: usual_flatness(bound), blocks: false }, ctx)?;
    ctx.stage(Stage::Parametrize, patches.count);
    charts_by_coarse(s, &patches, bound, ctx)
}

/// The same for a large surface: merged on a coarse stand-in.
fn charts_by_coarse(
    s: &Surface,
    patches: &Segmentation,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let pieces = first_charts(s, &patches.label, patches.count, None, ctx)?;
    let Charts { list, owner: label, .. } = Charts::new(s.faces(), pieces);
    let patches = Patches::new(s, label, list.len());
    drop(list);
    let coarse = coarsen(s, &patches, LARGE.target, ctx)?;
    let loose = 1.0 + (bound - 1.0) * LARGE.slack;
    let Level { surface, label, .. } = coarse.last();
    let first = first_charts(surface, label, patches.count, Some(loose), ctx)?;
    let mut charts = Charts::new(surface.faces(), first);
    merge::merge(surface, &mut charts, loose, ctx)?;
    let mut charts = Charts::new(s.faces(), refine(s, &patches, &coarse, &charts, bound, ctx)?);
    merge::shorten_borders_of_large(s, &mut charts, bound, ctx)?;
    Ok(charts.list.into_iter().flatten().collect())
}
