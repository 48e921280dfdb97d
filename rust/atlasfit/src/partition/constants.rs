//! The numbers of cutting a scan into patches: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.
//!
//! Lengths on a patch are shares of its half axes, unless another unit is named.

/// The numbers, see [`PARTITION`].
pub(crate) struct PartitionConstants {
    /// Radius that a patch may reach, in point spacings: pi 6^2 = 113 points. Sensible: 4 to 10. Source:
    /// measured, patches 15 % larger or smaller change the error of the points of `atlasfit bench denoise` by
    /// less than 2 % in the mean.
    pub patch_spacings: f64,
    /// No patch is cut for a spacing that is more than this times that of the points about its seed. Above 1.
    /// Source: chosen; a spacing is known from eight neighbours, with an error of a fifth.
    pub sparser: f64,
    /// The same in standard deviations of the noise, where that is more, so that averaging can beat the
    /// noise. Sensible: 4 to 12. Source: chosen.
    /// Halved: points 0.95 (plate 0.72), com 1.03 (plate 1.16); doubled: no figure changes by 1 %.
    pub patch_sigmas: f64,
    /// A point counts as covered by a patch when it lies within this share of the domain (of its radius):
    /// there the partition-of-unity weight of the patch, (1 - 0.72^2)^2 = 0.23, is still substantial. In (0,
    /// 1). Source: chosen.
    /// Halved: points 0.87 (plate 0.47), acc 0.85 (plate 0.51), com 0.82 (plate 0.30); doubled: points 1.00
    /// (plate 0.85), acc 0.98 (plate 0.74), com 0.95 (plate 0.61).
    pub core: f64,
    /// Rounds of seeding. Each round seeds what the previous ones left, more densely. At least 1. Source:
    /// chosen.
    /// Halved: points 1.03 (plate 1.22), acc 1.01 (plate 1.15), com 1.04 (plate 1.24); doubled: acc 1.02
    /// (plate 1.12), com 1.04 (plate 1.29).
    pub rounds: usize,
    /// Distance between the seeds of the first round, as a share of the patches' reach. Sensible: below
    /// `core`, so that the covered parts overlap. Source: chosen.
    /// Halved: points 0.96 (plate 0.84), acc 0.99 (plate 1.12), com 1.03 (plate 1.29); doubled: points 0.98
    /// (plate 0.88), acc 1.03 (plate 1.13), com 1.04 (plate 1.18).
    pub first_distance: f64,
    /// What that distance is multiplied by from round to round. In (0, 1). Source: chosen.
    /// Halved: acc 1.03 (plate 1.24), com 1.05 (plate 1.34); doubled: points 1.01 (plate 1.08), acc 1.07
    /// (sphere 1.64), com 1.17 (plate 2.06).
    pub closer: f64,
    /// Patches smaller than this share of what they may reach wait until others are there. In [0, 1]. Source:
    /// chosen.
    /// Halved: points 0.96 (plate 0.80), acc 1.41 (sphere 6.14), com 1.08 (plate 1.32); doubled: points 1.01
    /// (plate 1.05), acc 0.97 (plate 0.84), com 0.99 (plate 0.89).
    pub small: f64,
    /// Patches that do not explain their points are used where at least this share of the points has no other
    /// patch. In [0, 1]. Source: chosen.
    /// Halved: points 0.98 (plate 0.91), acc 1.27 (sphere 5.33), com 0.95 (plate 0.73); doubled: points 0.97
    /// (plate 0.88), acc 0.97 (plate 0.78), com 0.91 (plate 0.56).
    pub alone: f64,
    /// Patches of a sample that the noise is learned from. Source: chosen.
    /// Halved: points 0.94 (plate 0.69), acc 0.99 (plate 0.93); doubled: points 0.98 (plate 0.87), acc 0.96
    /// (plate 0.77), com 0.93 (plate 0.63).
    pub sample: usize,
    /// Points that face each other are of different sheets if this many standard deviations of the noise, at
    /// least, lie between them. Sensible: 0.5 to 3. Source: chosen.
    /// Halved: points 0.97 (plate 0.84), acc 1.01 (plate 1.10), com 1.04 (plate 1.26); doubled: acc 1.03
    /// (plate 1.18), com 1.04 (plate 1.29).
    pub between: f64,
    /// Largest curvature times radius on a domain. Has no unit; below 1. Source: derived, 0.75 keeps slopes
    /// of a circular arc below asin(0.75) = 49 degrees, so that heights over the base plane stay well
    /// conditioned.
    pub max_bend: f64,
    /// Prior deviation of a quadric's curved coefficients, in patch radii: surfaces that bend by more than a
    /// third of the radius within it are rare, and without this a handful of noisy points looks like a spike.
    /// Source: chosen.
    /// Halved: points 1.03 (plate 1.17), acc 1.05 (plate 1.49), com 1.07 (plate 1.54); doubled: points 1.02
    /// (plate 1.15), acc 1.03 (plate 1.24), com 1.06 (plate 1.39).
    pub curved: f64,
    /// A narrow patch may become this many times longer than a round one. At least 1. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub max_lengthen: f64,
    /// Each step enlarges the patch by this factor: small enough that the quadric of one step predicts the
    /// next. Above 1. Source: chosen.
    /// Halved: points 1.40 (plate 2.58), acc 1.53 (mobius 2.45), com 1.43 (mobius 1.92); doubled: points 0.99
    /// (plate 0.89), acc 0.98 (plate 0.76), com 0.93 (plate 0.62).
    pub growth: f64,
    /// A patch that becomes narrower with each step moves its own limit, ever less far: it follows this many
    /// times at the most. Source: measured; ordinary ones stop moving, to the last digit, well before; some
    /// do not in a million steps.
    pub most_followed: usize,
    /// Of more points than this an even share decides how far a patch reaches: clumps hold a hundred
    /// thousand, and a few thousand tell as much (a residual's error is 1 / sqrt(2 n), 1 %). Source: derived.
    pub max_found: usize,
    /// A patch explains points whose residual is up to this many standard deviations of the noise. Above 1.
    /// Source: chosen.
    pub explained: f64,
    /// It also explains residuals up to this share of its smaller half axis: the chart's spline follows more
    /// than a quadric. Source: chosen.
    pub followed: f64,
    /// Fewer points than this carry no quadric. Source: derived, a quadric has six coefficients and one point
    /// must be left to contradict it.
    pub min_members: usize,
    /// Points up to this many radii from the centre take part in the fit, so that a chart's rim is not
    /// extrapolated. At least 1. Source: chosen.
    /// Halved: points 1.63 (mobius 4.15), acc 1.14 (sphere 1.86), com 38.55 (mobius 412.02), 1 of 6 scans
    /// fail; doubled: points 0.90 (plate 0.49), acc 0.88 (plate 0.40), com 0.83 (plate 0.30).
    pub rim: f64,
    /// In noisy parts more noise is tried in steps of this factor. Above 1. Source: chosen.
    /// Halved: no figure changes by 1 %, 4 of 6 scans fail; doubled: points 0.85 (plate 0.36), acc 0.84
    /// (plate 0.37), com 0.80 (plate 0.25).
    pub more_noise: f64,
    /// The most noise that is tried there, in point spacings: beyond it, two sheets of a thin wall would pass
    /// for one noisy one. Source: chosen.
    /// Halved: points 0.92 (plate 0.62), com 1.01 (plate 1.07); doubled: points 0.84 (plate 0.37), acc 0.84
    /// (plate 0.37), com 0.79 (plate 0.26).
    pub most_noise: f64,
    /// Seeds nearest to a place that say whether its part is noisy. Source: chosen.
    /// Halved: points 0.94 (plate 0.68), acc 0.96 (plate 0.80); doubled: points 0.93 (plate 0.68), acc 1.01
    /// (plate 1.16), com 1.04 (plate 1.28).
    pub asked: usize,
    /// How many of them must not be explained by the scan's noise. Source: derived, on even noise one in
    /// thirty is not, and two of six are in one place of sixty-five.
    pub unexplained: usize,
    /// A sheet farther from a patch than this many standard deviations of the noise ... Source: chosen, above
    /// the four where a point's weight ends (`numeric::robust::TUKEY`).
    /// Halved: acc 1.04 (plate 1.31), com 1.06 (plate 1.46); doubled: acc 0.98 (box 0.89).
    pub disturbing_sigmas: f64,
    /// ... plus this share of the patch's reach cannot keep it from growing. Source: chosen.
    /// Halved: com 1.03 (plate 1.18); doubled: acc 0.98 (box 0.89).
    pub disturbing_share: f64,
    /// Share of the points that lie on no sheet, where one sheet is compared with two. In (0, 1). Source:
    /// chosen.
    pub astray: f64,
    /// Two sheets are looked for within the patch's reach, and within so many smaller ones, each smaller by
    /// `growth`. Source: chosen.
    pub slab_sizes: usize,
    /// Steps of fitting two sheets, at the most. Source: chosen; it ends before.
    pub slab_steps: usize,
    /// They end when the distance changes by less than this, in standard deviations of the noise. Source:
    /// chosen, a hundredth of what matters.
    pub slab_end: f64,
    /// Steps of fitting one sheet that bends, its weights from the step before. Source: chosen.
    pub bent_steps: usize,
    /// A patch whose residual is below this many standard deviations of the noise holds points of one sheet.
    /// Source: derived, halfway between one sheet, 1, and two that are `slab_apart` apart, the root of 2.
    pub one_sheet: f64,
    /// Two sheets nearer than this many standard deviations of the noise are one. Source: derived, up to 2
    /// two equal Gaussians have one mode.
    pub slab_apart: f64,
    /// What two sheets must explain better than their rivals, in nats. Source: derived, ln(1000) + 3: beyond
    /// chance (1 in 20) among a thousand seeds.
    pub slab_gain: f64,
    /// Sheets within each other's noise are copies of one surface when the cosine between their normals is
    /// greater. Source: chosen (46 degrees, as `ORIENT.parallel`).
    pub copy_turn: f64,
    /// Height, in units of the scan's size, of a point that only fills a vector: it has no weight in any fit,
    /// and its square does not overflow. Source: derived, the square root of the largest f64 is 1e154.
    pub no_weight_height: f64,
}

/// Their values.
pub(crate) const PARTITION: PartitionConstants = PartitionConstants {
    patch_spacings: 6.0,
    sparser: 2.0,
    patch_sigmas: 7.0,
    core: 0.72,
    rounds: 5,
    first_distance: 0.62,
    closer: 0.6,
    small: 0.4,
    alone: 0.25,
    sample: 100,
    between: 1.0,
    max_bend: 0.75,
    curved: 0.35,
    max_lengthen: 2.5,
    growth: 1.3,
    most_followed: 64,
    max_found: 4096,
    explained: 1.35,
    followed: 0.06,
    min_members: 7,
    rim: 1.1,
    more_noise: 1.6,
    most_noise: 0.6,
    asked: 6,
    unexplained: 2,
    disturbing_sigmas: 6.0,
    disturbing_share: 0.15,
    astray: 0.02,
    slab_sizes: 4,
    slab_steps: 20,
    slab_end: 0.01,
    bent_steps: 5,
    one_sheet: 1.2,
    slab_apart: 2.0,
    slab_gain: 10.0,
    copy_turn: 0.7,
    no_weight_height: 1e150,
};
