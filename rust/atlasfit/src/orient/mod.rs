//! Which way each chart faces, and where that is impossible (one-sided surfaces).
//!
//! In: charts and the points that they share. Out: a sign per chart, and the pairs of overlapping charts
//! whose relative orientation is known (after Hoppe et al. 1992, with charts in place of points: a chart's
//! normal is far better known than a point's).

use crate::atlas::FittedChart;
use crate::atlas::Membership;
use crate::atlas::{Chart, Foot, Map, Monge};
use crate::atlas::{Pair, Relation};
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use crate::spatial::sets::{Sets, SignedSets};
use rayon::prelude::*;
use std::collections::{BTreeMap, BinaryHeap};

/// The sum of all agreement between two sets of charts, for the strongest to come first; the lesser root
/// first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Link {
    /// Bits of the absolute agreement: as numbers that are not negative, they are ordered as their bits.
    strength: u64,
    a: u32,
    b: u32,
}

impl Link {
    fn new(a: u32, b: u32, agreement: f64) -> Self {
        Self { strength: agreement.abs().to_bits(), a, b }
    }
}

/// Agreement (in points) below which a contradiction is chance: a stray chart, not a one-sided surface, whose
/// charts contradict each other over whole overlaps.
const MIN_CONFLICT: f64 = 1.0;

/// Share of all agreement that must be contradicted before a surface counts as one-sided. A Moebius strip
/// must be cut across its whole width, which takes one or two percent of its overlaps; stray charts
/// contradict in far fewer.
const ONE_SIDED: f64 = 0.004;

/// Charts so many standard deviations of the noise apart, or less than the point `spacing`, may be of one
/// sheet or of two: sweeps of a scanner that are misaligned lie as near, and face the same way.
const UNSURE: f64 = 1.8;

/// Finds the relations of all overlapping charts. Charts that lie apart where they overlap are the two sides
/// of a wall or a gap, which face opposite ways.
///
/// # Errors
/// Cancelled or out of time.
pub fn relations(
    points: &[Vec3],
    fitted: &[FittedChart],
    members: &Membership,
    spacing: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Relation>> {
    // Each point relates its strongest chart to its others: enough to connect what overlaps, linear in the
    // points.
    let of_point = |i: usize| {
        let row = members.of(i);
        let mut views: Vec<(u32, f64, Vec3, Vec3, f64)> = row
            .iter()
            .filter_map(|&(c, w)| {
                let chart: &Chart = &fitted[c as usize].chart;
                let view = chart.view(points[i])?;
                let foot = view.normal * view.distance;
                Some((c, (view.taper + 1e-6) * f64::from(w), view.normal, foot, chart.sigma))
            })
            .collect();
        let top = (0..views.len()).max_by(|&x, &y| views[x].1.total_cmp(&views[y].1)).unwrap_or(0);
        if top != 0 {
            views.swap(0, top);
        }
        let head = views.first().copied();
        views.into_iter().skip(1).filter_map(move |(c, w, n, f, s)| {
            let (c0, w0, n0, f0, s0) = head?;
            // Two sides of a wall that share points face apart however alike their normals are.
            let gap = (f - f0).norm() / (UNSURE * s.max(s0)).max(spacing);
            let agree = n.dot(n0) * w.min(w0) * (1.0 - gap * gap).max(-1.0);
            Some((c.min(c0), c.max(c0), agree as f32))
        })
    };
    let mut pairs: Vec<(u32, u32, f32)> = points
        .par_chunks(1024)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            Ok((c * 1024..c * 1024 + chunk.len()).flat_map(of_point).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    // The last key makes the order of the sums the same on every run.
    sort_by(&mut pairs, |x, y| (x.0, x.1).cmp(&(y.0, y.1)).then(x.2.total_cmp(&y.2)), ctx)?;
    let mut out: Vec<Relation> = Vec::new();
    for (i, (a, b, w)) in pairs.into_iter().enumerate() {
        if i % 65536 == 0 {
            ctx.check()?;
        }
        match out.last_mut() {
            Some(r) if r.a == a && r.b == b => r.agreement += f64::from(w),
            _ => out.push(Relation { a, b, agreement: f64::from(w) }),
        }
    }
    Ok(out)
}

/// Sheets closer than this many standard deviations may be one.
const ACROSS: f64 = 1.5;
/// Weight of a view across, in shared points.
const WALL: f64 = 0.3;
/// Sheets whose normals have a greater cosine are parallel.
const PARALLEL: f64 = 0.7;
/// Of the charts on one side, those up to this many standard deviations beyond the nearest are of the same
/// sheet.
const SAME_SHEET: f64 = 2.0;

/// Charts that face each other across a wall or a gap, seen from the centre of either: the next sheet on each
/// side faces the other way, if it is parallel, nearer than a patch is wide, and not as near as misaligned
/// sweeps. Where a wall ends in a sharp rim, charts on its sides share few points, and those say little; this
/// is then what is known of the one side's orientation to the other's.
///
/// # Errors
/// Cancelled or out of time.
pub fn opposing_sheets(fitted: &[FittedChart], spacing: f64, ctx: &Context<'_>) -> Result<Vec<Relation>> {
    let patches: Vec<(u32, &Monge)> = fitted
        .iter()
        .zip(0..)
        .filter_map(|(f, c)| match &f.chart.map {
            Map::Monge(m) => Some((c, m)),
            Map::Tube(_) => None,
        })
        .collect();
    if patches.is_empty() {
        return Ok(Vec::new());
    }
    let centers: Vec<Foot> = patches.iter().map(|(_, m)| m.at([0.0; 2])).collect();
    let at: Vec<Vec3> = centers.iter().map(|c| c.position).collect();
    let tree = Neighbours::build(&at, ctx)?;
    let views = |k: usize, found: &mut Vec<Neighbour>, out: &mut Vec<Relation>| {
        let ((a, map), center) = (patches[k], &centers[k]);
        let sigma = fitted[a as usize].chart.sigma;
        let reach = map.radii[0].min(map.radii[1]);
        tree.within(center.position, 3.0 * reach, found);
        // Charts across, with their distance along our normal.
        let across: Vec<(f64, u32, f64)> = found
            .iter()
            .filter_map(|f| {
                let b = patches[f.index as usize].0;
                let v = fitted[b as usize].chart.view(center.position)?;
                let turn = v.normal.dot(center.normal);
                let far = ((ACROSS * sigma).max(spacing)..reach).contains(&v.distance.abs());
                (far && turn.abs() > PARALLEL && v.taper > 0.0 && v.mask >= 0.5).then_some((
                    -v.distance * turn.signum(),
                    b,
                    -WALL * turn * v.taper,
                ))
            })
            .collect();
        for side in [1.0, -1.0] {
            let next = across.iter().map(|x| x.0 * side).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
            let sheet = |d: f64| d > 0.0 && d < next + SAME_SHEET * sigma;
            out.extend(across.iter().filter(|x| sheet(x.0 * side)).map(|&(_, b, agreement)| Relation {
                a: a.min(b),
                b: a.max(b),
                agreement,
            }));
        }
    };
    let order: Vec<usize> = (0..patches.len()).collect();
    let chunks = order
        .par_chunks(64)
        .map(|chunk| {
            ctx.check()?;
            let (mut found, mut out) = (Vec::new(), Vec::new());
            chunk.iter().for_each(|&k| views(k, &mut found, &mut out));
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(chunks.concat())
}

/// Which way each chart faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Signs {
    /// +1 or -1 for each chart.
    pub of_chart: Vec<f64>,
    /// Relations that the signs contradict, where the surface is one-sided.
    pub conflicts: Vec<Pair>,
}

/// Signs per chart from the relations and from what is known of walls, and the relations that the signs
/// contradict. Sets of charts are joined in the order of the agreement between them, all pairs of their
/// charts together: one strong pair may err, a hundred pairs rarely do. (Greedy additive contraction, as for
/// multicuts: Keuper et al. 2015.)
///
/// # Errors
/// Cancelled or out of time.
pub fn orient(
    charts: usize,
    relations: &[Relation],
    opposing: &[Relation],
    ctx: &Context<'_>,
) -> Result<Signs> {
    let mut links: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); charts];
    let mut heap = BinaryHeap::with_capacity(relations.len());
    for r in relations.iter().chain(opposing) {
        *links[r.a as usize].entry(r.b).or_insert(0.0) += r.agreement;
        *links[r.b as usize].entry(r.a).or_insert(0.0) += r.agreement;
    }
    for (a, of) in links.iter().enumerate() {
        for (&b, &w) in of.range(a as u32 + 1..) {
            heap.push(Link::new(a as u32, b, w));
        }
    }
    let mut sets = SignedSets::new(charts);
    let mut steps = 0;
    while let Some(link) = heap.pop() {
        steps += 1;
        if steps % 1024 == 0 {
            ctx.check()?;
        }
        let (a, b) = (link.a, link.b);
        // Links of sets that are gone, or have changed since.
        let Some(&agreement) = links[a as usize].get(&b) else { continue };
        if agreement.abs().to_bits() != link.strength {
            continue;
        }
        sets.join(a, b, agreement < 0.0);
        links[a as usize].remove(&b);
        for (k, w) in std::mem::take(&mut links[b as usize]) {
            if k == a {
                continue;
            }
            let w = if agreement < 0.0 { -w } else { w };
            let of_k = &mut links[k as usize];
            of_k.remove(&b);
            let sum = of_k.entry(a).or_insert(0.0);
            *sum += w;
            let sum = *sum;
            links[a as usize].insert(k, sum);
            heap.push(Link::new(a.min(k), a.max(k), sum));
        }
    }
    let signs: Vec<f64> = (0..charts as u32).map(|c| if sets.find(c).1 { -1.0 } else { 1.0 }).collect();
    let conflicts: Vec<Pair> = relations
        .iter()
        .filter(|r| {
            r.agreement.abs() > MIN_CONFLICT && r.agreement * signs[r.a as usize] * signs[r.b as usize] < 0.0
        })
        .map(|r| (r.a, r.b))
        .collect();
    let sum = |it: &mut dyn Iterator<Item = &Relation>| it.map(|r| r.agreement.abs()).sum::<f64>();
    let against = sum(&mut relations.iter().filter(|r| conflicts.binary_search(&(r.a, r.b)).is_ok()));
    let one_sided = against > ONE_SIDED * sum(&mut relations.iter());
    ctx.check()?;
    Ok(Signs { of_chart: signs, conflicts: if one_sided { conflicts } else { Vec::new() } })
}

/// Turns the charts to the side that the surface faces. Connected charts turn together, as `side` (for each
/// chart how much of the surface agrees with its normal, less how much does not) says in sum. Returns which
/// charts were turned.
pub fn face(charts: &mut [Chart], relations: &[Relation], side: &[f64]) -> Vec<bool> {
    let mut sets = Sets::new(charts.len());
    relations.iter().for_each(|r| sets.join(r.a, r.b));
    let mut sum = vec![0.0; charts.len()];
    for (c, s) in side.iter().enumerate() {
        sum[sets.find(c as u32) as usize] += s;
    }
    let mut turned = vec![false; charts.len()];
    for (c, chart) in charts.iter_mut().enumerate() {
        if sum[sets.find(c as u32) as usize] < 0.0 {
            chart.sign = -chart.sign;
            turned[c] = true;
        }
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sets of three charts that agree among themselves; one pair across says the opposite of what two
    /// weaker ones say.
    #[test]
    fn two_sets_follow_all_their_pairs_together_and_not_the_strongest() -> Result<()> {
        let all =
            [(0, 1, 10.0), (1, 2, 10.0), (3, 4, 10.0), (4, 5, 10.0), (0, 3, -3.0), (1, 4, 2.0), (2, 5, 2.0)];
        let relations = all.map(|(a, b, agreement)| Relation { a, b, agreement });
        let sign = |opposing: &[Relation]| {
            crate::Run::default().execute(|ctx| Ok(orient(6, &relations, opposing, ctx)?.of_chart))
        };
        assert_eq!(sign(&[])?, [1.0; 6]);
        let wall = Relation { a: 2, b: 3, agreement: -1.5 };
        assert_eq!(sign(&[wall])?, [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
        Ok(())
    }
}
