//! The numbers of the surface that is unwrapped: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`. The mesh homer
//! may have 30 charts at most: its stretch bound rises in steps until it has, and its figures jump with it.

/// The numbers, see [`SURFACE`].
pub(crate) struct SurfaceConstants {
    /// Rest triangles thinner than this share of their longest edge are thickened to it, so that every face
    /// has a shape that single-precision UVs can hold. Source: chosen.
    /// Halved or doubled: same bytes.
    pub min_height: f64,
    /// Rest edges shorter than this (the surface has area 1) are lengthened to it, for the same reason.
    /// Source: chosen, above the step of single-precision UVs (6e-8 below 1).
    /// Halved or doubled: same bytes.
    pub min_edge: f64,
    /// Copies of a face are looked for only where at most this many half-edges have its least vertex as
    /// theirs: a bound on the work about the hub of a large fan. Source: chosen.
    /// Halved or doubled: same bytes.
    pub most_at_vertex: u32,
    /// Most faces of a polygon, or about a vertex, past which edges are looked for. Source: chosen; polygons
    /// of more corners than this are caps, beside which nothing runs straight on.
    pub most_corners: usize,
}

/// Their values.
pub(crate) const SURFACE: SurfaceConstants =
    SurfaceConstants { min_height: 1e-3, min_edge: 1e-6, most_at_vertex: 64, most_corners: 64 };
