//! How the two sides of walls and gaps face each other.
//!
//! In: charts. Out: relations of charts that oppose each other without sharing points.

use super::centers::{About, Center, Centers};
use super::constants::ORIENT;
use crate::atlas::{FittedChart, Foot, Monge, Relation};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::lists::Lists;

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

/// What is seen from the centre of a chart.
#[derive(Clone)]
struct Seen {
    relation: Relation,
    /// The chart that it is seen from.
    from: u32,
    /// The distance of the nearest sheet on that side.
    gap: f64,
}

/// Relations of opposing sheets, seen from the centre of each chart: the next sheet on either side faces the
/// other way, if it is parallel, nearer than a patch is wide, and not as near as misaligned sweeps. Where a
/// wall ends in a sharp rim, charts on its two sides share few points, and those say little; these relations
/// then tell how the one side is oriented to the other. A sheet that ends before our centre is the other part
/// of a step: it counts by how many of its points are there. A wall goes on: both charts count by how many of
/// those that share points with them (`shared`) see a sheet as near. Misaligned sweeps show one sheet twice
/// in places only.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn opposing_sheets(
    points: &[Vec3],
    fitted: &[FittedChart],
    shared: &[Relation],
    spacing: f64,
    centers: &Centers<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<Relation>> {
    let look = |a: &Center<'_>, about: &mut About<'_>, out: &mut Vec<Seen>| {
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
            out.extend(opposing.iter().filter(|x| sheet(x.distance * side)).map(|x| {
                let relation =
                    Relation { a: a.chart.min(x.chart), b: a.chart.max(x.chart), agreement: x.agreement };
                Seen { relation, from: a.chart, gap: next }
            }));
        }
    };
    let seen = centers.gather(look, ctx)?;
    let mut gap = vec![f64::INFINITY; fitted.len()];
    for seen in &seen {
        let gap = &mut gap[seen.from as usize];
        *gap = gap.min(seen.gap);
    }
    let ends: Vec<[u32; 2]> = shared.iter().map(|r| [r.a, r.b]).collect();
    let of_chart = Lists::new(fitted.len(), &ends, ctx)?;
    let goes_on = |chart: u32, wall: f64| {
        let (mut all, mut there) = (0.0, 0.0);
        for r in of_chart.of(chart).iter().map(|&k| &shared[k as usize]) {
            let other = if r.a == chart { r.b } else { r.a };
            all += r.agreement.abs();
            if gap[other as usize] < ORIENT.as_near * wall {
                there += r.agreement.abs();
            }
        }
        if all > 0.0 { there / all } else { 1.0 }
    };
    let weighed = |Seen { relation: r, gap, .. }: &Seen| Relation {
        agreement: r.agreement * goes_on(r.a, *gap).min(goes_on(r.b, *gap)),
        ..*r
    };
    Ok(seen.iter().map(weighed).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::atlas::Map;
    use crate::numeric::rng::Rng;

    /// What is said of the middle of a row of five charts and of the chart `gap` above it, where so many
    /// charts beside the middle have one above them.
    fn said(beside: i32, gap: f64) -> f64 {
        let mut rng = Rng::new(3);
        let (mut points, mut fitted) = (Vec::new(), Vec::new());
        let below = (-2..=2).map(|x| [2.0 * f64::from(x), 0.0]);
        let above = (-beside..=beside).map(|x| [2.0 * f64::from(x), gap]);
        for [x, z] in below.chain(above) {
            let first = points.len() as u32;
            points.extend(
                (0..200).map(|_| Vec3([x + 3.0 * (rng.uniform() - 0.5), 3.0 * (rng.uniform() - 0.5), z])),
            );
            let mut chart = FittedChart::flat(1.5, 0.01, first..points.len() as u32);
            if let Map::Monge(map) = &mut chart.chart.map {
                map.center = Vec3([x, 0.0, z]);
            }
            fitted.push(chart);
        }
        // Those beside each other share points.
        let above = 5..4 + 2 * beside as u32 + 1;
        let shared: Vec<Relation> =
            (0..4).chain(above).map(|a| Relation { a, b: a + 1, agreement: 50.0 }).collect();
        let found = Run::default().execute(|ctx| {
            let centers = Centers::of(&fitted, ctx)?;
            opposing_sheets(&points, &fitted, &shared, 0.1, &centers, ctx)
        });
        let middle = (2, 5 + beside as u32);
        found.unwrap().iter().filter(|r| (r.a, r.b) == middle).map(|r| r.agreement).sum()
    }

    #[test]
    fn a_wall_says_more_than_a_sheet_that_is_there_twice_in_one_place() {
        let wall = said(2, 0.5);
        assert!(wall < -0.1, "its sides face away from each other: {wall}");
        assert_eq!(said(0, 0.5), 0.0);
        assert_eq!(said(2, 2.0), 0.0, "farther than a patch is wide");
    }
}
