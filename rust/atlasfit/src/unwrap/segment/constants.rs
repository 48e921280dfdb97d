//! The numbers of cutting a surface into patches: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`. The mesh homer
//! may have 30 charts at most: its stretch bound rises in steps until it has, and its figures jump with it.

/// The numbers, see [`SEGMENT`].
pub(crate) struct SegmentConstants {
    /// Weight of compactness against flatness: a normal turn of about 0.3 rad weighs as much as shape.
    /// Source: chosen.
    /// Halved: charts 1.09 (nefertiti 1.38), seam 1.05 (homer 1.15), stretch 1.00 (elephant 1.07), coverage
    /// 1.01 (elephant 1.14); doubled: charts 1.11 (homer 1.59), seam 1.02 (homer 1.17), stretch 0.99 (homer
    /// 0.95), coverage 1.02 (camel 1.08).
    pub compact: f64,
    /// A patch's normals must stay within this angle of its mean, so that projection to a plane cannot flip:
    /// cos 70 degrees. Below 1, above 0. Source: chosen, below 90 degrees.
    /// Halved: charts 1.00 (homer 1.29), seam 1.03 (homer 1.12), stretch 1.00 (elephant 1.06), coverage 1.00
    /// (camel 1.08); doubled: charts 1.21 (homer 1.71), seam 1.09 (homer 1.36), stretch 0.99 (homer 0.94),
    /// coverage 1.02 (knot 1.12).
    pub cone_cos: f64,
    /// Seeds are flatter than patches by this factor, so that the queue decides everything that matters. In
    /// (0, 1]. Source: chosen.
    /// Halved: charts 1.10 (homer 1.53), seam 1.05 (homer 1.23), coverage 1.00 (homer 1.09); doubled: charts
    /// 1.09 (elephant 1.57), seam 1.02 (elephant 1.13), stretch 0.99 (elephant 0.94), coverage 1.01 (homer
    /// 1.09).
    pub seed_flatness: f64,
    /// Passes at most: each leaves about two thirds of the clusters. Source: chosen.
    /// Halved: charts 1.07 (homer 1.65), seam 1.02 (homer 1.19), coverage 1.02 (camel 1.11); doubled: charts
    /// 1.10 (homer 1.47), seam 1.07 (homer 1.25), stretch 0.99 (homer 0.94), coverage 1.00 (fertility 0.95).
    pub seed_passes: usize,
    /// But more while there are more clusters than this: the queue's cost for each grows with their number.
    /// Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub most_seeds: usize,
    /// Passes end when one joins less than one cluster in this many. Source: chosen.
    /// Halved: seam 1.02 (cow 1.18), coverage 0.99 (cow 0.92); doubled: no figure changes by 1 %.
    pub fewest_joined: usize,
    /// Costs that one task computes. Changes no result. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub chunk: usize,
    /// Passes over all cells at most. Source: chosen.
    /// Halved: charts 1.01 (homer 1.12), coverage 1.01 (homer 1.07); doubled: no figure changes by 1 %.
    pub smooth_passes: usize,
    /// A cell that is flatter against another patch goes there for this share of the border's length, times
    /// the difference of the cosines. Source: chosen.
    /// Halved: charts 1.04 (elephant 1.29), seam 1.01 (nefertiti 1.07), coverage 1.03 (elephant 1.13);
    /// doubled: charts 1.10 (elephant 1.71), seam 1.03 (homer 1.23), stretch 0.99 (homer 0.95), coverage 1.02
    /// (elephant 1.11).
    pub flatter: f64,
    /// Gains of border length below this (the surface has area 1) are rounding. Source: chosen, above what
    /// sums of lengths round.
    /// Halved or doubled: same bytes.
    pub least_gain: f64,
    /// Quads that make a block at least; fewer are left to the queue. Source: chosen, two rows of two.
    pub least_block: usize,
}

/// Their values.
pub(crate) const SEGMENT: SegmentConstants = SegmentConstants {
    compact: 0.01,
    cone_cos: 0.342,
    seed_flatness: 0.3,
    seed_passes: 6,
    most_seeds: 60_000,
    fewest_joined: 8,
    chunk: 4096,
    smooth_passes: 8,
    flatter: 0.3,
    least_gain: 1e-9,
    least_block: 4,
};
