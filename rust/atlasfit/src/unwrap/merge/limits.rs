//! What a merge must hold to be accepted.

/// What a merge must hold.
#[derive(Clone, Copy)]
pub(super) struct MergeLimits {
    /// The stretch bound.
    pub bound: f64,
    /// Share of the merged chart's area that may be beyond it.
    pub over: f64,
    /// Largest squared gap with which it is tried, see `MERGE.mismatch`.
    pub mismatch: f64,
    /// Whether to flatten without flips what as-rigid-as-possible steps do not manage.
    pub hard: bool,
    /// Whether to try all of a border; what was refused as it is would be refused again.
    pub whole: bool,
    /// Whether charts may be joined along a part of their border.
    pub darts: bool,
}
