//! The numbers of parts of one shape: one place, each with its unit and where it is from.

/// The numbers, see [`STACK`].
pub(crate) struct StackConstants {
    /// Lengths of two parts that differ by less than this share of the part's size are equal, besides what
    /// the file rounds. Source: chosen, a tenth of a texel on a part of 1000 texels.
    pub alike: f64,
    /// Four points of a part whose tetrahedron has less than this share of its size cubed lie in a plane.
    /// Source: derived, ten times what that moves.
    pub flat: f64,
}

/// Their values.
pub(crate) const STACK: StackConstants = StackConstants { alike: 1e-4, flat: 1e-3 };
