//! The numbers of unwrapping large meshes: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`. The mesh homer
//! may have 30 charts at most: its stretch bound rises in steps until it has, and its figures jump with it.

/// The numbers, see [`LARGE`].
pub(crate) struct LargeConstants {
    /// Meshes with more faces than this have their charts found on a coarse stand-in. Source: chosen, for
    /// speed.
    /// Halved: charts 0.99 (camel 0.93), seam 0.99 (camel 0.94), coverage 0.99 (camel 0.90); doubled: same
    /// bytes.
    pub faces: usize,
    /// Faces of the coarse stand-in, about. Source: chosen, for speed.
    /// Halved: seam 1.01 (nefertiti 1.09); doubled: no figure changes by 1 %.
    pub target: usize,
    /// The coarse surface is rougher than the full one: this many times the excess stretch there means the
    /// same here. Source: measured, `unwrap --json` of ten meshes of 16,000 to 106,000 faces: 1.3 gives 0.97
    /// of the seam in 1.25 of the time.
    pub slack: f64,
    /// Coarse triangles per patch at least, so that its shape survives. Source: chosen.
    /// Halved: charts 1.01 (nefertiti 1.08), seam 1.01 (nefertiti 1.08); doubled: charts 1.02 (nefertiti
    /// 1.23), seam 1.01 (nefertiti 1.11), coverage 1.01 (nefertiti 1.06).
    pub per_patch: f64,
    /// Factor between the length bounds of successive sweeps. Above 1. Source: chosen.
    /// Halved: same bytes, 1 of 9 meshes fail; doubled: charts 1.01 (nefertiti 1.12), seam 1.02 (nefertiti
    /// 1.21).
    pub growth: f64,
    /// Faces of a level per face of the next coarser one, at least: pins are then two to three edges apart.
    /// Source: chosen.
    /// Halved or doubled: same bytes.
    pub thinning: usize,
    /// Side of an equilateral triangle per square root of its area. Source: derived, 2 / 3^(1/4).
    pub side: f64,
    /// Neighbours, nearest first, that a vertex is tried to be moved to. Source: chosen.
    /// Halved: charts 1.02 (nefertiti 1.19), seam 1.01 (nefertiti 1.14); doubled: no figure changes by 1 %.
    pub nearest: usize,
    /// A fan of more faces than this is not followed further. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub largest_fan: usize,
    /// Twice a triangle's area over its longest edge squared, at least: no slivers. Source: chosen.
    /// Halved: seam 1.01 (nefertiti 1.10); doubled: charts 1.03 (nefertiti 1.27), seam 1.02 (nefertiti 1.20).
    pub least_height: f64,
    /// Cosine of the angle by which a collapse may turn a triangle: about 45 degrees. Below 1. Source:
    /// chosen.
    /// Halved: charts 1.02 (nefertiti 1.15), seam 1.02 (nefertiti 1.17); doubled: charts 0.98 (nefertiti
    /// 0.81), seam 0.99 (nefertiti 0.90).
    pub turn_cos: f64,
    /// As-rigid-as-possible iterations after the interpolated start, at a time. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub steps: usize,
    /// How often so many, while a triangle is flipped. Source: chosen.
    /// Halved or doubled: same bytes.
    pub times: usize,
    /// Conjugate gradient steps for the start: pins are a few edges apart. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub relax: usize,
    /// A chart stretched beyond the bound on more than this share of its area is cut up again. In [0, 1].
    /// Source: chosen.
    /// Halved: charts 0.99 (nefertiti 0.88); doubled: no figure changes by 1 %.
    pub most_over: f64,
}

/// Their values.
pub(crate) const LARGE: LargeConstants = LargeConstants {
    faces: 20_000,
    target: 10_000,
    slack: 1.2,
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
