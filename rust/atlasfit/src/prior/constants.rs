//! The numbers of the prior of charts: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.

/// The numbers, see [`PRIOR`].
pub(crate) struct PriorConstants {
    /// Power of an eigenvalue of the bending energy that the prior's precision is. Source: derived,
    /// eigenvalues grow like frequency^4, the arc-cosine kernel's precision like frequency^5.
    pub order: f64,
    /// Step of the search for the smoothness, natural logarithm: a factor 8, below which the likelihood of a
    /// hundred points cannot tell two values apart. Source: derived.
    pub step: f64,
    /// The range in which smoothness is chosen, natural logarithm of kappa: from interpolation to a plane.
    /// Source: chosen.
    pub log_kappa: (f64, f64),
    /// Least and largest factor of the length that is smoothed over, of what the user asks for. Source:
    /// measured on noisy shapes (tests/strength.rs) and two real scans: below, charts bend between the points
    /// and the surface comes no nearer to them; above, they become planes and the surface is rougher again
    /// where they meet.
    pub strengths: (f64, f64),
    /// Where the search begins, natural logarithm: what most charts of a scan have, or a step beside it.
    /// Source: chosen.
    pub likely: f64,
}

/// Their values.
pub(crate) const PRIOR: PriorConstants = PriorConstants {
    order: 5.0 / 4.0,
    step: 2.1,
    log_kappa: (-23.0, 4.5),
    strengths: (0.25, 4.0),
    likely: -2.0,
};

// Sizes of arrays.

/// Eigenfunctions kept. Half the number of points in a typical chart; more only fit noise, and the cost of a
/// fit grows with the cube. Source: chosen.
pub(crate) const MODES: usize = 50;

/// The affine functions: no bending, hence no prior on them. Source: derived, a plane has three coefficients.
pub(crate) const FREE: usize = 3;

/// Observations that are added together. Changes the last bits only. Source: chosen, for speed: their rows
/// fit into the registers.
pub(crate) const BLOCK: usize = 8;
