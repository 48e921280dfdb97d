//! The numbers of estimating the noise: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.

/// The numbers, see [`NOISE`].
pub(crate) struct NoiseConstants {
    /// Seeds at which a guess of the noise is tried. Source: derived, the share that is found has an error of
    /// sqrt(1/4 / 250) = 3 %.
    pub trials: usize,
    /// Half of the patches can be grown at this share of the true noise where noise is below the point
    /// spacing. Source: measured on surfaces flat and finely detailed, thin and thick; the command is not on
    /// record.
    pub half_accepted_below: f64,
    /// The same where noise is as large as the spacing.
    pub half_accepted_above: f64,
    /// Factor between guesses. Above 1. Source: chosen.
    pub guess_step: f64,
    /// Points at which the noise is estimated. Source: derived, the median of this many has an error of a few
    /// percent.
    pub samples: usize,
    /// Neighbourhood sizes tried (points), each with the ratio of the median residual to the true noise on a
    /// plane. Source: sizes chosen, a factor 1.7 apart; ratios simulated (the median of a chi distribution
    /// with few degrees of freedom lies below its mean).
    pub scales: [(usize, f64); 7],
    /// A neighbourhood shows a surface when its thickness is below this share of its half width (ratio of the
    /// square roots of the two smaller principal variances). Source: chosen below the 0.7 to 0.8 that the
    /// ratio tends to on pure noise.
    pub flat: f64,
    /// A neighbourhood is flat to the last digit below this ratio of thickness to width. Source: derived, the
    /// rounding of single precision in a scan of a thousand spacings.
    pub exactly_flat: f64,
    /// Rounded scans have at least this share of such neighbourhoods. In (0, 1). Source: measured, 0.56 and
    /// more on depth cameras' rounding of one to four spacings; below that, neighbourhoods see the steps.
    pub flat_share: f64,
    /// Normals with a greater cosine are the same. Source: derived from `exactly_flat`.
    pub along: f64,
    /// Of those neighbourhoods this share must face along one direction. In (0, 1). Source: chosen; a part of
    /// clean planes has risers beside its treads.
    pub flat_along: f64,
    /// Points of one level differ by no more than this share of the extent. Source: derived, some ten times
    /// the rounding of single precision.
    pub level_thickness: f64,
    /// Fewer levels may be a part's own planes. Source: chosen.
    pub levels: usize,
    /// Levels hold at least this many points each, in the mean: points of a clean slanted sheet are each a
    /// level of their own. Source: chosen.
    pub points_a_level: usize,
    /// Steps above and below a level that say how large the usual step is. Source: chosen.
    pub steps_around: usize,
    /// Times the noise may be corrected by charts. Source: chosen.
    pub rounds: usize,
    /// The noise stands when the charts see at least this share of it: where it varies over the scan, the
    /// calmer charts always see less. Source: chosen.
    pub confirmed: f64,
    /// The quantile of the charts' own noise that is taken: it sees the noise truly even where other charts
    /// hold two sheets unseen. In (0, 1). Source: chosen.
    pub quantile: f64,
    /// Charts are cut and fitted as if there were noise of at least this share of the point spacing: what is
    /// smaller than that between the points is not known anyway, and patches that had to explain a clean
    /// scan's every crease to the last digit would shrink to nothing there. Source: chosen.
    pub floor: f64,
    /// Noise of at least this share of the point spacing is assumed where a scan has none. Source: chosen,
    /// the order of f32's rounding (6e-8).
    pub rounding: f64,
    /// Point spacing that is assumed at least (share of the scan's size), so that the two shares above are
    /// never zero. Source: chosen, far below any scan's.
    pub least_spacing: f64,
}

/// Their values.
pub(crate) const NOISE: NoiseConstants = NoiseConstants {
    trials: 250,
    half_accepted_below: 0.92,
    half_accepted_above: 0.72,
    guess_step: 1.35,
    samples: 1500,
    scales: [(11, 0.93), (16, 0.96), (28, 0.98), (48, 0.99), (84, 1.0), (148, 1.0), (260, 1.0)],
    flat: 0.6,
    exactly_flat: 1e-3,
    flat_share: 0.1,
    along: 0.9999,
    flat_along: 0.9,
    level_thickness: 2e-6,
    levels: 16,
    points_a_level: 20,
    steps_around: 4,
    rounds: 3,
    confirmed: 0.9,
    quantile: 0.3,
    floor: 0.05,
    rounding: 1e-7,
    least_spacing: 1e-9,
};
