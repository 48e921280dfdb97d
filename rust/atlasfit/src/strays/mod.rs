//! Which charts lie on surface, and which were laid through strays.
//!
//! In: points and fitted charts. Out: the charts that stand. A chart stands when its points speak for a sheet
//! beyond doubt, when it goes on from one that stands, or when what else there is speaks for it: a slab
//! thicker than the noise, or points as dense as the surface about them. What is left are strays.

pub(crate) mod constants;
mod density;
mod evidence;
mod overlaps;

use crate::atlas::{FittedChart, Map, Membership};
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::sets::Sets;
use constants::STRAYS;
use evidence::Sheet;
use overlaps::{Overlap, overlaps};
use rayon::prelude::*;

/// Points and the charts fitted to them.
pub(crate) struct Charted<'a> {
    /// The points.
    pub points: &'a [Vec3],
    /// Their search tree.
    pub tree: &'a Neighbours,
    /// Spacing at each.
    pub spacing: &'a [f32],
    /// Usual noise of the scan.
    pub sigma: f64,
    /// The noise at each point, as a multiple of the usual; empty where it is the same everywhere.
    pub relative: &'a [f32],
    /// The charts.
    pub fitted: &'a [FittedChart],
    /// Which charts each point belongs to.
    pub members: &'a Membership,
}

impl Charted<'_> {
    /// The scan's noise where a chart is.
    fn noise_of(&self, f: &FittedChart) -> f64 {
        let at = f.members.get(f.members.len() / 2).map_or(usize::MAX, |m| m.0 as usize);
        self.sigma * self.relative.get(at).map_or(1.0, |&r| f64::from(r))
    }
}

/// Whether each chart stands; all do where none has enough points to stand beyond doubt.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn standing(charted: &Charted<'_>, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let mut evidence = of_charts(charted, ctx)?;
    let enough = STRAYS.beyond_chance + (evidence.len().max(1) as f64).ln();
    let sure: Vec<bool> = evidence.iter().map(|&e| e > enough).collect();
    if !sure.contains(&true) {
        return Ok(vec![true; sure.len()]);
    }
    let overlaps = overlaps(charted.points, charted.fitted, charted.members, &sure, ctx)?;
    let mut stands = go_on(sure, &evidence, &overlaps);
    add_slabs(charted, &mut evidence, &mut stands, enough, ctx)?;
    add_dense(charted, &mut evidence, &mut stands, &overlaps, ctx)?;
    remove_doubtful_parts(charted, &evidence, &mut stands, &overlaps, enough);
    Ok(stands)
}

/// The evidence for each chart, in nats. Tubes have been judged when they were found.
fn of_charts(charted: &Charted<'_>, ctx: &Context<'_>) -> Result<Vec<f64>> {
    let Charted { points, tree, spacing, fitted, .. } = *charted;
    fitted
        .par_chunks(64)
        .map(|chunk| {
            ctx.check()?;
            let mut found = Vec::new();
            let of = |f: &FittedChart| match &f.chart.map {
                Map::Monge(map) => {
                    let spacing = median(
                        &mut f.members.iter().map(|m| f64::from(spacing[m.0 as usize])).collect::<Vec<_>>(),
                    );
                    let sheet = Sheet { map, sigma: f.chart.sigma, spacing };
                    evidence::of_sheet(points, tree, &sheet, &mut found)
                        - evidence::cost_of_noise(f.chart.sigma, charted.noise_of(f))
                }
                Map::Tube(_) => f64::INFINITY,
            };
            Ok(chunk.iter().map(of).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()
        .map(|v| v.concat())
}

/// Adds the charts that go on from those that stand, and those that go on from these, and so on: those against
/// which their own points do not speak.
fn go_on(mut stands: Vec<bool>, evidence: &[f64], overlaps: &[Overlap]) -> Vec<bool> {
    loop {
        let mut votes = vec![[0f32; 2]; stands.len()];
        for o in overlaps {
            for (from, to) in [(o.a as usize, o.b as usize), (o.b as usize, o.a as usize)] {
                if stands[from] && !stands[to] {
                    votes[to][0] += o.one;
                    votes[to][1] += o.apart;
                }
            }
        }
        let mut more = false;
        for ((stands, [one, apart]), evidence) in stands.iter_mut().zip(votes).zip(evidence) {
            if !*stands && *evidence > 0.0 && one >= STRAYS.shared && one > apart {
                *stands = true;
                more = true;
            }
        }
        if !more {
            return stands;
        }
    }
}

/// Which points lie on charts that stand.
fn explained(charted: &Charted<'_>, stands: &[bool]) -> Vec<bool> {
    let mut explained = vec![false; charted.points.len()];
    for (f, _) in charted.fitted.iter().zip(stands).filter(|(_, s)| **s) {
        f.members.iter().for_each(|m| explained[m.0 as usize] = true);
    }
    explained
}

/// Adds the charts about which the points that no other explains lie in a slab.
fn add_slabs(
    charted: &Charted<'_>,
    evidence: &mut [f64],
    stands: &mut [bool],
    enough: f64,
    ctx: &Context<'_>,
) -> Result<()> {
    let explained = explained(charted, stands);
    let left: Vec<Vec3> =
        charted.points.iter().zip(&explained).filter(|(_, e)| !**e).map(|(p, _)| *p).collect();
    if left.len() < PARTITION.min_members {
        return Ok(());
    }
    let tree = Neighbours::build(&left, ctx)?;
    let slabs: Vec<f64> = charted
        .fitted
        .par_iter()
        .zip(&*stands)
        .map(|(f, stands)| {
            ctx.check()?;
            let alone = f.members.iter().any(|m| !explained[m.0 as usize]);
            Ok(if *stands || !alone {
                f64::NEG_INFINITY
            } else {
                let place = f.chart.at([0.0; 2]).position;
                evidence::of_slab(&left, &tree, place, charted.noise_of(f), &mut Vec::new())
            })
        })
        .collect::<Result<_>>()?;
    for ((e, s), slab) in evidence.iter_mut().zip(stands).zip(slabs) {
        if slab > enough {
            *e = slab;
            *s = true;
        }
    }
    Ok(())
}

/// What the charts that do not stand have to themselves.
struct Alone {
    /// Points that lie on no chart that stands.
    points: Vec<u32>,
    /// For each point of the scan on how many charts it lies that do not stand.
    charts: Vec<u32>,
    /// For each chart how much of what it says is its own: points that others say the same of are shared, and
    /// those on charts that stand count for nothing.
    share: Vec<f64>,
    /// For each chart how many such points it has, shared alike.
    count: Vec<f64>,
}

fn alone(charted: &Charted<'_>, stands: &[bool]) -> Alone {
    let explained = explained(charted, stands);
    let mut charts = vec![0u32; charted.points.len()];
    for (f, _) in charted.fitted.iter().zip(stands).filter(|(_, s)| !**s) {
        f.members.iter().for_each(|m| charts[m.0 as usize] += 1);
    }
    let count: Vec<f64> = charted
        .fitted
        .iter()
        .zip(stands)
        .map(|(f, s)| {
            let own = |m: &(u32, f32)| !s && !explained[m.0 as usize];
            f.members.iter().filter(|m| own(m)).map(|m| 1.0 / f64::from(charts[m.0 as usize])).sum()
        })
        .collect();
    let share = charted.fitted.iter().zip(&count).map(|(f, c)| c / f.members.len().max(1) as f64).collect();
    let points = (0..explained.len() as u32).filter(|&i| !explained[i as usize]).collect();
    Alone { points, charts, share, count }
}

/// Adds groups of charts whose points are as dense as the surface about them, where that and the charts' own
/// evidence together speak for surface.
fn add_dense(
    charted: &Charted<'_>,
    evidence: &mut [f64],
    stands: &mut [bool],
    overlaps: &[Overlap],
    ctx: &Context<'_>,
) -> Result<()> {
    let alone = alone(charted, stands);
    let mut is_alone = vec![false; charted.points.len()];
    alone.points.iter().for_each(|&i| is_alone[i as usize] = true);
    let known: Vec<u32> = (0..charted.points.len() as u32).filter(|&i| !is_alone[i as usize]).collect();
    if alone.points.is_empty() || known.is_empty() {
        return Ok(());
    }
    // Before their density is looked at, points are surface or strays as those that are known.
    let prior = (known.len() as f64 / alone.points.len() as f64).ln();
    let dense = density::evidence(charted.points, charted.tree, &known, &alone.points, ctx)?;
    let mut at = vec![0.0; charted.points.len()];
    alone
        .points
        .iter()
        .zip(dense)
        .for_each(|(&i, d)| at[i as usize] = d / f64::from(alone.charts[i as usize].max(1)));
    let mut groups = Sets::new(stands.len());
    for o in overlaps.iter().filter(|o| !stands[o.a as usize] && !stands[o.b as usize]) {
        groups.join(o.a, o.b);
    }
    let (mut total, mut count) = (vec![0.0; stands.len()], vec![0.0; stands.len()]);
    for (k, f) in charted.fitted.iter().enumerate().filter(|(k, _)| alone.count[*k] > 0.0) {
        // Each distance to a neighbour is shared by as many points.
        let dense: f64 =
            f.members.iter().map(|m| at[m.0 as usize]).sum::<f64>() / (STRAYS.density_k + 1) as f64;
        evidence[k] = alone.share[k] * evidence[k] + dense;
        let group = groups.find(k as u32) as usize;
        total[group] += evidence[k];
        count[group] += alone.count[k];
    }
    for k in (0..stands.len()).filter(|&k| alone.count[k] > 0.0) {
        let group = groups.find(k as u32) as usize;
        stands[k] = total[group] + prior > 0.0 && count[group] >= PARTITION.min_members as f64;
    }
    Ok(())
}

/// Removes parts of which the charts together do not speak for surface beyond doubt.
fn remove_doubtful_parts(
    charted: &Charted<'_>,
    evidence: &[f64],
    stands: &mut [bool],
    overlaps: &[Overlap],
    enough: f64,
) {
    let mut parts = Sets::new(stands.len());
    for o in overlaps.iter().filter(|o| stands[o.a as usize] && stands[o.b as usize]) {
        parts.join(o.a, o.b);
    }
    let mut charts = vec![0u32; charted.points.len()];
    for (f, _) in charted.fitted.iter().zip(&*stands).filter(|(_, s)| **s) {
        f.members.iter().for_each(|m| charts[m.0 as usize] += 1);
    }
    let mut total = vec![0.0; stands.len()];
    for (k, f) in charted.fitted.iter().enumerate().filter(|(k, _)| stands[*k]) {
        let own: f64 = f.members.iter().map(|m| 1.0 / f64::from(charts[m.0 as usize])).sum();
        total[parts.find(k as u32) as usize] += evidence[k] * own / f.members.len().max(1) as f64;
    }
    for (k, stands) in stands.iter_mut().enumerate() {
        *stands &= total[parts.find(k as u32) as usize] > enough;
    }
}
