//! The numbers of straightening: one place, each with its unit and where it is from.

/// The numbers, see [`STRAIGHT`].
pub(super) struct StraightConstants {
    /// Charts of more faces stay as they are: that takes seconds. Source: chosen, for speed.
    pub most_faces: usize,
    /// Largest scale at which corners are looked for, in shares of the border's length. Source: derived,
    /// half a side of a square.
    pub coarsest: f64,
    /// Number of scales, each half of the one before. Source: chosen; the last serves strips 120 times as
    /// long as wide.
    pub scales: usize,
    /// A corner turns by at least this, in radians (45 degrees). Source: derived, half of a right angle.
    pub least_turn: f64,
    /// And by at most this (135 degrees). Source: derived, as far beyond a right angle.
    pub most_turn: f64,
    /// Rounds of Newton steps, between which the rectangle takes the size of least energy. Source: chosen.
    pub rounds: usize,
    /// Newton steps of a round at most. Source: chosen.
    pub steps: usize,
    /// Steps end where one lowers the mean energy by less than this. Source: chosen, far below what the
    /// bound on the stretch sees.
    pub least: f64,
    /// A rectangle is given up where more than this many times the allowed area is stretched beyond the bound
    /// after the first round. Source: chosen.
    pub hope: f64,
    /// A border is followed within this distance by a polygon, in square roots of the chart's area. Source:
    /// chosen.
    pub off: f64,
    /// A side is straight that deviates from a line by at most this share of its length. Source: chosen.
    pub bent: f64,
    /// It is as long as this at least, in square roots of the chart's area. Source: chosen.
    pub long: f64,
    /// It runs along an axis that it is turned against by this at most, in radians (4 degrees). Source:
    /// chosen; straightening it shears the chart by as much.
    pub turned: f64,
    /// Share of a chart's border in such sides for which it is turned by quarters only. Source: chosen.
    pub share: f64,
    /// Steps of length in which a cut across a ring is measured, in square roots of its area: paths of equal
    /// length stay equal for a model that is turned. Source: chosen.
    pub grain: f64,
}

/// Their values.
pub(super) const STRAIGHT: StraightConstants = StraightConstants {
    most_faces: 50_000,
    coarsest: 0.125,
    scales: 7,
    least_turn: std::f64::consts::FRAC_PI_4,
    most_turn: 3.0 * std::f64::consts::FRAC_PI_4,
    rounds: 4,
    steps: 4,
    least: 1e-5,
    hope: 3.0,
    off: 0.02,
    bent: 0.03,
    long: 0.15,
    turned: 0.07,
    share: 0.5,
    grain: 1e-3,
};
