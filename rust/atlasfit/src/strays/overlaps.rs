//! Which charts go on from each other.
//!
//! In: charts, and which of them each point belongs to. Out: the pairs that share points, with how many of
//! these say that they are one sheet there and how many that they are not.

use super::constants::STRAYS;
use crate::atlas::{FittedChart, Membership, View};
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Two charts that share points, the first less than the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Overlap {
    pub a: u32,
    pub b: u32,
    /// Points at which they are one sheet, each with its robust weight.
    pub one: f32,
    /// Points at which they are not.
    pub apart: f32,
}

/// A chart seen from one of its points.
struct Seen {
    chart: u32,
    weight: f32,
    view: View,
    sigma: f64,
}

/// Pairs of charts that share points: each point's first chart of those that are `sure` with its other sure
/// ones, and every chart that is not with all others.
pub(super) fn overlaps(
    points: &[Vec3],
    fitted: &[FittedChart],
    members: &Membership,
    sure: &[bool],
    ctx: &Context<'_>,
) -> Result<Vec<Overlap>> {
    let seen = |point: usize| -> Vec<Seen> {
        members
            .of(point)
            .iter()
            .filter_map(|&(chart, weight)| {
                let c = &fitted[chart as usize].chart;
                let view = c.view(points[point])?;
                (view.weight > 0.0).then_some(Seen { chart, weight, view, sigma: c.sigma })
            })
            .collect()
    };
    let of_point = |point: usize| -> Vec<Overlap> {
        let at = seen(point);
        let first = at.iter().position(|s| sure[s.chart as usize]);
        let mut out = Vec::new();
        for (j, b) in at.iter().enumerate() {
            for (i, a) in at[..j].iter().enumerate() {
                if !sure[a.chart as usize] || !sure[b.chart as usize] || Some(i) == first {
                    out.push(overlap(a, b));
                }
            }
        }
        out
    };
    let mut pairs = points
        .par_chunks(1024)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            Ok((c * 1024..c * 1024 + chunk.len()).flat_map(of_point).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    // The last keys make the order of the sums the same on every run.
    let by = |x: &Overlap, y: &Overlap| {
        (x.a, x.b).cmp(&(y.a, y.b)).then(x.one.total_cmp(&y.one)).then(x.apart.total_cmp(&y.apart))
    };
    sort_by(&mut pairs, by, ctx)?;
    pairs.dedup_by(|next, sum| {
        let same = (next.a, next.b) == (sum.a, sum.b);
        if same {
            sum.one += next.one;
            sum.apart += next.apart;
        }
        same
    });
    Ok(pairs)
}

/// What one point says of two of its charts.
fn overlap(a: &Seen, b: &Seen) -> Overlap {
    let gap = (a.view.normal * a.view.distance - b.view.normal * b.view.distance).norm();
    let one = a.view.normal.dot(b.view.normal).abs() > STRAYS.parallel
        && gap < STRAYS.together * a.sigma.max(b.sigma);
    let weight = a.weight.min(b.weight);
    let (one, apart) = if one { (weight, 0.0) } else { (0.0, weight) };
    Overlap { a: a.chart.min(b.chart), b: a.chart.max(b.chart), one, apart }
}
