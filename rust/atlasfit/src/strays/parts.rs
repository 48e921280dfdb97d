//! Parts, judged as wholes.
//!
//! In: the charts that stand, the evidence for each, which go on from each other. Out: parts stay whose
//! charts together speak for surface beyond doubt, by themselves or beside what else the scan has, and
//! explain their points better than clumps of strays do.

use super::charted::Charted;
use super::clumps;
use super::constants::STRAYS;
use super::odds::{self, Group};
use super::overlaps::Overlap;
use super::shares::Shares;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::sets::Sets;

/// Removes the parts that are doubtful. Those with `enough` evidence are not, wherever they lie.
pub(super) fn remove_doubtful(
    charted: &Charted<'_>,
    evidence: &[f64],
    stands: &mut [bool],
    overlaps: &[Overlap],
    enough: f64,
    ctx: &Context<'_>,
) -> Result<()> {
    let part = parts(stands, overlaps);
    let of_part = evidence_of_parts(charted, evidence, stands, &part, enough, ctx)?;
    let is_sure = |k: usize| of_part[part[k]] > enough;
    let sure: Vec<bool> = (0..stands.len()).map(|k| stands[k] && is_sure(k)).collect();
    let mut doubtful: Vec<usize> =
        (0..stands.len()).filter(|&k| stands[k] && !sure[k]).map(|k| part[k]).collect();
    doubtful.sort_unstable();
    doubtful.dedup();
    let mut stays = vec![false; stands.len()];
    if !doubtful.is_empty() && sure.contains(&true) {
        let known = charted.explained(&sure);
        let mut at = vec![usize::MAX; stands.len()];
        doubtful.iter().enumerate().for_each(|(n, &p)| at[p] = n);
        let mut groups: Vec<Group> =
            doubtful.iter().map(|&p| Group { evidence: of_part[p], ..Group::default() }).collect();
        let mut lone = Vec::new();
        for i in (0..known.len()).filter(|&i| !known[i]) {
            match charted.members.of(i).iter().find(|m| stands[m.0 as usize]) {
                Some(first) => groups[at[part[first.0 as usize]]].points.push(i as u32),
                None => lone.push(i as u32),
            }
        }
        let odds = odds::of_groups(&charted.cut, &known, &groups, &lone, ctx)?;
        doubtful.iter().zip(odds).for_each(|(&p, odds)| stays[p] = odds > STRAYS.beyond_chance);
    }
    for (k, stands) in stands.iter_mut().enumerate() {
        *stands &= sure[k] || stays[part[k]];
    }
    Ok(())
}

/// Removes the parts that are clumps, with the points about them that lie on no chart. Only where all of the
/// surface has its charts, for the others' points are such points too.
pub(super) fn remove_clumps(
    charted: &Charted<'_>,
    stands: &mut [bool],
    overlaps: &[Overlap],
    ctx: &Context<'_>,
) -> Result<()> {
    let part = parts(stands, overlaps);
    let (shares, mut groups) = as_groups(charted, |_| f64::INFINITY, stands, &part);
    let lone = |i: u32| charted.members.of(i as usize).is_empty();
    clumps::judge(charted, &mut groups, &shares, Some(&lone), ctx)?;
    let surface = |k: usize| groups[part[k]].evidence > 0.0;
    if (0..stands.len()).any(|k| stands[k] && surface(k)) {
        stands.iter_mut().enumerate().for_each(|(k, stands)| *stands &= surface(k));
    }
    Ok(())
}

/// Which part each chart is of that stands.
fn parts(stands: &[bool], overlaps: &[Overlap]) -> Vec<usize> {
    let mut sets = Sets::new(stands.len());
    let both = |o: &&Overlap| stands[o.a as usize] && stands[o.b as usize];
    // A clump beside the surface shares points with it, but few of them say that both are one sheet.
    for o in overlaps.iter().filter(both).filter(|o| o.one > 0.0) {
        sets.join(o.a, o.b);
    }
    (0..stands.len() as u32).map(|k| sets.find(k) as usize).collect()
}

/// The parts as groups, each with what the `evidence` for its charts says together, and how these share
/// points.
fn as_groups(
    charted: &Charted<'_>,
    evidence: impl Fn(usize) -> f64,
    stands: &[bool],
    part: &[usize],
) -> (Shares, Vec<Group>) {
    let points = charted.cut.points.len();
    let shares = Shares::new(charted, stands, &vec![true; points]);
    let mut groups = vec![Group::default(); stands.len()];
    for (k, f) in charted.fitted.iter().enumerate().filter(|(k, _)| shares.points[*k] > 0.0) {
        groups[part[k]].evidence += evidence(k) * shares.of(k, f);
        groups[part[k]].charts.push(k as u32);
    }
    for i in 0..points {
        if let Some(first) = charted.members.of(i).iter().find(|m| stands[m.0 as usize]) {
            groups[part[first.0 as usize]].points.push(i as u32);
        }
    }
    (shares, groups)
}

/// The evidence for each part: what its charts say together, no more than what rules out clumps. Where that
/// leaves no part with `enough`, there is nothing to know a clump by.
fn evidence_of_parts(
    charted: &Charted<'_>,
    evidence: &[f64],
    stands: &[bool],
    part: &[usize],
    enough: f64,
    ctx: &Context<'_>,
) -> Result<Vec<f64>> {
    let (shares, mut groups) = as_groups(charted, |k| evidence[k], stands, part);
    let alone: Vec<f64> = groups.iter().map(|g| g.evidence).collect();
    clumps::judge(charted, &mut groups, &shares, None, ctx)?;
    let beside: Vec<f64> = groups.iter().map(|g| g.evidence).collect();
    Ok(if beside.iter().any(|&e| e > enough) { beside } else { alone })
}
