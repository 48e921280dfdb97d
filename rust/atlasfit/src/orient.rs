//! Which way each chart faces, and where that is impossible (one-sided surfaces).
//!
//! In: charts and the points that they share. Out: a sign per chart, and the pairs of overlapping charts whose relative
//! orientation is known. The signs follow a maximum spanning tree of the pairs, strongest agreement first (after Hoppe et al. 1992,
//! with charts in place of points: a chart's normal is far better known than a point's).

use crate::atlas::Chart;
use crate::error::Result;
use crate::fit::Fitted;
use crate::geometry::sort::sort_by;
use crate::geometry::vec3::{Vec3, dot};
use crate::measure::connect::{Sets, SignedSets};
use crate::project::Membership;
use crate::run::Context;
use rayon::prelude::*;

/// Two overlapping charts, `a` < `b`, and how much their normals agree over the points that they share: positive when they
/// face the same way, its size the number of points that say so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relation {
    /// First chart.
    pub a: u32,
    /// Second chart.
    pub b: u32,
    /// Signed agreement.
    pub agreement: f64,
}

/// Two overlapping charts, the first less than the second.
pub type Pair = (u32, u32);

/// Agreement (in points) below which a contradiction is chance: a stray chart, not a one-sided surface, whose charts contradict each other
/// over whole overlaps.
const MIN_CONFLICT: f64 = 1.0;

/// Share of all agreement that must be contradicted before a surface counts as one-sided. A Moebius strip must be cut across its whole width,
/// which takes one or two percent of its overlaps; stray charts contradict in far fewer.
const ONE_SIDED: f64 = 0.004;

/// Finds the relations of all overlapping charts.
///
/// # Errors
/// Cancelled or out of time.
pub fn relations(
    points: &[Vec3],
    fitted: &[Fitted],
    members: &Membership,
    ctx: &Context<'_>,
) -> Result<Vec<Relation>> {
    // Each point relates its strongest chart to its others: enough to connect what overlaps, linear in the points.
    let of_point = |i: usize| {
        let row = members.of(i);
        let mut views: Vec<(u32, f64, Vec3)> = row
            .iter()
            .map(|&(c, w)| {
                let chart: &Chart = &fitted[c as usize].chart;
                (c, (chart.weight(points[i]) + 1e-6) * f64::from(w), chart.normal_over(points[i]))
            })
            .collect();
        let top = (0..views.len()).max_by(|&x, &y| views[x].1.total_cmp(&views[y].1)).unwrap_or(0);
        if top != 0 {
            views.swap(0, top);
        }
        let head = views.first().copied();
        views.into_iter().skip(1).filter_map(move |(c, w, n)| {
            let (c0, w0, n0) = head?;
            let agree = dot(n, n0) * w.min(w0);
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

/// Signs per chart from the relations, and the relations that the signs contradict.
///
/// # Errors
/// Cancelled or out of time.
pub fn orient(charts: usize, relations: &[Relation], ctx: &Context<'_>) -> Result<(Vec<f64>, Vec<Pair>)> {
    let mut order: Vec<u32> = (0..relations.len() as u32).collect();
    let strongest_first = |&x: &u32, &y: &u32| {
        let (x, y) = (relations[x as usize], relations[y as usize]);
        y.agreement.abs().total_cmp(&x.agreement.abs()).then((x.a, x.b).cmp(&(y.a, y.b)))
    };
    sort_by(&mut order, strongest_first, ctx)?;
    let mut sets = SignedSets::new(charts);
    for &r in &order {
        let r = relations[r as usize];
        sets.join(r.a, r.b, r.agreement < 0.0);
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
    Ok((signs, if one_sided { conflicts } else { Vec::new() }))
}

/// Turns the charts to the side that the surface faces. Connected charts turn together, as `side` (for each chart how much of the surface agrees with
/// its normal, less how much does not) says in sum. Returns which charts were turned.
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
