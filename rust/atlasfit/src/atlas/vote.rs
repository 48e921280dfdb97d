//! How a scan's points vote on which way a chart faces.

/// Votes for a chart's side. A point's vote is between -1 and 1: the cosine between the chart's normal and
/// the direction that the point is known to face.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Vote {
    /// Sum of the votes.
    pub sum: f64,
    /// Sum of their squares.
    pub squares: f64,
}

/// Votes decide when their sum exceeds this many standard deviations of a sum of votes by chance.
const BEYOND_CHANCE: f64 = 3.0;

impl Vote {
    /// Adds one point's vote.
    pub fn add(&mut self, vote: f64) {
        self.sum += vote;
        self.squares += vote * vote;
    }
    /// Adds this share of the votes for a chart, whose normal is taken times `sign`.
    pub fn add_share(&mut self, of: &Self, share: f64, sign: f64) {
        self.sum += of.sum * share * sign;
        self.squares += of.squares * share;
    }
    /// Whether the votes say more than chance: 1 or -1; 0 where they do not.
    #[must_use]
    pub fn verdict(&self) -> f64 {
        let clear = self.sum.abs() > BEYOND_CHANCE * self.squares.sqrt();
        if clear { self.sum.signum() } else { 0.0 }
    }
}
