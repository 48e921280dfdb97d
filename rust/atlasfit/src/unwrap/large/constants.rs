//! The numbers of unwrapping large meshes: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`.

/// The numbers, see [`LARGE`].
pub(crate) struct LargeConstants {
    /// Meshes with more faces than this have their charts found on a coarse stand-in. Source: chosen, for
    /// speed.
    pub faces: usize,
    /// Faces of the coarse stand-in, about. Source: chosen, for speed.
    pub target: usize,
    /// The coarse surface is rougher than the full one: this many times the excess stretch there means the
    /// same here. Source: chosen.
    pub slack: f64,
    /// Coarse triangles per patch at least, so that its shape survives. Source: chosen.
    pub per_patch: f64,
    /// Factor between the length bounds of successive sweeps. Above 1. Source: chosen.
    pub growth: f64,
    /// Faces of a level per face of the next coarser one, at least: pins are then two to three edges apart.
    /// Source: chosen.
    pub thinning: usize,
    /// Side of an equilateral triangle per square root of its area. Source: derived, 2 / 3^(1/4).
    pub side: f64,
    /// Neighbours, nearest first, that a vertex is tried to be moved to. Source: chosen.
    pub nearest: usize,
    /// A fan of more faces than this is not followed further. Source: chosen, for speed.
    pub largest_fan: usize,
    /// Twice a triangle's area over its longest edge squared, at least: no slivers. Source: chosen.
    pub least_height: f64,
    /// Cosine of the angle by which a collapse may turn a triangle: about 45 degrees. Below 1. Source:
    /// chosen.
    pub turn_cos: f64,
    /// As-rigid-as-possible iterations after the interpolated start, at a time. Source: chosen.
    pub steps: usize,
    /// How often so many, while a triangle is flipped. Source: chosen.
    pub times: usize,
    /// Conjugate gradient steps for the start: pins are a few edges apart. Source: chosen.
    pub relax: usize,
    /// A chart stretched beyond the bound on more than this share of its area is cut up again. In [0, 1].
    /// Source: chosen.
    pub most_over: f64,
}

/// Their values.
pub(crate) const LARGE: LargeConstants = LargeConstants {
    faces: 20_000,
    target: 10_000,
    slack: 1.3,
    per_patch: 40.0,
    growth: 1.5,
    thinning: 6,
    side: 1.52,
    nearest: 3,
    largest_fan: 64,
    least_height: 0.1,
    turn_cos: 0.7,
    steps: 8,
    times: 3,
    relax: 20,
    most_over: 0.12,
};
