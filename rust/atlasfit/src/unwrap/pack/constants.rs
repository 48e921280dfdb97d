//! The numbers of packing: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`. The mesh homer
//! may have 30 charts at most: its stretch bound rises in steps until it has, and its figures jump with it.

/// The numbers, see [`PACK`].
pub(crate) struct PackConstants {
    /// Share of the page expected to be covered, for a first guess. In (0, 1). Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: coverage 1.00 (homer 1.06).
    pub expected_fill: f64,
    /// Texels that an island covers on average, at least: two each way. With fewer it holds no picture, and
    /// rather than that the padding gives way. Source: derived.
    pub least_texels: f64,
    /// The charts of a mesh of this many faces take about as long to find as their page takes to be searched
    /// for. Larger meshes are searched for more rounds in proportion: that costs them little. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub effort_faces: f64,
    /// Up to this many times as many. At least 1. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub most_effort: f64,
    /// Masks of at most this many cells each way count as alike if their boxes are. Source: chosen, for
    /// speed.
    /// Halved or doubled: same bytes.
    pub small: usize,
    /// Charts above this share of the area are tried at more rotations. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub turn_more: f64,
    /// Rotations of these large charts, in a quarter turn. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: time 1.3.
    pub turns: usize,
    /// Rotations of the others. Source: chosen.
    /// Halved or doubled: same bytes.
    pub turns_small: usize,
    /// Rotations of all charts where pages have a fixed size. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub turns_fixed: usize,
    /// Cells along the page's longer side while its size is estimated. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: coverage 1.01 (homer 1.06).
    pub rough: f64,
    /// The page is aimed to be this much smaller than its cells: padding in whole cells must not come out too
    /// small. Below 1. Source: chosen.
    /// Halved: coverage 0.98 (maze 0.85); doubled: coverage 0.69 (elephant 0.46), time 1.5.
    pub room: f64,
    /// A page's side is at least this share of its longest chart's box diagonal, for a first guess. Source:
    /// chosen.
    /// Halved: same bytes; doubled: no figure changes by 1 %.
    pub decisive: f64,
    /// Share of the page that the first strip's width is for. In (0, 1]. Source: chosen.
    /// Halved: coverage 1.01 (homer 1.07); doubled: coverage 1.00 (homer 1.06).
    pub rough_fill: f64,
    /// Strip widths tried one after the other. Source: chosen.
    /// Halved: coverage 1.00 (homer 1.06); doubled: coverage 1.01 (homer 1.06).
    pub widths: usize,
    /// Orders tried at once. At least 1. Source: chosen, for two threads or more.
    /// Halved: no figure changes by 1 %; doubled: coverage 1.01 (homer 1.06).
    pub orders: usize,
    /// Rounds of trying. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub order_rounds: usize,
    /// With many charts only this over their number. Source: chosen, for speed.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub order_work: usize,
    /// Rounds without success before the page shrinks by half as much at a time. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub patience: usize,
    /// How often it does so. Source: chosen.
    /// Halved: coverage 0.99 (homer 0.97); doubled: no figure changes by 1 %.
    pub halvings: usize,
    /// The page shrinks by this share of its side at a time, at first. In (0, 1). Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub shrink: f64,
    /// Times that a larger page is tried because the padding came out too small: it is of a fixed number of
    /// cells, on a page of about as many. Source: chosen.
    /// Halved or doubled: same bytes.
    pub pages_tried: usize,
    /// No order is searched for on a page whose padding comes out smaller than this share of what is asked
    /// for, or smaller at all once a larger page was tried. Source: chosen, for speed.
    /// Halved: same bytes; doubled: coverage 1.00 (homer 1.06).
    pub padding_near: f64,
    /// Share of the padding that may be lost to rounding. Source: chosen, far above what double precision
    /// rounds and far below a texel.
    /// Halved or doubled: same bytes.
    pub rounding: f64,
    /// Runs looked at before a row's positions are computed: a run longer than the row's longest gap rules
    /// the row out. Changes no result. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub glances: usize,
    /// Densities tried before the best one found counts. Source: chosen.
    /// Halved or doubled: same bytes.
    pub scales: usize,
    /// The search ends where the least density that is too high is less than this many times the best found.
    /// Above 1. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: coverage 0.98 (knot 0.83).
    pub close: f64,
    /// Factor on the density while nothing fits ... In (0, 1). Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub less: f64,
    /// ... and once so many densities were tried without any that did. In (0, 1). Source: chosen.
    /// Halved or doubled: same bytes.
    pub much_less: f64,
    /// Texels by which an external packer's position may be off the page, for rounding. Source: chosen.
    /// Halved or doubled: same bytes.
    pub off_page: f64,
}

/// Their values.
pub(crate) const PACK: PackConstants = PackConstants {
    expected_fill: 0.62,
    least_texels: 4.0,
    effort_faces: 16_000.0,
    most_effort: 8.0,
    small: 8,
    turn_more: 0.001,
    turns: 6,
    turns_small: 2,
    turns_fixed: 2,
    rough: 256.0,
    room: 0.985,
    decisive: 0.8,
    rough_fill: 0.8,
    widths: 4,
    orders: 2,
    order_rounds: 30,
    order_work: 2000,
    patience: 6,
    halvings: 2,
    shrink: 0.02,
    pages_tried: 8,
    padding_near: 0.8,
    rounding: 1e-9,
    glances: 12,
    scales: 12,
    close: 1.01,
    less: 0.85,
    much_less: 0.7,
    off_page: 0.01,
};

/// The numbers of packing by boxes, see [`BOXES`].
pub(crate) struct BoxConstants {
    /// Factor on the density until the boxes fit. In (0, 1). Source: chosen.
    /// Halved: coverage 0.94 (camel 0.59); doubled: same bytes, 1 of 9 meshes fail.
    pub less: f64,
    /// The same where they are very many, and need not fill the page as well. In (0, 1). Source: chosen, for
    /// speed.
    /// Halved or doubled: same bytes.
    pub less_for_crumbs: f64,
    /// Gap between very many charts, as a share of the side of the square that each has on average. Below
    /// 0.5. Source: derived, ten by ten gaps for each chart leave room for points, which boxes shrink to.
    pub crumbs_gap: f64,
    /// Texels between charts where no padding is asked for. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub least_gap: f64,
}

/// Their values.
pub(crate) const BOXES: BoxConstants =
    BoxConstants { less: 0.99, less_for_crumbs: 0.95, crumbs_gap: 0.1, least_gap: 1.0 };

/// The numbers of pushing charts together, see [`TIGHTEN`].
pub(crate) struct TightenConstants {
    /// Unit of length here: the page's longer side, as it comes in, over this. Source: derived, a texel of
    /// the default page.
    pub units: f64,
    /// Least distance of charts where no padding is asked for, in units. Source: chosen.
    /// Halved or doubled: same bytes.
    pub least_gap: f64,
    /// Slope of an edge against a side of the page up to which it runs along it. Source: chosen, half a
    /// degree.
    pub askew: f64,
    /// Charts may be this much too near each other, in units; they are moved apart until they are this much
    /// too far. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub tolerance: f64,
    /// Most units by which the page shrinks at a time. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub step: f64,
    /// Failures after which the step is halved; the next one ends the work. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub halvings: usize,
    /// Most times that the page shrinks. Source: chosen.
    /// Halved or doubled: same bytes.
    pub tries: usize,
    /// Share of the least distance that a step may use up. In (0, 1). Source: derived, two charts come nearer
    /// by less than that distance.
    pub slow: f64,
    /// The same where charts are moved apart. Below 0.5. Source: derived, each of two may move by this share
    /// of it.
    pub apart: f64,
    /// Charts nearer than this share of the padding may be on the wrong sides of each other after another
    /// step. Source: chosen.
    /// Halved or doubled: same bytes.
    pub touching: f64,
    /// Most times per step that what is near is looked for and charts are moved apart. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub rounds: usize,
    /// From this round on, what is lacking must come down from round to round ... Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub patience: usize,
    /// ... to this share of what it was. In (0, 1]. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub progress: f64,
    /// Most passes over all constraints per round. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub passes: usize,
    /// One of so many passes is over all constraints, the others over those that it found broken. Source:
    /// chosen, for speed.
    pub look_at_all: usize,
    /// More charts than this leave little to gain. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub most_charts: usize,
    /// More border edges than this take too much memory. Source: derived, each has some fifty near ones of 12
    /// bytes: 60 MB.
    pub most_edges: usize,
    /// Charts nearer than this beyond the padding are kept apart, in units. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub reach: f64,
    /// What may come near is found again after charts moved by half of this, in units. Source: chosen, for
    /// speed.
    /// Halved or doubled: same bytes.
    pub margin: f64,
}

/// Their values.
pub(crate) const TIGHTEN: TightenConstants = TightenConstants {
    units: 1024.0,
    least_gap: 0.25,
    askew: 0.01,
    tolerance: 0.01,
    step: 3.0,
    halvings: 3,
    tries: 80,
    slow: 0.7,
    apart: 0.45,
    touching: 0.1,
    rounds: 8,
    patience: 3,
    progress: 0.9,
    passes: 60,
    look_at_all: 8,
    most_charts: 1000,
    most_edges: 100_000,
    reach: 2.5,
    margin: 3.0,
};

/// Cells along the longer side of a page. Apart from the others, as the sizes of arrays follow from it.
/// Source: chosen.
pub(crate) const CELLS: f64 = 512.0;
