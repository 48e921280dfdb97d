//! Parts, judged as wholes.
//!
//! In: the charts that stand, the evidence for each, which go on from each other. Out: parts stay whose
//! charts together speak for surface beyond doubt, by themselves or beside what else the scan has.

use super::charted::Charted;
use super::constants::STRAYS;
use super::groups::Shares;
use super::odds::{self, Group};
use super::overlaps::Overlap;
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
    let mut sets = Sets::new(stands.len());
    let both = |o: &&Overlap| stands[o.a as usize] && stands[o.b as usize];
    // A clump beside the surface shares points with it, but few of them say that both are one sheet.
    for o in overlaps.iter().filter(both).filter(|o| o.one > 0.0) {
        sets.join(o.a, o.b);
    }
    let part: Vec<usize> = (0..stands.len() as u32).map(|k| sets.find(k) as usize).collect();
    let shares = Shares::new(charted, stands, &vec![true; charted.cut.points.len()]);
    let mut total = vec![0.0; stands.len()];
    for (k, f) in charted.fitted.iter().enumerate().filter(|(k, _)| shares.points[*k] > 0.0) {
        total[part[k]] += evidence[k] * shares.of(k, f);
    }
    let is_sure = |k: usize| total[part[k]] > enough;
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
            doubtful.iter().map(|&p| Group { evidence: total[p], points: Vec::new() }).collect();
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
