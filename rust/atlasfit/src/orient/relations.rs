//! How overlapping charts face each other over the points that they share.
//!
//! In: charts, and which of them each point belongs to. Out: the pairs that share points, with their
//! agreement.

use super::constants::ORIENT;
use crate::atlas::{FittedChart, Membership, Relation};
use crate::error::Result;
use crate::numeric::pairs::{self, PairOf};
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// A chart seen from one of its points.
#[derive(Clone, Copy)]
pub(super) struct ChartAtPoint {
    pub(super) chart: u32,
    /// Partition-of-unity weight times robust weight.
    weight: f64,
    pub(super) normal: Vec3,
    /// From the chart's surface to the point.
    pub(super) offset: Vec3,
    /// Noise of the chart.
    sigma: f64,
}

/// The charts of a point, the strongest first.
pub(super) fn charts_at(point: Vec3, row: &[(u32, f32)], fitted: &[FittedChart]) -> Vec<ChartAtPoint> {
    let mut at: Vec<ChartAtPoint> = row
        .iter()
        .filter_map(|&(c, w)| {
            let chart = &fitted[c as usize].chart;
            let view = chart.view(point)?;
            Some(ChartAtPoint {
                chart: c,
                weight: (view.weight + 1e-6) * f64::from(w),
                normal: view.normal,
                offset: view.normal * view.distance,
                sigma: chart.sigma,
            })
        })
        .collect();
    let top = (0..at.len()).max_by(|&x, &y| at[x].weight.total_cmp(&at[y].weight)).unwrap_or(0);
    if top != 0 {
        at.swap(0, top);
    }
    at
}

/// Finds the relations of all overlapping charts. Charts that lie apart where they overlap are opposing
/// sheets, the two sides of a wall or a gap, which face opposite ways.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn relations(
    points: &[Vec3],
    fitted: &[FittedChart],
    members: &Membership,
    spacing: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Relation>> {
    // Each point relates its strongest chart to its others: enough to connect what overlaps, linear in the
    // points. A share of them stands for all.
    let of_point = |i: usize| {
        let (row, stands_for) = members.compared(i);
        let at = charts_at(points[i], row, fitted);
        let head = at.first().copied();
        at.into_iter().skip(1).filter_map(move |b| {
            let a = head?;
            // Opposing sheets that share points face apart however alike their normals are.
            let gap = (b.offset - a.offset).norm() / (ORIENT.unsure * b.sigma.max(a.sigma)).max(spacing);
            let agree = b.normal.dot(a.normal) * b.weight.min(a.weight) * (1.0 - gap * gap).max(-1.0);
            let agree = f64::from(stands_for) * agree;
            Some(PairOf { a: b.chart.min(a.chart), b: b.chart.max(a.chart), values: [agree as f32] })
        })
    };
    let sums = pairs::sums(points.len(), of_point, ctx)?;
    Ok(sums.into_iter().map(|p| Relation { a: p.a, b: p.b, agreement: p.values[0] }).collect())
}
