//! Groups of charts that are not sure, judged by their density too.
//!
//! In: charts, which stand, the evidence for each. Out: groups of the others whose points are as dense as the
//! surface about them stand too, where that, the charts' own evidence and where they lie together speak for
//! surface, and no clump explains the points better.

use super::charted::Charted;
use super::clumps;
use super::constants::STRAYS;
use super::density;
use super::odds::{self, Group};
use super::overlaps::Overlap;
use super::shares::Shares;
use crate::error::Result;
use crate::partition::constants::PARTITION;
use crate::run::Context;
use crate::spatial::sets::Sets;
use rayon::prelude::*;

/// Adds groups of charts that wait, see the head of this file.
pub(super) fn add_dense(
    charted: &Charted<'_>,
    evidence: &mut [f64],
    stands: &mut [bool],
    overlaps: &[Overlap],
    ctx: &Context<'_>,
) -> Result<()> {
    let explained = charted.explained(stands);
    let (known, alone): (Vec<u32>, Vec<u32>) =
        (0..explained.len() as u32).partition(|&i| explained[i as usize]);
    let [waits, is_alone] = [&*stands, &explained].map(|v| v.iter().map(|x| !x).collect::<Vec<_>>());
    let shares = Shares::new(charted, &waits, &is_alone);
    // Points on no chart have nothing to add.
    let asked: Vec<u32> = alone.iter().copied().filter(|&i| shares.charts[i as usize] > 0).collect();
    if asked.is_empty() || known.is_empty() {
        return Ok(());
    }
    add_densities(charted, evidence, &shares, &known, &asked, ctx)?;
    let mut sets = Sets::new(stands.len());
    for o in overlaps.iter().filter(|o| waits[o.a as usize] && waits[o.b as usize]) {
        sets.join(o.a, o.b);
    }
    let group: Vec<usize> = (0..stands.len() as u32).map(|k| sets.find(k) as usize).collect();
    let mut groups = vec![Group::default(); stands.len()];
    let mut size = vec![0.0; stands.len()];
    for (k, f) in charted.fitted.iter().enumerate().filter(|(k, _)| shares.points[*k] > 0.0) {
        groups[group[k]].evidence += shares.of(k, f) * evidence[k];
        groups[group[k]].charts.push(k as u32);
        size[group[k]] += shares.points[k];
    }
    for &i in &asked {
        let first = charted.members.of(i as usize).iter().find(|m| waits[m.0 as usize]);
        if let Some(first) = first {
            groups[group[first.0 as usize]].points.push(i);
        }
    }
    let large: Vec<usize> = (0..groups.len()).filter(|&g| size[g] >= PARTITION.min_members as f64).collect();
    if large.is_empty() {
        return Ok(());
    }
    let mut candidates: Vec<Group> = large.iter().map(|&g| std::mem::take(&mut groups[g])).collect();
    clumps::judge(charted, &mut candidates, &shares, None, ctx)?;
    let lone: Vec<u32> = alone.into_iter().filter(|&i| shares.charts[i as usize] == 0).collect();
    let mut odds = vec![f64::NEG_INFINITY; stands.len()];
    let found = odds::of_groups(&charted.cut, &explained, &candidates, &lone, ctx)?;
    large.into_iter().zip(found).for_each(|(g, o)| odds[g] = o);
    for k in (0..stands.len()).filter(|&k| shares.points[k] > 0.0) {
        stands[k] = odds[group[k]] > 0.0;
    }
    Ok(())
}

/// Adds what the density of its points says to the evidence for each chart.
fn add_densities(
    charted: &Charted<'_>,
    evidence: &mut [f64],
    shares: &Shares,
    known: &[u32],
    asked: &[u32],
    ctx: &Context<'_>,
) -> Result<()> {
    let densities = density::relative(&charted.cut, known, asked, ctx)?;
    let mut at = vec![None; shares.charts.len()];
    asked.iter().zip(&densities.relative).for_each(|(&i, &r)| at[i as usize] = Some(r));
    // Each distance to a neighbour is shared by as many points.
    let counts = 1.0 / (STRAYS.density_k + 1) as f64;
    let waiting = charted.fitted.par_iter().zip(&shares.points).zip(evidence);
    waiting.filter(|((_, own), _)| **own > 0.0).try_for_each_init(Vec::new, |of_chart, ((f, _), e)| {
        ctx.check()?;
        of_chart.clear();
        of_chart.extend(f.members.iter().filter_map(|m| at[m.0 as usize]));
        *e += densities.evidence(of_chart, counts);
        Ok(())
    })
}
