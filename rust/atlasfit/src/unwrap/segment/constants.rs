//! The numbers of cutting a surface into patches: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`.

/// The numbers, see [`SEGMENT`].
pub(crate) struct SegmentConstants {
    /// Weight of compactness against flatness: a normal turn of about 0.3 rad weighs as much as shape.
    /// Source: chosen.
    pub compact: f64,
    /// A patch's normals must stay within this angle of its mean, so that projection to a plane cannot flip:
    /// cos 70 degrees. Below 1, above 0. Source: chosen, below 90 degrees.
    pub cone_cos: f64,
    /// Seeds are flatter than patches by this factor, so that the queue decides everything that matters. In
    /// (0, 1]. Source: chosen.
    pub seed_flatness: f64,
    /// Passes at most: each leaves about two thirds of the clusters. Source: chosen.
    pub seed_passes: usize,
    /// But more while there are more clusters than this: the queue's cost for each grows with their number.
    /// Source: chosen, for speed.
    pub most_seeds: usize,
    /// Passes end when one joins less than one cluster in this many. Source: chosen.
    pub fewest_joined: usize,
    /// Costs that one task computes. Changes no result. Source: chosen, for speed.
    pub chunk: usize,
    /// Passes over all cells at most. Source: chosen.
    pub smooth_passes: usize,
    /// A cell that is flatter against another patch goes there for this share of the border's length, times
    /// the difference of the cosines. Source: chosen.
    pub flatter: f64,
    /// Gains of border length below this (the surface has area 1) are rounding. Source: chosen, above what
    /// sums of lengths round.
    pub least_gain: f64,
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
};
