//! Which charts go on from each other.
//!
//! In: charts, and which of them each point belongs to. Out: the pairs that share points, with how many of
//! these say that they are one sheet there and how many that they are not.

use super::charted::Charted;
use super::constants::STRAYS;
use crate::atlas::View;
use crate::error::Result;
use crate::numeric::pairs::{self, PairOf};
use crate::partition::Cut;
use crate::run::Context;

/// Two charts that share points, the first less than the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Overlap {
    pub a: u32,
    pub b: u32,
    /// Points at which they are one sheet, each with its robust weight.
    pub one: f64,
    /// Points at which they are not.
    pub apart: f64,
}

/// A chart seen from one of its points.
struct Seen {
    chart: u32,
    weight: f32,
    view: View,
    sigma: f64,
}

/// Pairs of charts that share points: each point's first chart of those that are `sure` with its other sure
/// ones, and every chart that is not with all others. A share of the points stands for all.
pub(super) fn overlaps(charted: &Charted<'_>, sure: &[bool], ctx: &Context<'_>) -> Result<Vec<Overlap>> {
    let Charted { cut: Cut { points, .. }, fitted, members } = *charted;
    let seen = |point: usize, row: &[(u32, f32)]| -> Vec<Seen> {
        row.iter()
            .filter_map(|&(chart, weight)| {
                let c = &fitted[chart as usize].chart;
                let view = c.view(points[point])?;
                (view.weight > 0.0).then_some(Seen { chart, weight, view, sigma: c.sigma })
            })
            .collect()
    };
    let of_point = |point: usize| -> Vec<PairOf<f32, 2>> {
        let (row, stands_for) = members.compared(point);
        let at = seen(point, row);
        let first = at.iter().position(|s| sure[s.chart as usize]);
        let mut out = Vec::new();
        for (j, b) in at.iter().enumerate() {
            for (i, a) in at[..j].iter().enumerate() {
                if !sure[a.chart as usize] || !sure[b.chart as usize] || Some(i) == first {
                    out.push(overlap(a, b, stands_for.into()));
                }
            }
        }
        out
    };
    let sums = pairs::sums(points.len(), of_point, ctx)?;
    Ok(sums.into_iter().map(|p| Overlap { a: p.a, b: p.b, one: p.values[0], apart: p.values[1] }).collect())
}

/// What one point says of two of its charts, for all that it stands for.
fn overlap(a: &Seen, b: &Seen, stands_for: f32) -> PairOf<f32, 2> {
    let gap = (a.view.normal * a.view.distance - b.view.normal * b.view.distance).norm();
    let one = a.view.normal.dot(b.view.normal).abs() > STRAYS.parallel
        && gap < STRAYS.together * a.sigma.max(b.sigma);
    let weight = a.weight.min(b.weight) * stands_for;
    let values = if one { [weight, 0.0] } else { [0.0, weight] };
    PairOf { a: a.chart.min(b.chart), b: a.chart.max(b.chart), values }
}
