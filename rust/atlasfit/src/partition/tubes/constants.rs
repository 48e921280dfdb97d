//! The numbers of finding thin tubes and fitting them: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`TUBES`].
pub(crate) struct TubeConstants {
    /// Radii of the neighbourhoods that are tried, in point spacings. The least shows more of a scan than one
    /// scan line; beyond the largest, tubes are thick enough for patches. Source: chosen.
    /// Halved: points 0.98 (spiral 0.87), com 0.91 (spiral 0.55); doubled: points 0.98 (ring 0.66), com 0.93
    /// (ring 0.69).
    pub scales: [f64; 4],
    /// One point in this many takes part in the first look. At least 1. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub thin_out: usize,
    /// But no fewer points than this. Source: chosen.
    /// Halved: points 0.98 (spiral 0.84), com 1.02 (spiral 1.07); doubled: same bytes.
    pub first_look: usize,
    /// A neighbourhood looks like a tube when its second principal variance is below this share of the first.
    /// In (0, 1). Source: derived, a ball of radius R about a tube of radius r has r^2 / 2 over R^2 / 3, at r
    /// = R / 3.7.
    /// Halved: points 0.98 (ring 0.90); doubled: same bytes.
    pub elongated: f64,
    /// And its third principal variance is above this share of the second: 1 for a whole circle, 0 for a flat
    /// strip. Source: chosen.
    /// Halved: points 0.93 (spiral 0.66), acc 0.98 (spiral 0.86), com 0.89 (spiral 0.48); doubled: points
    /// 1.14 (spiral 2.21), acc 1.15 (spiral 2.33), com 1.10 (spiral 1.76).
    pub round: f64,
    /// Where the first look shows fewer points, all points are looked at. Source: chosen, variances are then
    /// known to the root of 2 / 24, 30 %.
    /// Halved or doubled: same bytes.
    pub enough: usize,
    /// Fewer points at the first look say nothing. Source: chosen.
    /// Halved or doubled: same bytes.
    pub fewest: usize,
    /// Points that are looked at together, in parallel: more would often lie on the same tube. Changes no
    /// result. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub at_once: usize,
    /// Share of the points that must lie on tubes for these to tell the scan's noise. In (0, 1). Source:
    /// chosen, the majority.
    /// Halved: same bytes; doubled: points 1.26 (ring 2.29), acc 1.32 (spiral 2.49), com 1.18 (ring 2.17).
    pub most: f64,
    /// A tube whose points scatter by this many times the noise is none. Above 1. Source: chosen.
    /// Halved: points 1.42 (ring 4.13), acc 1.31 (ring 2.67), com 1.84 (spiral 11.84); doubled: same bytes.
    pub noisy: f64,
    /// Tubes that say together how noisy a place is: along a bar, one and two on either side of it. Source:
    /// chosen.
    pub together: usize,
    /// Least share of its points that a sector of the circumference must have. In (0, 1). Source: chosen.
    /// Halved: same bytes; doubled: points 1.02 (spiral 1.16), acc 1.02 (spiral 1.15), com 1.11 (spiral
    /// 1.86).
    pub even: f64,
    /// Largest first or second harmonic of the angles, per point, where noise hides the shape. In (0, 1): 0
    /// for an even circle, 1 for one direction. Source: chosen.
    /// Halved or doubled: same bytes.
    pub lopsided: f64,
    /// Members farther than this many times the median distance from the axis are not the tube's. Source:
    /// derived, a Gaussian blob without any radius keeps 99.5 percent (1 - exp(-(2.8 * 1.177)^2 / 2)).
    /// Halved: points 1.48 (ring 4.19), acc 1.35 (ring 2.62), com 1.83 (spiral 10.31); doubled: no figure
    /// changes by 1 %.
    pub within: f64,
    /// Least half length, in root mean square distances from the axis. Source: chosen.
    /// Halved: points 1.01 (ring 1.08); doubled: points 0.93 (ring 0.63), acc 0.94 (ring 0.70), com 0.94
    /// (ring 0.69).
    pub shortest: f64,
    /// Greatest half length, in the same unit. Source: chosen.
    /// Halved: acc 1.01 (spiral 1.05), com 1.04 (spiral 1.20); doubled: same bytes.
    pub longest: f64,
    /// Growth of the domain in one step. Above 1. Source: chosen, as for patches.
    /// Halved: com 1.04 (spiral 1.20); doubled: acc 1.01 (spiral 1.05), com 1.04 (spiral 1.20).
    pub growth: f64,
    /// In no bin of the length may the points just outside outnumber this share of those inside. Source:
    /// chosen.
    /// Halved or doubled: same bytes.
    pub crowded: f64,
    /// The tube must be thicker than this many point spacings: else it is a line of points, such as a scan
    /// line, that says nothing of a surface. Source: chosen.
    /// Halved: points 0.92 (spiral 0.62), acc 0.99 (spiral 0.94), com 0.89 (spiral 0.50); doubled: points
    /// 1.26 (ring 4.09), acc 1.17 (ring 2.59), com 1.22 (ring 3.27).
    pub thick: f64,
    /// A thinner one is a tube all the same where a circle explains the distances from the axis better than
    /// a line of points does, by this much, in nats. Source: derived, ln(1000) + 3: beyond chance (1 in 20)
    /// among a thousand places.
    /// Halved: points 0.92 (spiral 0.60), acc 0.98 (spiral 0.90), com 0.88 (spiral 0.48); doubled: points
    /// 1.15 (spiral 2.27), acc 1.15 (spiral 2.31), com 1.10 (spiral 1.76).
    pub circle_gain: f64,
    /// A tube tapers to this share of its mean radius at the least, for what is dense. Source: chosen.
    /// Halved or doubled: same bytes.
    pub taper: f64,
    /// Fewer points make no tube. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: points 1.14 (spiral 2.26), acc 1.15 (spiral 2.36), com 1.10
    /// (spiral 1.78).
    pub min_points: usize,
    /// Largest first harmonic of the points' angles, per point: more says that they lie on one side. In (0,
    /// 1). Source: chosen.
    /// Halved or doubled: same bytes.
    pub one_side: f64,
    /// Largest second harmonic: more says that they lie on two sides, as in a strip. In (0, 1). Source:
    /// chosen.
    /// Halved: points 1.01 (spiral 1.06), acc 1.02 (spiral 1.11); doubled: same bytes.
    pub two_sides: f64,
    /// Slope of the axis at the ends of a tube's domain. Source: derived, atan(0.42) = 23 degrees at either
    /// end, half a right angle in all.
    /// Halved: com 1.04 (spiral 1.20); doubled: points 0.83 (ring 0.45), acc 0.90 (ring 0.63), com 1.04
    /// (spiral 2.02).
    pub max_slope: f64,
    /// Above this ratio of noise to radius the shape of the cross-section is lost; a circle is fitted.
    /// Source: chosen.
    /// Halved: points 1.02 (spiral 1.11), acc 1.03 (spiral 1.18), com 0.98 (spiral 0.91); doubled: points
    /// 1.05 (ring 1.31), acc 0.95 (ring 0.73), com 0.95 (ring 0.73).
    pub circle: f64,
    /// Smoothness that is tried, natural logarithm: from interpolation to a cone. Source: chosen.
    /// .0 halved and doubled: same bytes. .1 halved and doubled: same bytes.
    /// First: Halved or doubled: same bytes.
    /// Second: Halved or doubled: no figure changes by 1 %.
    /// First: Halved or doubled: same bytes.
    /// Second: Halved or doubled: no figure changes by 1 %.
    pub log_kappa: (f64, f64),
    /// Where the search for the smoothness begins, natural logarithm. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub likely: f64,
    /// Steps of 7 % in the search for the noise, down from the most that there can be. Source: derived,
    /// 0.93^28 = 0.13: at less the radius is well known without it.
    /// Halved or doubled: same bytes.
    pub noise_steps: usize,
    /// Distances that say about where the noise is, ... Source: derived, 6000 distances tell it to 1 /
    /// sqrt(12000) = 1 %.
    /// Halved or doubled: same bytes.
    pub pooled: usize,
    /// ... to within so many steps. Source: derived, two steps are 14 %, many times the error of that.
    /// Halved or doubled: same bytes.
    pub within_steps: usize,
}

/// Their values.
pub(crate) const TUBES: TubeConstants = TubeConstants {
    scales: [7.0, 11.0, 17.0, 26.0],
    thin_out: 8,
    first_look: 3000,
    elongated: 0.11,
    round: 0.35,
    enough: 24,
    fewest: 12,
    at_once: 4,
    most: 0.5,
    noisy: 1.2,
    together: 5,
    even: 0.6,
    lopsided: 0.1,
    within: 2.8,
    shortest: 3.0,
    longest: 14.0,
    growth: 1.3,
    crowded: 0.3,
    thick: 1.2,
    circle_gain: 10.0,
    taper: 0.1,
    min_points: 60,
    one_side: 0.3,
    two_sides: 0.4,
    max_slope: 0.42,
    circle: 0.4,
    log_kappa: (-25.0, 5.0),
    likely: -5.0,
    noise_steps: 28,
    pooled: 6000,
    within_steps: 2,
};

// Sizes of arrays.

/// Bins along the axis for the checks. Source: chosen, at least six points each at `min_points`.
pub(crate) const BINS: usize = 10;

/// Sectors of the circumference for the search for gaps: 30 degrees each. Source: chosen, at least five
/// points each at `min_points`.
pub(crate) const SECTORS: usize = 12;
