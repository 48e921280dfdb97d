//! The numbers of the prior of charts: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`PRIOR`].
pub(crate) struct PriorConstants {
    /// Power of an eigenvalue of the bending energy that the prior's precision is. Source: derived,
    /// eigenvalues grow like frequency^4, the arc-cosine kernel's precision like frequency^5.
    /// Halved: points 1.13 (plate 1.80), acc 1.19 (plate 1.80), com 1.23 (plate 2.34); doubled: points 0.98
    /// (mobius 0.92), acc 0.97 (sphere 0.79), com 0.95 (sphere 0.79).
    pub order: f64,
    /// Precision of freer bends (eigenfunctions [`FREE`] to [`BENDS`]), as a share of what the spectrum gives
    /// them. How far a patch reaches is chosen by how much the surface bends there, so many patches bend more
    /// than the spectrum of their ripples tells. In (0, 1). Source: measured, errors at points left out of
    /// patches (docs/gp.md).
    /// Halved: points 1.01 (plate 1.08), facing 1.10 (spiral 2.79); doubled: acc 0.99 (plate 0.64), com 0.99
    /// (plate 0.67), facing 1.11 (spiral 1.99).
    pub bends: f64,
    /// Step of the search for the smoothness, natural logarithm: a factor 8, below which the likelihood of a
    /// hundred points hardly tells two values apart; a parabola finds the peak between. Source: derived.
    /// Halved: acc 0.98 (plate 0.83), com 0.99 (plate 0.86), facing 1.18 (spiral 4.89); doubled: acc 0.99
    /// (facade3 0.96), com 0.99 (spiral 0.79), facing 1.06 (spiral 1.72).
    pub step: f64,
    /// The range in which smoothness is chosen, natural logarithm of kappa: from interpolation to a plane.
    /// Source: chosen.
    /// First: Halved or doubled: same bytes.
    /// Second: Halved: points 0.99 (plate 0.93); doubled: no figure changes by 1 %.
    /// First: Halved or doubled: same bytes.
    /// Second: Halved: points 0.99 (plate 0.93); doubled: no figure changes by 1 %.
    pub log_kappa: (f64, f64),
    /// Least and largest factor of the length that is smoothed over, of what the user asks for. Source:
    /// measured on noisy shapes (tests/strength.rs) and two real scans: below, charts bend between the points
    /// and the surface comes no nearer to them; above, they become planes and the surface is rougher again
    /// where they meet.
    /// First, with `--denoise=--strength=0.1`: Halved: acc 1.23 (facade1 1.45), com 1.05 (mobius 1.20);
    /// doubled: acc 0.86 (mobius 0.68), com 0.94 (mobius 0.72).
    /// Second, with `--denoise=--strength=8`: Halved: points 0.89 (mobius 0.66), acc 0.85 (sphere 0.48), com
    /// 0.83 (sphere 0.49); doubled: acc 1.02 (sphere 1.09), com 1.01 (sphere 1.09).
    pub strengths: (f64, f64),
    /// Where the search begins, natural logarithm: what most charts of a scan have, or a step beside it.
    /// Source: chosen.
    /// Halved: points 1.10 (plate 1.79), acc 1.14 (plate 2.08), com 1.21 (plate 3.23); doubled: points 1.06
    /// (plate 1.44), acc 1.05 (plate 1.29), com 1.05 (plate 1.35).
    pub likely: f64,
}

/// Their values.
pub(crate) const PRIOR: PriorConstants = PriorConstants {
    order: 5.0 / 4.0,
    bends: 0.1,
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

/// The first eigenfunction after the bends: two saddles and a bowl. Source: derived, a quadric has six
/// coefficients.
pub(crate) const BENDS: usize = 6;

/// Observations that are added together. Changes the last bits only. Source: chosen, for speed: their rows
/// fit into the registers.
pub(crate) const BLOCK: usize = 8;
