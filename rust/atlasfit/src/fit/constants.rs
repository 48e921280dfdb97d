//! The numbers of fitting charts to patches: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`FIT`].
pub(crate) struct FitConstants {
    /// Points that one chart is fitted to at the most; of more, an even share takes part. Source: derived,
    /// 4096 points are 80 for each of a chart's 50 unknowns.
    /// Halved or doubled: same bytes.
    pub max_data: usize,
    /// The same in all rounds but the last, which only say where the feet and the strays are. Source:
    /// derived, ten for each unknown: the chart is then off by a third of the noise, and the feet by that
    /// times its slope.
    pub rough_data: usize,
    /// Rounds of foot points and solves. The third changes positions by less than a tenth of the noise.
    /// Source: chosen.
    /// Halved: points 1.06 (plate 1.34), acc 1.05 (plate 1.22), com 1.10 (plate 1.56); doubled: points 1.03
    /// (plate 1.20), acc 1.03 (plate 1.16), com 1.07 (plate 1.48).
    pub rounds: usize,
    /// Rounds of foot points and solves where a fitted chart is made smoother or rougher. Source: chosen; the
    /// feet begin on the chart as it was fitted.
    /// With `--denoise=--strength=2`, halved: points 1.01 (plate 1.06), acc 1.00 (plate 0.99), com 1.01
    /// (plate 1.07); doubled: acc 1.00 (facade2 1.02). With 8, halved: points 0.99 (plate 1.07), acc 0.99
    /// (box 0.98), com 0.98 (plate 0.86); doubled: acc 1.01 (facade1 1.04), com 0.99 (plate 0.86).
    pub refits: usize,
    /// The scan's noise level counts like this many points against a chart's own residuals: a chart of a
    /// hundred points may deviate where the noise really varies, a chart of ten may not. Source: chosen.
    /// Halved: points 1.06 (plate 1.43), acc 1.04 (plate 1.32), com 1.03 (plate 1.24); doubled: acc 1.02
    /// (plate 1.06), com 1.02 (plate 1.12).
    pub noise_strength: f64,
    /// What the robust weights leave of the noise, as a share: the standard deviation of a Gaussian of which
    /// each part counts as much as Tukey's biweight, with its end at [`crate::numeric::robust::TUKEY`]
    /// standard deviations, lets it. Source: derived, the root of E[w e^2] / E[w]; a test computes it.
    /// Halved: points 0.96 (plate 0.67), acc 0.98 (plate 0.64), com 0.92 (plate 0.66); doubled: points 1.22
    /// (mobius 1.76), acc 1.12 (mobius 1.49), com 1.13 (mobius 1.27).
    pub truncated: f64,
    /// Share of the smoothing bias that is taken out. In [0, 1]. The prior flattens bends the other way; with
    /// the whole correction convex shapes come out too small, with three eighths of it neither way. Source:
    /// measured by `atlasfit bench denoise` at its four noise levels.
    /// Halved: points 1.01 (plate 1.08), acc 1.02 (plate 1.10), com 1.03 (plate 1.20); doubled: points 1.04
    /// (plate 1.31), acc 1.10 (plate 1.79), com 1.19 (plate 2.75).
    pub sharpen: f64,
    /// Sheets closer than this many standard deviations of the noise cannot be told apart. Source: derived,
    /// two equal Gaussians have two modes beyond 2; the rest is margin.
    /// Halved: same bytes; doubled: points 1.17 (plate 2.56), acc 1.17 (plate 2.60), com 1.26 (plate 3.96).
    pub apart: f64,
    /// Each of two sheets must hold this share of the points. In (0, 0.5). Source: chosen.
    /// Halved: points 0.99 (plate 0.95); doubled: points 1.14 (plate 2.19), acc 1.19 (plate 2.86), com 1.28
    /// (plate 4.33).
    pub share: f64,
    /// Twice the gain in log likelihood that two sheets must bring. Source: derived, three more parameters
    /// bring 3 ln n = 18 by chance in a patch of four hundred points (Schwarz 1978); the rest is margin.
    /// Halved: points 0.99 (plate 0.93), acc 1.01 (plate 1.08); doubled: points 1.17 (plate 2.54), acc 1.16
    /// (plate 2.41), com 1.23 (plate 3.55).
    pub evidence: f64,
    /// Terms up to 2 of which the product does not overflow. Source: derived, the largest f64 is 2^1024.
    /// Changes the last bits only.
    /// Halved or doubled: same bytes.
    pub logs: usize,
    /// Fewer points do not tell two sheets from one rough one. Source: chosen.
    /// Halved: points 1.02 (plate 1.12), acc 1.05 (plate 1.33), com 1.12 (plate 1.97); doubled: points 1.15
    /// (plate 2.30), acc 1.16 (plate 2.41), com 1.23 (plate 3.52).
    pub least_points: usize,
    /// Rounds of expectation maximisation for the two Gaussians at the most. Source: chosen.
    /// Halved or doubled: same bytes.
    pub mixture_rounds: usize,
    /// The change of twice the log likelihood that ends them. Source: derived, far below `evidence`.
    /// Halved or doubled: no figure changes by 1 %.
    pub converged: f64,
    /// Each sheet's weights must add up to this share of the points in the end. In (0, 0.5). Source: chosen,
    /// half of `share`.
    /// Halved or doubled: same bytes.
    pub support: f64,
}

/// Their values.
pub(crate) const FIT: FitConstants = FitConstants {
    max_data: 4096,
    rough_data: 512,
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
