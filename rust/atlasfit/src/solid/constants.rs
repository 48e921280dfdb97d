//! The numbers of making a solid: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; "measured" by `tests/watertight.py`.

/// The numbers, see [`SOLID`].
pub(crate) struct SolidConstants {
    /// Side of the lattice's cubes, in voxels of the contour. Source: measured, the coarsest that keeps thin
    /// parts (chair, cup, sheets).
    pub step: f64,
    /// A vertex of the lattice that lies nearer to the surface than this share of the cubes' side steps back
    /// to that distance: triangles then have no short sides. With the jitter's sqrt(3) times below 0.25, so
    /// that no tetrahedron is turned over: its opposite edges are half a side apart. Source: chosen.
    pub clearance: f64,
    /// Vertices of the lattice are off by up to this share of the side along each axis: else invented
    /// triangles lie in one plane by the thousand, and tests for intersections are at the mercy of rounding.
    /// Source: chosen.
    pub jitter: f64,
    /// Where no surface crosses an edge of the lattice, the membrane stays this share of the edge away from
    /// its ends. In (0, 0.5). Source: chosen.
    pub end_margin: f64,
    /// Where the surface crosses an edge, it stays this share of the edge away from its ends: it may pass
    /// through a vertex that stepped back from another sheet. In (0, 0.5). Source: chosen, small.
    pub exit_margin: f64,
    /// The winding number that bounds what is enclosed. Source: derived, half the jump; about a surface with
    /// a plane rim the membrane is the plane then.
    pub level: f64,
    /// Behind the surface the level is lower where it must be: above the mean of the winding number's two
    /// sides by this much. In (0, 0.5). Source: derived, walls at the rim then stand at a right angle.
    pub above_mean: f64,
    /// Thickness of what encloses nothing, as a share of the scan's size. Source: chosen, what printers can
    /// make of a palm-sized part.
    pub thickness: f64,
    /// ... and at the least, in sides of the lattice's cubes. Source: derived, thinner plates would have
    /// holes.
    pub least_thickness: f64,
    /// Plates are worth a note where the level is lower than that of what is enclosed by more than this ...
    /// Source: chosen.
    pub told: f64,
    /// ... at more than this share of the surface's vertices. Source: chosen.
    pub told_share: f64,
    /// Vertices of the lattice that are computed between two checks. Changes no result. Source: chosen.
    pub check: usize,
    /// Times that the vertices of triangles that meet are moved. Source: chosen.
    pub untangle: usize,
    /// Steps of each time, halfway to the means of neighbours. Source: chosen.
    pub relaxed: usize,
    /// Only where at most this share of the triangles meet. Source: chosen.
    pub tangled: f64,
    /// The lattice's numbers are below this. Source: derived, three of them make a key of 63 bits.
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
    untangle: 4,
    relaxed: 4,
    told: 0.1,
    told_share: 0.01,
    tangled: 0.01,
    range: 1 << 20,
};
