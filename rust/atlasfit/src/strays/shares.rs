//! How charts share points.
//!
//! In: charts, and which of them and of the points count. Out: for each point how many of the charts it lies
//! on, for each chart how many points are its own.

use super::charted::Charted;
use crate::atlas::FittedChart;

/// How some charts share some points.
pub(super) struct Shares {
    /// For each point on how many of the charts it lies.
    pub charts: Vec<u32>,
    /// For each chart how many of the points are its own, each divided by the charts that it lies on; 0 for
    /// the others.
    pub points: Vec<f64>,
}

impl Shares {
    /// Of the charts that `some` marks, and the points that `counts` marks.
    pub(super) fn new(charted: &Charted<'_>, some: &[bool], counts: &[bool]) -> Self {
        let mut charts = vec![0u32; counts.len()];
        for (f, _) in charted.fitted.iter().zip(some).filter(|(_, s)| **s) {
            f.members.iter().for_each(|m| charts[m.0 as usize] += 1);
        }
        let own = |f: &FittedChart| {
            let points = f.members.iter().map(|m| m.0 as usize).filter(|&m| counts[m]);
            points.map(|m| 1.0 / f64::from(charts[m])).sum()
        };
        let points = charted.fitted.iter().zip(some).map(|(f, s)| if *s { own(f) } else { 0.0 }).collect();
        Self { charts, points }
    }
    /// How much of what a chart says is its own: of its points, the share that no other says the same of.
    pub(super) fn of(&self, k: usize, f: &FittedChart) -> f64 {
        self.points[k] / f.members.len().max(1) as f64
    }
}
