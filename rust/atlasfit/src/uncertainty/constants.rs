//! The numbers of uncertainty: one place, each with its unit and where it is from.

/// The numbers, see [`UNCERTAINTY`].
pub(crate) struct UncertaintyConstants {
    /// Points beside each whose residuals are compared with its own. Source: chosen; a point's place follows
    /// the noise of five points and more about it.
    pub beside: usize,
    /// Points beside each other lie on one sheet where their normals' cosine is above this. Source: chosen.
    pub same_side: f64,
    /// Charts whose points are looked at together: they take 7 kB each. Source: chosen.
    pub at_once: usize,
    /// Unknowns of a tube whose cross-section is a circle: radius and place, each with its slope. Source:
    /// derived.
    pub circle: f64,
    /// Standard error of the calibration's factor (of the variance) above which it is not believed. Source:
    /// chosen: the standard deviation is then wrong by a quarter.
    pub doubtful: f64,
    /// Standard errors by which a factor is below a bound and not by chance: below zero the noise of points
    /// beside each other is not independent, below one it may not be. Source: chosen.
    pub dependent: f64,
    /// Points about a vertex that tell its uncertainty. Source: chosen, as for colours.
    pub about_vertex: usize,
}

/// Their values.
pub(crate) const UNCERTAINTY: UncertaintyConstants = UncertaintyConstants {
    beside: 4,
    same_side: 0.5,
    at_once: 512,
    circle: 6.0,
    doubtful: 0.5,
    dependent: 3.0,
    about_vertex: 4,
};
