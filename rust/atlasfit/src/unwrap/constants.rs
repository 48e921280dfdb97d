//! The numbers of unwrapping that belong to no one step: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`.

/// The numbers, see [`UNWRAP`].
pub(crate) struct UnwrapConstants {
    /// Bound on 1 - |mean normal| of the first patches for a stretch of 1.1; in proportion to the excess
    /// stretch for others. Finer patches leave merging more choice, coarser ones less work. In (0, 1).
    /// Source: chosen.
    pub flatness: f64,
    /// Least factor on it for a tight stretch bound. In (0, 1]. Source: chosen.
    pub least_flatness: f64,
    /// Largest factor on it for a loose one. At least 1. Source: chosen.
    pub most_flatness: f64,
    /// Factor on the excess stretch while there are too many charts. Above 1. Source: chosen.
    pub loosen: f64,
    /// As-rigid-as-possible iterations for a first chart. Source: chosen.
    pub first_steps: usize,
    /// Faces whose normal has less than this cosine with the mean one look away from the rest (78 degrees).
    /// Source: chosen.
    pub facing_cos: f64,
    /// Rounds of cutting out what single precision spoils; in the last, spoiled charts fall apart into single
    /// faces. At least 1. Source: chosen.
    pub repairs: usize,
    /// A density below this share of what was asked for is worth a warning. Below 1. Source: chosen, above
    /// what rounding does.
    pub density_kept: f64,
    /// Squared length of the longest chart that fits on a page without making it larger; the surface has area
    /// 1. Source: chosen, below the squared diagonal of the page that charts cover at 0.62: 3.2.
    pub page_length2: f64,
    /// A chart is cut where the page would have to be this much larger for it than for the area of all
    /// charts: a seam across is little to pay for half as many texels again. Above 1. Source: chosen.
    pub too_large: f64,
    /// It is cut at most this far from its middle, in shares of its length. Below 0.5. Source: chosen.
    pub middle: f64,
    /// Rotations in a half turn, in which the page that a chart needs is looked for. Source: chosen; 7.5
    /// degrees apart.
    pub page_turns: usize,
    /// Corners of a hull that are enough to turn it upright, or to see how long it is. Source: derived, an
    /// even polygon of as many corners is a circle to one part in 100,000.
    pub enough_corners: usize,
}

/// Their values.
pub(crate) const UNWRAP: UnwrapConstants = UnwrapConstants {
    flatness: 0.06,
    least_flatness: 0.25,
    most_flatness: 2.0,
    loosen: 1.6,
    first_steps: 5,
    facing_cos: 0.2,
    repairs: 5,
    density_kept: 0.999,
    page_length2: 2.0,
    too_large: 1.5,
    middle: 0.1,
    page_turns: 24,
    enough_corners: 1024,
};
