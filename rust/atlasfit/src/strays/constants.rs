//! The numbers of telling surface from strays: one place, each with its unit and where it is from.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`STRAYS`].
pub(crate) struct StraysConstants {
    /// A chart is looked at as far as this many standard deviations of its noise from its centre: a sheet is
    /// then clearly wider than it is thick, and a clump of strays that a chart was laid through fills the
    /// whole of it. Source: derived, within a radius of 5 a sheet's points spread 2.5 along it and 1 across.
    /// Halved: points 1.03 (plate 1.18), acc 1.07 (plate 1.48), com 1.16 (plate 2.42); doubled: acc 1.01
    /// (plate 1.07).
    pub window: f64,
    /// The same in spacings of the chart's points, where that is more: about 28 points. Source: derived, four
    /// times the unknowns of a quadric.
    /// Halved: acc 1.05 (plate 1.20), com 0.92 (spiral 0.56); doubled: points 1.03 (plate 1.16), acc 1.04
    /// (plate 1.12), com 1.04 (plate 1.41).
    pub window_spacings: f64,
    /// Windows that are tried where the narrowest says too little, each twice as wide as the last. Source:
    /// chosen, up to charts of twelve spacings.
    pub windows: i32,
    /// Points of a window that are looked at: more make the decision no surer. Source: derived, each point of
    /// a sheet brings about one nat, and a sheet needs twenty among a hundred million charts
    /// (`beyond_chance` and the logarithm of their number).
    pub most: usize,
    /// Standard deviation of the logarithm of the noise from place to place of one scan. Source: derived,
    /// grazing angles of up to 75 degrees make it up to 2.7 times as large (Nguyen et al. 2012), two standard
    /// deviations.
    /// Halved: points 1.04 (plate 1.26), acc 1.07 (plate 1.53), com 1.15 (plate 2.32); doubled: points 1.06
    /// (plate 1.40), acc 1.05 (plate 1.34), com 1.13 (plate 2.04).
    pub noise_varies: f64,
    /// The evidence (in nats) that a chart must have beyond what the best of so many charts through nothing
    /// but strays has by chance, and the logarithm of the odds that a doubtful part must have. Source:
    /// derived, strays pass for a sheet in one scan of seven.
    /// Halved: points 1.06 (plate 1.40), acc 1.07 (plate 1.51), com 1.16 (plate 2.42); doubled: points 0.99
    /// (plate 0.94).
    pub beyond_chance: f64,
    /// Charts that go on from each other have normals with at least this cosine (32 degrees) where they share
    /// points. Source: chosen.
    /// Halved: points 1.03 (plate 1.17), acc 1.04 (plate 1.18), com 1.05 (plate 1.49); doubled: points 0.98
    /// (plate 0.90), acc 1.02 (plate 1.09).
    pub parallel: f64,
    /// And they lie less than this many standard deviations of the noise apart there. Source: derived, both
    /// charts' errors together stay below it.
    /// Halved: points 1.05 (plate 1.32), acc 1.12 (plate 1.79), com 1.20 (plate 2.89); doubled: no figure
    /// changes by 1 %.
    pub together: f64,
    /// Points that must say that charts go on from each other. Source: derived, one may be chance.
    /// Halved: acc 1.01 (plate 1.08); doubled: points 0.98 (plate 0.87), acc 0.99 (plate 0.94).
    pub shared: f64,
    /// Factor from one thickness of a slab that is tried to the next. Source: chosen.
    /// Halved or doubled: points 1.03 (plate 1.19), acc 1.03 (plate 1.18), com 1.07 (plate 1.53).
    pub thicker: f64,
    /// Thicknesses of slabs that are tried. Source: chosen, up to about four times the noise.
    /// Halved: points 1.03 (plate 1.19), acc 1.03 (plate 1.18), com 1.07 (plate 1.53); doubled: points 1.03
    /// (plate 1.19), acc 1.04 (plate 1.18), com 0.99 (spiral 0.60).
    pub slabs: i32,
    /// Standard deviation of the logarithm of how much wider than thick a clump of strays looks in a window.
    /// Source: derived, a ball that cuts a Gaussian clump off its middle leaves it up to twice as wide as
    /// thick, about three standard deviations.
    /// Halved: points 0.99 (plate 0.94), acc 1.02 (plate 1.11), com 1.01 (plate 1.06); doubled: points 1.03
    /// (plate 1.20), acc 1.04 (plate 1.28), com 1.02 (plate 1.16).
    pub clumps_vary: f64,
    /// Neighbours by which the density at a point is known. Source: chosen.
    /// Halved: com 0.96 (spiral 0.79); doubled: acc 0.99 (spiral 0.93), com 1.25 (spiral 3.80).
    pub density_k: usize,
    /// Points around that tell the usual density there. Source: derived, their median has an error of a
    /// fifth of their scatter.
    /// Halved: com 1.19 (spiral 2.77); doubled: com 0.96 (spiral 0.79).
    pub around: usize,
    /// Points at which that scatter is measured. Source: derived, an error of 2 %.
    /// Halved or doubled: same bytes.
    pub scatter_samples: usize,
    /// Standard deviation of the logarithm of the density that is assumed at least. Source: chosen.
    /// Halved: same bytes; doubled: com 0.96 (spiral 0.79).
    pub least_scatter: f64,
    /// The density of strays may be anything: evenly spread over so many units of its logarithm. Source:
    /// derived, spacings from that of the surface to a hundred times as wide.
    /// Halved: acc 0.99 (spiral 0.93), com 1.25 (spiral 3.80); doubled: com 0.96 (spiral 0.79).
    pub stray_range: f64,
    /// The share of a surface's points whose density is off all the same. Source: chosen.
    /// Halved or doubled: same bytes.
    pub odd: f64,
    /// The share of doubtful surface's points that lie beside known surface. Source: measured, 0.86 to 0.93
    /// in three scans of the dragon (`tests/peers/shapes.py dragon 0.002`, seeds 0, 5 and 6).
    pub beside: f64,
    /// Places by which it is known how much of the scan's box is beside its surface. Source: derived, an
    /// error of 1 %.
    pub places: usize,
    /// Charts cross whose normals have a smaller cosine: neither goes on as the other. Source: chosen, half
    /// of a right angle.
    pub crossing: f64,
    /// A chart explains a point well that had more than this robust weight. In (0, 1). Source: derived,
    /// Tukey's weight two standard deviations away.
    pub explained: f32,
    /// Points lie in a row where they spread by less than this many standard deviations of the noise across
    /// it. Source: derived, a strip that spreads by two is seven wide.
    pub row: f64,
    /// Rounds in which it is found how much of what is doubtful is surface. Source: chosen.
    pub rounds: usize,
}

/// Their values.
pub(crate) const STRAYS: StraysConstants = StraysConstants {
    window: 5.0,
    window_spacings: 3.0,
    windows: 3,
    most: 512,
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
    beside: 0.9,
    places: 2000,
    crossing: 0.7,
    row: 2.0,
    explained: 0.67,
    rounds: 100,
};
