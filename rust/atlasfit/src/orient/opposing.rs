//! How the two sides of walls and gaps face each other.
//!
//! In: charts. Out: relations of charts that oppose each other without sharing points.

use super::centers::{About, Center, Centers};
use super::constants::ORIENT;
use crate::atlas::{FittedChart, Foot, Monge, Relation};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// An opposing chart.
struct Opposing {
    chart: u32,
    /// Its distance along our normal.
    distance: f64,
    agreement: f64,
}

/// How densely a chart's points lie about a place on it, from 0, none, to 1, as elsewhere on the chart.
fn points_there(points: &[Vec3], chart: &FittedChart, map: &Monge, at: Vec3) -> f64 {
    let near2 = ORIENT.points_there * map.radii[0] * map.radii[1] / chart.members.len().max(1) as f64;
    let near = |m: &&(u32, f32)| points[m.0 as usize].dist2(at) < near2;
    let there = chart.members.iter().filter(near).count() as f64;
    (there / ORIENT.points_there).min(1.0)
}

/// Relations of opposing sheets, seen from the centre of each chart: the next sheet on either side faces the
/// other way, if it is parallel, nearer than a patch is wide, and not as near as misaligned sweeps. Where a
/// wall ends in a sharp rim, charts on its two sides share few points, and those say little; these relations
/// then tell how the one side is oriented to the other. A sheet that ends before our centre is the other part
/// of a step: it counts by how many of its points are there.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn opposing_sheets(
    points: &[Vec3],
    fitted: &[FittedChart],
    spacing: f64,
    centers: &Centers<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<Relation>> {
    let look = |a: &Center<'_>, about: &mut About<'_>, out: &mut Vec<Relation>| {
        let Foot { position, normal, .. } = a.foot;
        let sigma = fitted[a.chart as usize].chart.sigma;
        let reach = a.map.radii[0].min(a.map.radii[1]);
        let opposes = |b: &Center<'_>| {
            let other = &fitted[b.chart as usize];
            let v = other.chart.view(position)?;
            let turn = v.normal.dot(normal);
            let far = ((ORIENT.apart * sigma).max(spacing)..reach).contains(&v.distance.abs());
            if !far || turn.abs() <= ORIENT.parallel || v.weight <= 0.0 || v.mask < 0.5 {
                return None;
            }
            let there = points_there(points, other, b.map, position - v.normal * v.distance);
            Some(Opposing {
                chart: b.chart,
                distance: -v.distance * turn.signum(),
                agreement: -ORIENT.counts * turn * v.weight * there,
            })
        };
        let opposing: Vec<Opposing> = about.within(a, 3.0 * reach).filter_map(opposes).collect();
        for side in [1.0, -1.0] {
            let distances = opposing.iter().map(|x| x.distance * side);
            let next = distances.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
            let sheet = |d: f64| d > 0.0 && d < next + ORIENT.same_sheet * sigma;
            out.extend(opposing.iter().filter(|x| sheet(x.distance * side)).map(|x| Relation {
                a: a.chart.min(x.chart),
                b: a.chart.max(x.chart),
                agreement: x.agreement,
            }));
        }
    };
    centers.relations(look, ctx)
}
