//! The numbers of making a solid: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; "measured" by `tests/watertight.py`.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv --denoise=--watertight`. The two sides of its plate are hard to
//! tell apart at this size: small changes decide.

/// The numbers, see [`SOLID`].
pub(crate) struct SolidConstants {
    /// Side of the lattice's cubes, in voxels of the contour. Source: measured, the coarsest that keeps thin
    /// parts (chair, cup, sheets).
    /// Halved: acc 0.83 (spiral 0.42), com 0.84 (mobius 0.43); doubled: acc 1.25 (spiral 2.55), com 1.47
    /// (spiral 3.77).
    pub step: f64,
    /// A vertex of the lattice that lies nearer to the surface than this share of the cubes' side steps back
    /// to that distance: triangles then have no short sides. With the jitter's sqrt(3) times below 0.25, so
    /// that no tetrahedron is turned over: its opposite edges are half a side apart. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub clearance: f64,
    /// Vertices of the lattice are off by up to this share of the side along each axis: else invented
    /// triangles lie in one plane by the thousand, and tests for intersections are at the mercy of rounding.
    /// Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub jitter: f64,
    /// Where no surface crosses an edge of the lattice, the membrane stays this share of the edge away from
    /// its ends. In (0, 0.5). Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub end_margin: f64,
    /// Where the surface crosses an edge, it stays this share of the edge away from its ends: it may pass
    /// through a vertex that stepped back from another sheet. In (0, 0.5). Source: chosen, small.
    /// Halved or doubled: same bytes.
    pub exit_margin: f64,
    /// The winding number that bounds what is enclosed. Source: derived, half the jump; about a surface with
    /// a plane rim the membrane is the plane then.
    /// Halved: acc 1.20 (mobius 2.68); doubled: acc 0.94 (mobius 0.77).
    pub level: f64,
    /// Behind the surface the level is lower where it must be: above the mean of the winding number's two
    /// sides by this much. In (0, 0.5). Source: derived, walls at the rim then stand at a right angle.
    /// Halved: acc 1.04 (spiral 1.15); doubled: acc 0.80 (spiral 0.37), com 1.46 (spiral 8.01).
    pub above_mean: f64,
    /// Thickness of what encloses nothing, as a share of the scan's size. Source: chosen, what printers can
    /// make of a palm-sized part.
    /// Halved or doubled: same bytes.
    pub thickness: f64,
    /// ... and at the least, in sides of the lattice's cubes. Source: derived, thinner plates would have
    /// holes.
    /// Halved: acc 0.82 (spiral 0.40), com 0.86 (mobius 0.44); doubled: acc 1.23 (spiral 2.32), com 1.25
    /// (mobius 2.67).
    pub least_thickness: f64,
    /// Plates are worth a note where the level is lower than that of what is enclosed by more than this ...
    /// Source: chosen.
    /// Halved or doubled: same bytes.
    pub told: f64,
    /// ... at more than this share of the surface's vertices. Source: chosen.
    /// Halved or doubled: same bytes.
    pub told_share: f64,
    /// Vertices of the lattice that are computed between two checks. Changes no result. Source: chosen.
    /// Halved or doubled: same bytes.
    pub check: usize,
    /// The lattice's numbers are below this. Source: derived, three of them make a key of 63 bits.
    /// Halved: no figure changes by 1 %; doubled: acc 45.68 (mobius 95710.22), com 4.05 (mobius 70.86).
    pub range: i32,
}

/// Their values.
pub(crate) const SOLID: SolidConstants = SolidConstants {
    step: 1.75,
    clearance: 0.12,
    jitter: 0.04,
    end_margin: 0.05,
    exit_margin: 0.02,
    level: 0.5,
    above_mean: 0.25,
    thickness: 0.01,
    least_thickness: 4.0,
    check: 256,
    told: 0.1,
    told_share: 0.01,
    range: 1 << 20,
};
