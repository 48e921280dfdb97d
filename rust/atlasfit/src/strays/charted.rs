//! What strays are looked for in.

use crate::atlas::{FittedChart, Membership};
use crate::partition::Cut;

/// The charts fitted to a scan.
pub(crate) struct Charted<'a> {
    /// What they were cut from.
    pub cut: Cut<'a>,
    /// The charts.
    pub fitted: &'a [FittedChart],
    /// Which charts each point belongs to.
    pub members: &'a Membership,
}

impl Charted<'_> {
    /// The scan's noise where a chart is: at the middle one of its points.
    pub(super) fn noise_of(&self, f: &FittedChart) -> f64 {
        let middle = f.members.get(f.members.len() / 2).map_or(usize::MAX, |m| m.0 as usize);
        self.cut.sigma * self.cut.relative_noise(middle)
    }

    /// Which points lie on the charts that `stand`.
    pub(super) fn explained(&self, stand: &[bool]) -> Vec<bool> {
        let mut explained = vec![false; self.cut.points.len()];
        for (f, _) in self.fitted.iter().zip(stand).filter(|(_, s)| **s) {
            f.members.iter().for_each(|m| explained[m.0 as usize] = true);
        }
        explained
    }
}
