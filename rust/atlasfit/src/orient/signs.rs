//! A sign for each chart.
//!
//! In: how charts face each other, and how the scan votes on each. Out: a sign per chart, and the pairs of
//! overlapping charts whose relative orientation the signs contradict.

use super::constants::ORIENT;
use crate::atlas::{Chart, Pair, Relation, Vote};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::sets::{Sets, SignedSets};
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

/// Which way each chart faces.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Signs {
    /// +1 or -1 for each chart.
    pub of_chart: Vec<f64>,
    /// Relations that the signs contradict, where the surface is one-sided.
    pub conflicts: Vec<Pair>,
}

/// Signs per chart from the relations and from what opposing sheets say, and the relations that the signs
/// contradict. Sets of charts are joined in the order of the agreement between them, all pairs of their
/// charts together: one strong pair may err, a hundred pairs rarely do. (Greedy additive contraction, as for
/// multicuts: Keuper et al. 2015.) What the scan knows of the charts' sides (`votes`, one per chart, or none)
/// joins in as one more chart, which shows the right side.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn orient(
    charts: usize,
    relations: &[Relation],
    opposing: &[Relation],
    votes: &[Vote],
    ctx: &Context<'_>,
) -> Result<Signs> {
    let right_side = charts as u32;
    let voted: Vec<Relation> = (votes.iter().zip(0..))
        .filter(|(v, _)| v.sum != 0.0)
        .map(|(v, chart)| Relation { a: chart, b: right_side, agreement: v.sum })
        .collect();
    let mut links: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); charts + 1];
    let mut heap = BinaryHeap::with_capacity(relations.len());
    for r in relations.iter().chain(opposing).chain(&voted) {
        *links[r.a as usize].entry(r.b).or_insert(0.0) += r.agreement;
        *links[r.b as usize].entry(r.a).or_insert(0.0) += r.agreement;
    }
    for (a, of) in links.iter().enumerate() {
        for (&b, &w) in of.range(a as u32 + 1..) {
            heap.push(Link::new(a as u32, b, w));
        }
    }
    let mut sets = SignedSets::new(charts + 1);
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
    // Sets that nothing was voted on keep the side of their first chart.
    let (right, wrong) = sets.find(right_side);
    let turned = |(root, turned): (u32, bool)| turned != (root == right && wrong);
    let signs: Vec<f64> = (0..right_side).map(|c| if turned(sets.find(c)) { -1.0 } else { 1.0 }).collect();
    let conflicts: Vec<Pair> = relations
        .iter()
        .filter(|r| {
            r.agreement.abs() > ORIENT.min_conflict
                && r.agreement * signs[r.a as usize] * signs[r.b as usize] < 0.0
        })
        .map(|r| (r.a, r.b))
        .collect();
    let sum = |it: &mut dyn Iterator<Item = &Relation>| it.map(|r| r.agreement.abs()).sum::<f64>();
    let against = sum(&mut relations.iter().filter(|r| conflicts.binary_search(&(r.a, r.b)).is_ok()));
    let one_sided = against > ORIENT.one_sided * sum(&mut relations.iter());
    ctx.check()?;
    Ok(Signs { of_chart: signs, conflicts: if one_sided { conflicts } else { Vec::new() } })
}

/// For each chart the first of the charts that it is connected with.
pub(crate) fn connected(charts: usize, relations: &[Relation]) -> Vec<u32> {
    let mut sets = Sets::new(charts);
    relations.iter().for_each(|r| sets.join(r.a, r.b));
    (0..charts as u32).map(|c| sets.find(c)).collect()
}

/// Turns the charts to the side that the surface faces. Connected charts turn together, as `side` (for each
/// chart how much of the surface agrees with its normal, less how much does not) says in sum. Returns which
/// charts were turned.
pub(crate) fn face(charts: &mut [Chart], relations: &[Relation], side: &[f64]) -> Vec<bool> {
    let part = connected(charts.len(), relations);
    let mut sum = vec![0.0; charts.len()];
    for (&part, s) in part.iter().zip(side) {
        sum[part as usize] += s;
    }
    let mut turned = vec![false; charts.len()];
    for (c, chart) in charts.iter_mut().enumerate() {
        if sum[part[c] as usize] < 0.0 {
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
            crate::Run::default().execute(|ctx| Ok(orient(6, &relations, opposing, &[], ctx)?.of_chart))
        };
        assert_eq!(sign(&[])?, [1.0; 6]);
        let across = Relation { a: 2, b: 3, agreement: -1.5 };
        assert_eq!(sign(&[across])?, [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
        Ok(())
    }
}
