//! The numbers of fitting charts to patches: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of six scans, in brackets the scan that changes most. Measured by `tests/constants.py --count 3000
//! --no-uv`. The two sides of its plate are hard to tell apart at this size: small changes decide.

/// The numbers, see [`FIT`].
pub(crate) struct FitConstants {
    /// Points that one chart is fitted to at the most; of more, an even share takes part. Source: derived,
    /// 4096 points are 80 for each of a chart's 50 unknowns.
    pub max_data: usize,
    /// Rounds of foot points and solves. The third changes positions by less than a tenth of the noise.
    /// Source: chosen.
    /// Halved: points 1.02 (box 1.10), acc 1.04 (plate 1.32), com 1.07 (plate 1.41); doubled: points 0.97
    /// (plate 0.86), acc 1.00 (plate 1.08), com 1.03 (plate 1.19).
    pub rounds: usize,
    /// Rounds of foot points and solves where a fitted chart is made smoother or rougher. Source: chosen; the
    /// feet begin on the chart as it was fitted.
    pub refits: usize,
    /// The scan's noise level counts like this many points against a chart's own residuals: a chart of a
    /// hundred points may deviate where the noise really varies, a chart of ten may not. Source: chosen.
    /// Halved: points 0.99 (box 0.95), acc 1.01, com 1.02 (plate 1.13); doubled: points 0.93 (plate 0.66),
    /// acc 0.92 (plate 0.64), com 0.88 (plate 0.48).
    pub noise_strength: f64,
    /// What the robust weights leave of the noise, as a share: the standard deviation of a Gaussian of which
    /// each part counts as much as Tukey's biweight, with its end at [`crate::numeric::robust::TUKEY`]
    /// standard deviations, lets it. Source: derived, the root of E[w e^2] / E[w]; a test computes it.
    pub truncated: f64,
    /// Share of the smoothing bias that is taken out. In [0, 1]. The prior flattens bends the other way; with
    /// the whole correction convex shapes come out too small, with three eighths of it neither way. Source:
    /// measured by `atlasfit bench denoise` at its four noise levels.
    pub sharpen: f64,
    /// Sheets closer than this many standard deviations of the noise cannot be told apart. Source: derived,
    /// two equal Gaussians have two modes beyond 2; the rest is margin.
    pub apart: f64,
    /// Each of two sheets must hold this share of the points. In (0, 0.5). Source: chosen.
    /// Halved: acc 1.01; doubled: points 1.03 (plate 1.21), acc 1.03 (plate 1.16), com 1.05 (plate 1.31).
    pub share: f64,
    /// Twice the gain in log likelihood that two sheets must bring. Source: derived, three more parameters
    /// bring 3 ln n = 18 by chance in a patch of four hundred points (Schwarz 1978); the rest is margin.
    pub evidence: f64,
    /// Terms up to 2 of which the product does not overflow. Source: derived, the largest f64 is 2^1024.
    /// Changes the last bits only.
    pub logs: usize,
    /// Fewer points do not tell two sheets from one rough one. Source: chosen.
    /// Halved: points 0.98 (plate 0.90), com 1.03 (plate 1.18); doubled: points 1.04 (plate 1.29), acc 1.02
    /// (plate 1.15), com 1.03 (plate 1.21).
    pub least_points: usize,
    /// Rounds of expectation maximisation for the two Gaussians at the most. Source: chosen.
    /// Halved and doubled: same bytes.
    pub mixture_rounds: usize,
    /// The change of twice the log likelihood that ends them. Source: derived, far below `evidence`.
    pub converged: f64,
    /// Each sheet's weights must add up to this share of the points in the end. In (0, 0.5). Source: chosen,
    /// half of `share`.
    pub support: f64,
}

/// Their values.
pub(crate) const FIT: FitConstants = FitConstants {
    max_data: 4096,
    rounds: 3,
    refits: 2,
    noise_strength: 40.0,
    truncated: 0.878,
    sharpen: 0.37,
    apart: 2.3,
    share: 0.2,
    evidence: 24.0,
    logs: 512,
    least_points: 40,
    mixture_rounds: 40,
    converged: 1e-3,
    support: 0.1,
};
