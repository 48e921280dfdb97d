//! The numbers of making a solid: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; "measured" by `tests/watertight.py`.

/// The numbers, see [`SOLID`].
pub(crate) struct SolidConstants {
    /// Side of the lattice's cubes, in voxels of the contour. Source: measured, the coarsest that keeps thin
    /// parts (chair, cup, sheets).
    pub step: f64,
    /// A vertex of the lattice that lies nearer to the surface than this share of the cubes' side steps back
    /// to that distance: triangles then have no short sides. Below 0.25, so that no tetrahedron is turned
    /// over: their heights are 0.7 sides. Source: chosen.
    pub clearance: f64,
    /// Where no surface crosses an edge of the lattice, the membrane stays this share of the edge away from
    /// its ends. In (0, 0.5). Source: chosen.
    pub end_margin: f64,
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
    /// Vertices of the lattice that are computed between two checks. Changes no result. Source: chosen.
    pub check: usize,
    /// The lattice's numbers are below this. Source: derived, three of them make a key of 63 bits.
    pub range: i32,
}

/// Their values.
pub(crate) const SOLID: SolidConstants = SolidConstants {
    step: 1.25,
    clearance: 0.12,
    end_margin: 0.05,
    level: 0.5,
    above_mean: 0.25,
    thickness: 0.01,
    least_thickness: 4.0,
    check: 256,
    range: 1 << 20,
};
