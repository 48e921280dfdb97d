//! What a merge must hold to be accepted.

/// Share of a chart's area that may be stretched beyond the bound: the bound is a 95th percentile.
pub(super) const OVER: f64 = 0.05;
/// Beyond this stretch bound, merges that as-rigid-as-possible steps do not manage are tried without flips,
/// at some cost. Within it hardly anything comes of that. Source not recorded; judge it by `atlasfit bench
/// unwrap`.
pub(super) const LOOSE: f64 = 1.35;

/// What a merge must hold.
#[derive(Clone, Copy)]
pub(super) struct MergeLimits {
    /// The stretch bound.
    pub bound: f64,
    /// Share of the merged chart's area that may be beyond it.
    pub over: f64,
    /// Whether to flatten without flips what as-rigid-as-possible steps do not manage.
    pub hard: bool,
}
