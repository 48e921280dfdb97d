//! The numbers of estimating the noise: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`NOISE`].
pub(crate) struct NoiseConstants {
    /// Seeds at which a guess of the noise is tried. Source: derived, the share that is found has an error of
    /// sqrt(1/4 / 250) = 3 %.
    /// Halved or doubled: no figure changes by 1 %.
    pub trials: usize,
    /// Half of the patches can be grown at this share of the true noise where noise is below the point
    /// spacing. Source: measured on surfaces flat and finely detailed, thin and thick; the command is not on
    /// record.
    /// Halved: acc 1.06 (plate 1.35), com 1.06 (plate 1.38); doubled: points 0.92 (plate 0.61), acc 0.91
    /// (plate 0.56), com 0.96 (plate 0.74).
    pub half_accepted_below: f64,
    /// The same where noise is as large as the spacing.
    /// Halved: points 1.01 (ring 1.06); doubled: points 0.92 (plate 0.60), acc 0.94 (plate 0.67), com 0.93
    /// (plate 0.65).
    pub half_accepted_above: f64,
    /// Factor between guesses. Above 1. Source: chosen.
    /// Halved: points 1.24 (ring 1.89), com 1.01 (ring 1.07); spiral, mobius, plate fail; doubled: points
    /// 0.92 (plate 0.63), acc 0.94 (plate 0.67), com 0.93 (plate 0.67).
    pub guess_step: f64,
    /// Points at which the noise is estimated. Source: derived, the median of this many has an error of a few
    /// percent.
    /// Halved: points 0.99 (plate 0.97); doubled: acc 1.02 (plate 1.13).
    pub samples: usize,
    /// Neighbourhood sizes tried (points), each with the ratio of the median residual to the true noise on a
    /// plane. Source: sizes chosen, a factor 1.7 apart; ratios simulated (the median of a chi distribution
    /// with few degrees of freedom lies below its mean).
    /// Halved: points 1.10 (ring 1.89), acc 1.07 (box 1.13), com 0.95 (spiral 0.59); doubled: points 1.02
    /// (ring 1.13), acc 1.01 (ring 1.09), com 1.02 (ring 1.11).
    /// Halved: points 1.05 (plate 1.44), acc 1.09 (plate 1.78), com 1.19 (plate 2.75); doubled: points 1.05
    /// (plate 1.19), acc 1.07 (mobius 1.22), com 1.08 (plate 1.22).
    pub scales: [(usize, f64); 7],
    /// Where none of these shows a surface, larger ones are tried, each so many times as large as the last.
    /// Above 1. Source: as above.
    pub wider: f64,
    /// Up to this share of the points: larger ones see the scan's own shape. In (0, 1). Source: chosen.
    pub widest: f64,
    /// And up to so many points: a million that fill a volume take seconds to look through, not minutes.
    /// Source: chosen, noise of a dozen spacings shows in as many.
    pub largest: usize,
    /// Points at which that is done. Source: derived, residuals of hundreds of points each have an error of a
    /// few percent already.
    pub samples_wider: usize,
    /// Samples that say together how noisy a place is. Source: derived, the median of this many residuals of
    /// at least five degrees of freedom has an error of 1.25 / sqrt(2 * 5 * 64) = 5 %.
    pub together: usize,
    /// A place is noisier than usual where the residual grows with a lower power of the number of points.
    /// Source: derived, halfway between noise (0) and a crease (a half).
    pub grows: f64,
    /// A place has this much noise at the most, in point spacings, or the usual: two sheets of a wall nearer
    /// than the least neighbourhood is wide (2 * 1.9) would pass for one noisy one. Source: chosen; 0.6
    /// leaves noisier places in shreds, without a bound a wall of two spacings is lost.
    pub most: f64,
    /// Places are as calm as usual down to this share of the usual noise. In (0, 1). Source: chosen; sweeps
    /// that lie askew look as calm as that where only one is.
    pub calm: f64,
    /// And calmer where it grows with a lower power than this: faster grows nothing that a surface does, but
    /// neighbourhoods along a scan line, which show no noise across it. Source: derived, the cube of their
    /// width, which a quadric cannot follow.
    pub follows: f64,
    /// A neighbourhood shows a surface when its thickness is below this share of its half width (ratio of the
    /// square roots of the two smaller principal variances). Source: chosen below the 0.7 to 0.8 that the
    /// ratio tends to on pure noise.
    /// Halved: no figure changes by 1 %; doubled: points 1.08 (plate 1.62), acc 1.07 (plate 1.47), com 1.12
    /// (plate 1.97).
    pub flat: f64,
    /// Places at which planes are looked for that points lie on exactly. Source: derived, the share that has
    /// one is known to sqrt(0.1 / 250) = 2 %.
    pub planes: usize,
    /// Among so many nearest points. Source: derived, within 2.5 spacings: steps as wide as the spacing leave
    /// a fifth of them on one plane, and of four views each has five of them.
    pub coplanar_among: usize,
    /// A plane has so many of them. Source: derived, three make a plane, and that two others lie within the
    /// rounding of it by chance has odds of one in ten thousand.
    pub coplanar: usize,
    /// Three points whose sine squared is smaller make no plane; nor does a strip whose variances have a
    /// smaller ratio. Source: chosen.
    pub slender: f64,
    /// Planes that are followed to where they end, so that their normal is known. Source: derived, the median
    /// of this many has a quarter of the error of one.
    pub widened: usize,
    /// Times that each may be made wider. Source: derived, from 2.5 spacings to more than two thousand.
    pub widenings: usize,
    /// Rounded scans have planes across one direction at at least this share of the places. In (0, 1).
    /// Source: chosen, of a camera's rows of pixels a fortieth are as parallel.
    pub flat_share: f64,
    /// Of a merged scan each view has a direction of its own; at so many places there are planes across it at
    /// least. Source: chosen, two may agree by chance.
    pub agreeing: f64,
    /// Points that are not of a view lie on its levels as its own points do where the median of their
    /// distances to the nearest end of a level is at least this share of that of its own. In (0, 1). Source:
    /// chosen, between 0 for the risers of stairs and 1.
    pub at_ends: f64,
    /// A direction whose planes hold more than this share of another's points is that of a grid. In (0, 1).
    /// Source: chosen, between half, which pixels in rows have among them, and all.
    pub on_grid: f64,
    /// The points of a level are as far apart as the last of so many is, the point itself being the first.
    /// Source: derived, the fourth neighbour is at 1.09 times the root of the area of each where they are at
    /// random, at 1 on a grid.
    pub apart_among: usize,
    /// Levels that show their ends are so many times as wide as points are apart. Source: chosen, between 0.9
    /// of fins, each of which lies over all others, and 1.3, where a bunny of four views gains by it.
    pub level_width: f64,
    /// Fewer levels of a view that show where they end may be a part's own planes. Source: chosen, half of
    /// `levels`: `at_ends` tells stairs from rounding as well.
    pub levels_with_ends: usize,
    /// Looking ends where so many directions had no levels. Source: chosen, rows of pixels are on thousands
    /// of planes that have none, and fewer places agree on these than on a view's.
    pub without_levels: usize,
    /// Neighbouring levels are no farther apart than this many of the steps about them. Source: derived,
    /// halfway between one step and two.
    pub one_step: f64,
    /// Normals with a greater cosine are the same. Source: derived, a hundred times the rounding of
    /// single precision over a spacing, in a scan of a thousand.
    /// Halved or doubled: same bytes.
    pub along: f64,
    /// Points of one level differ by no more than this share of the extent. Source: derived, some ten times
    /// the rounding of single precision.
    /// Halved or doubled: same bytes.
    pub level_thickness: f64,
    /// Fewer levels may be a part's own planes. Source: chosen.
    /// Halved or doubled: same bytes.
    pub levels: usize,
    /// Half of the points at least lie on levels that hold this many: points of a clean slanted sheet are
    /// each a level of their own, and near a camera there are many steps with few points. Source: chosen.
    /// Halved or doubled: same bytes.
    pub points_a_level: usize,
    /// Steps above and below a level that say how large the usual step is. Source: chosen.
    /// Halved or doubled: same bytes.
    pub steps_around: usize,
    /// Radius, in steps, of the neighbourhoods that say how noisy stepped depth is. Source: measured on a
    /// simulated depth camera that errs by 0.4 steps before it rounds, from 2 to 6 steps: the residuals have
    /// 0.9, 0.97, 0.98 and 1 of the true noise on walls, and 1, 1, 1.02 and 1.04 on the floor; the command
    /// is not on record.
    pub steps_across: f64,
    /// But at least so many points. Source: chosen, 22 degrees of freedom.
    pub points_across: usize,
    /// Steps narrower than this share of the spacing are seen by the usual neighbourhoods: the least, 1.9
    /// spacings to each side, spans eight of them. Source: derived.
    pub step_seen: f64,
    /// A surface slants whose cosine with the steps' direction lies between these. Source: derived, where the
    /// tangent is half a neighbourhood spans three planes; of a surface along it, a tenth of a step is none.
    pub slants: (f64, f64),
    /// What is this many standard deviations from a place's plane lies on another surface. Source: derived,
    /// one in 370 of a normal distribution lies farther.
    pub on_place: f64,
    /// Planes are from rounding where quadrics across several leave more than this share of what rounding
    /// alone would. In (0, 1). Source: chosen, between 0 and 1.
    pub rounded: f64,
    /// Times the noise may be corrected by charts. Source: chosen.
    /// Halved or doubled: same bytes.
    pub rounds: usize,
    /// The noise stands when the charts see at least this share of it: where it varies over the scan, the
    /// calmer charts always see less. Source: chosen.
    /// Halved: same bytes; doubled: points 1.12 (plate 2.07), acc 1.14 (plate 2.33), com 1.14 (plate 3.45).
    pub confirmed: f64,
    /// The quantile of the charts' own noise that is taken: it sees the noise truly even where other charts
    /// hold two sheets unseen. In (0, 1). Source: chosen.
    /// Halved: points 1.14 (plate 2.25), acc 1.16 (plate 2.39), com 1.22 (plate 3.38); doubled: points 0.92
    /// (plate 0.59), acc 0.94 (plate 0.67), com 0.95 (plate 0.71).
    pub quantile: f64,
    /// Charts are cut and fitted as if there were noise of at least this share of the point spacing: what is
    /// smaller than that between the points is not known anyway, and patches that had to explain a clean
    /// scan's every crease to the last digit would shrink to nothing there. Source: chosen.
    /// Halved or doubled: same bytes.
    pub floor: f64,
    /// Noise of at least this share of the point spacing is assumed where a scan has none. Source: chosen,
    /// the order of f32's rounding (6e-8).
    /// Halved or doubled: same bytes.
    pub rounding: f64,
    /// Point spacing that is assumed at least (share of the scan's size), so that the two shares above are
    /// never zero. Source: chosen, far below any scan's.
    /// Halved or doubled: same bytes.
    pub least_spacing: f64,
}

/// Their values.
pub(crate) const NOISE: NoiseConstants = NoiseConstants {
    trials: 250,
    half_accepted_below: 0.92,
    half_accepted_above: 0.72,
    guess_step: 1.35,
    samples: 1500,
    wider: 1.75,
    widest: 1.0 / 16.0,
    largest: 8192,
    samples_wider: 250,
    together: 64,
    grows: 0.25,
    most: 1.2,
    calm: 0.5,
    follows: 1.5,
    scales: [(11, 0.93), (16, 0.96), (28, 0.98), (48, 0.99), (84, 1.0), (148, 1.0), (260, 1.0)],
    flat: 0.6,
    planes: 250,
    coplanar_among: 20,
    coplanar: 5,
    slender: 0.1,
    widened: 16,
    widenings: 12,
    flat_share: 0.1,
    agreeing: 3.0,
    at_ends: 0.5,
    on_grid: 0.75,
    apart_among: 5,
    level_width: 1.2,
    levels_with_ends: 8,
    without_levels: 3,
    one_step: 1.5,
    along: 0.9999,
    level_thickness: 2e-6,
    levels: 16,
    points_a_level: 20,
    steps_around: 4,
    steps_across: 3.0,
    points_across: 28,
    step_seen: 0.5,
    slants: (0.1, 0.9),
    on_place: 3.0,
    rounded: 0.5,
    rounds: 3,
    confirmed: 0.9,
    quantile: 0.3,
    floor: 0.05,
    rounding: 1e-7,
    least_spacing: 1e-9,
};
