//! The numbers of telling surface from strays: one place, each with its unit and where it is from.

/// The numbers, see [`STRAYS`].
pub(crate) struct StraysConstants {
    /// A chart is looked at as far as this many standard deviations of its noise from its centre: a sheet is
    /// then clearly wider than it is thick, and a clump of strays that a chart was laid through fills the
    /// whole of it. Source: derived, within a radius of 5 a sheet's points spread 2.5 along it and 1 across.
    pub window: f64,
    /// The same in spacings of the chart's points, where that is more: about 28 points. Source: derived, four
    /// times the unknowns of a quadric.
    pub window_spacings: f64,
    /// Points of a window that are looked at: more make the decision no surer. Source: derived, each point of
    /// a sheet brings about one nat.
    pub most: usize,
    /// Standard deviation of the logarithm of the noise from place to place of one scan. Source: derived,
    /// grazing angles of up to 75 degrees make it up to 2.7 times as large (Nguyen et al. 2012), two standard
    /// deviations.
    pub noise_varies: f64,
    /// The evidence (in nats) that a chart must have beyond what the best of so many charts through nothing
    /// but strays has by chance. Source: derived, strays pass for a sheet in one scan of seven.
    pub beyond_chance: f64,
    /// Charts that go on from each other have normals with at least this cosine (32 degrees) where they share
    /// points. Source: chosen.
    pub parallel: f64,
    /// And they lie less than this many standard deviations of the noise apart there. Source: derived, both
    /// charts' errors together stay below it.
    pub together: f64,
    /// Points that must say that charts go on from each other. Source: derived, one may be chance.
    pub shared: f64,
    /// Factor from one thickness of a slab that is tried to the next. Source: chosen.
    pub thicker: f64,
    /// Thicknesses of slabs that are tried. Source: chosen, up to about four times the noise.
    pub slabs: i32,
    /// Standard deviation of the logarithm of how much wider than thick a clump of strays looks in a window.
    /// Source: derived, a ball that cuts a Gaussian clump off its middle leaves it up to twice as wide as
    /// thick, about three standard deviations.
    pub clumps_vary: f64,
    /// Neighbours by which the density at a point is known. Source: chosen.
    pub density_k: usize,
    /// Points around that tell the usual density there. Source: derived, their median has an error of a
    /// fifth of their scatter.
    pub around: usize,
    /// Points at which that scatter is measured. Source: derived, an error of 2 %.
    pub scatter_samples: usize,
    /// Standard deviation of the logarithm of the density that is assumed at least. Source: chosen.
    pub least_scatter: f64,
    /// The density of strays may be anything: evenly spread over so many units of its logarithm. Source:
    /// derived, spacings from that of the surface to a hundred times as wide.
    pub stray_range: f64,
    /// The share of a surface's points whose density is off all the same. Source: chosen.
    pub odd: f64,
}

/// Their values.
pub(crate) const STRAYS: StraysConstants = StraysConstants {
    window: 5.0,
    window_spacings: 3.0,
    most: 4096,
    noise_varies: 0.5,
    beyond_chance: 2.0,
    parallel: 0.85,
    together: 2.0,
    shared: 2.0,
    thicker: 1.6,
    slabs: 3,
    clumps_vary: 0.25,
    density_k: 8,
    around: 32,
    scatter_samples: 2000,
    least_scatter: 0.1,
    stray_range: 5.0,
    odd: 0.01,
};
