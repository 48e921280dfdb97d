//! The numbers of deciding which way each chart faces: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.

/// The numbers, see [`ORIENT`].
pub(crate) struct OrientConstants {
    /// Sheets closer than this many standard deviations of the noise may be one. Source: chosen, below 2,
    /// where two equal Gaussians begin to have two modes.
    pub apart: f64,
    /// What one opposing chart counts, in shared points. Source: chosen.
    pub counts: f64,
    /// Sheets whose normals have a greater cosine are parallel (46 degrees). Source: chosen.
    pub parallel: f64,
    /// Of the charts on one side, those up to this many standard deviations of the noise beyond the nearest
    /// are of the same sheet. Source: chosen.
    pub same_sheet: f64,
    /// Charts so many standard deviations of the noise apart, or less than the point spacing, may be of one
    /// sheet or of two: sweeps of a scanner that are misaligned lie as near, and face the same way. Source:
    /// chosen.
    pub unsure: f64,
    /// Agreement (in points) below which a contradiction is chance: a stray chart, not a one-sided surface,
    /// whose charts contradict each other over whole overlaps. Source: chosen.
    pub min_conflict: f64,
    /// Share of all agreement that must be contradicted before a surface counts as one-sided. A Moebius strip
    /// must be cut across its whole width, which takes one or two percent of its overlaps; stray charts
    /// contradict in far fewer. Source: chosen between the two.
    pub one_sided: f64,
}

/// Their values.
pub(crate) const ORIENT: OrientConstants = OrientConstants {
    apart: 1.5,
    counts: 0.3,
    parallel: 0.7,
    same_sheet: 2.0,
    unsure: 1.8,
    min_conflict: 1.0,
    one_sided: 0.004,
};
