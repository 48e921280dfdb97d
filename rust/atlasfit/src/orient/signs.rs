//! A sign for each chart.
//!
//! In: how charts face each other, and how the scan votes on each. Out: a sign per chart, and the pairs of
//! overlapping charts whose relative orientation the signs contradict.

use super::connected::connected;
use super::constants::ORIENT;
use super::enclose::{self, Part, Said, Sheets, Surface};
use crate::atlas::{Chart, Pair, Relation, Vote};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::sets::SignedSets;
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

/// What is known of how charts face each other.
pub(crate) struct Relations<'a> {
    /// Of charts that share points.
    pub shared: &'a [Relation],
    /// Of opposing sheets.
    pub opposing: &'a [Relation],
    /// Of charts beside each other.
    pub beside: &'a [Relation],
}

/// Signs per chart from how they face each other, and the relations that the signs contradict. What the scan
/// knows of the charts' sides (`votes`, one per chart, or none) decides; else what the charts enclose has a
/// say.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn orient(
    relations: &Relations<'_>,
    votes: &[Vote],
    sheets: &Sheets<'_>,
    ctx: &Context<'_>,
) -> Result<Signs> {
    let charts = sheets.fitted.len();
    let Relations { shared, opposing, beside } = *relations;
    let touching = [shared, opposing].concat();
    let all = [&touching, beside].concat();
    let of_scan: Vec<(u32, f64)> = (0..).zip(votes.iter().map(|v| v.sum)).collect();
    let mut found = contract(charts, &all, &of_scan, ctx)?;
    let mut two_sided = vec![false; charts];
    if votes.iter().all(|v| v.sum == 0.0) {
        for c in enclose(&mut found, &touching, &all, sheets, ctx)? {
            two_sided[c as usize] = true;
        }
    }
    let signs = found.signs;
    let conflicts: Vec<Pair> = shared
        .iter()
        .filter(|r| {
            !two_sided[r.a as usize]
                && !two_sided[r.b as usize]
                && r.agreement.abs() > ORIENT.min_conflict
                && r.agreement * signs[r.a as usize] * signs[r.b as usize] < 0.0
        })
        .map(|r| (r.a, r.b))
        .collect();
    let sum = |it: &mut dyn Iterator<Item = &Relation>| it.map(|r| r.agreement.abs()).sum::<f64>();
    let against = sum(&mut shared.iter().filter(|r| conflicts.binary_search(&(r.a, r.b)).is_ok()));
    let one_sided = against > ORIENT.one_sided * sum(&mut shared.iter());
    ctx.check()?;
    Ok(Signs { of_chart: signs, conflicts: if one_sided { conflicts } else { Vec::new() } })
}

/// Signs that explain both how charts face each other and what they enclose, part by part. First the sets
/// that were joined are turned, each if that is likelier, from the largest to single charts: relations err
/// together at an acute edge, where charts of both sides share points. Then from signs follow votes, from
/// votes signs, as long as these are likelier. Last come viewers ([`turn_to_viewers`]). Parts are what
/// `touching` relations join. Returns the charts of what encloses a body.
fn enclose(
    found: &mut Contracted,
    touching: &[Relation],
    all: &[Relation],
    sheets: &Sheets<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let (found_parts, surface) = enclose::parts(sheets, touching, ctx)?;
    let sets = by_part(found.lesser_halves(), &found_parts, found.signs.len());
    let signs = &mut found.signs;
    let mut parts = Vec::new();
    for (part, sets) in found_parts.into_iter().zip(sets) {
        let mut said = part.said(signs);
        let (sheet, before) = (part.likelihood_of_sheet(&said), part.signs(signs));
        for _ in 0..ORIENT.turn_rounds {
            let before = part.likelihood(&said);
            for set in &sets {
                ctx.check()?;
                part.turn(set, signs, &mut said);
            }
            if part.likelihood(&said) <= before {
                break;
            }
        }
        // Sums of many turns, anew.
        said = part.said(signs);
        parts.push(Known { part, said, sheet, before, sets });
    }
    for _ in 0..ORIENT.turn_rounds {
        let votes: Vec<(u32, f64)> = parts.iter().flat_map(|k| k.part.votes(&k.said, signs)).collect();
        let mut next = contract(signs.len(), all, &votes, ctx)?.signs;
        let mut settled = true;
        for Known { part, said, .. } in &mut parts {
            ctx.check()?;
            let then = part.said(&mut next);
            if part.likelihood(&then) > part.likelihood(said) {
                part.take(&next, signs);
                *said = then;
                settled = false;
            }
        }
        if settled {
            break;
        }
    }
    turn_to_viewers(parts, &surface, signs, ctx)
}

/// A part, and what is known of it.
struct Known {
    part: Part,
    said: Said,
    /// The likelihood of the signs that it came with, if it is a sheet.
    sheet: f64,
    /// The signs that it came with.
    before: Vec<f64>,
    /// The sets that were joined, the largest first.
    sets: Vec<Vec<u32>>,
}

/// Turns what viewers likelier saw the other way round. A part that is likelier a sheet, which encloses
/// nothing, takes the signs that it came with, but for sets that face against the rest; they need not be
/// among those that were joined. In what encloses nothing sets that by themselves enclose a body, such as
/// what stands on the ground, are tried too. Returns the charts of what encloses a body.
fn turn_to_viewers(
    parts: Vec<Known>,
    surface: &Surface,
    signs: &mut [f64],
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let mut two_sided = Vec::new();
    let mut views = None;
    for Known { part, mut said, sheet, before, sets } in parts {
        let is_sheet = part.likelihood(&said) < sheet;
        if !is_sheet && part.encloses(&said) {
            two_sided.extend(part.charts());
            continue;
        }
        let views = match &mut views {
            Some(views) => views,
            none => none.insert(surface.views(ctx)?),
        };
        let large = sets.iter().filter(|set| set.len() >= ORIENT.least_part).take(ORIENT.turned_sets);
        if is_sheet {
            part.put(&before, signs);
            let turn = |set: &[u32], signs: &mut [f64]| {
                ctx.check()?;
                if part.faces_back(set, signs) {
                    part.turn_if_seen(set, views, signs);
                }
                Ok(())
            };
            large.clone().try_for_each(|set| turn(set, signs))?;
            part.facing_back(signs).iter().try_for_each(|set| turn(set, signs))?;
            said = part.said(signs);
        }
        if part.encloses(&said) {
            two_sided.extend(part.charts());
            continue;
        }
        for set in large {
            ctx.check()?;
            if part.is_body(set, signs) && part.turn_if_seen(set, views, signs) {
                two_sided.extend(set);
            }
        }
    }
    Ok(two_sided)
}

/// Cuts sets of charts into what each part has of them: for each part its sets, in order. `charts` is the
/// number of all charts.
fn by_part(sets: Vec<Vec<u32>>, parts: &[Part], charts: usize) -> Vec<Vec<Vec<u32>>> {
    let mut part_of = vec![usize::MAX; charts];
    for (k, part) in parts.iter().enumerate() {
        part.charts().iter().for_each(|&c| part_of[c as usize] = k);
    }
    let mut out = vec![Vec::new(); parts.len()];
    for set in sets {
        let mut of: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for c in set {
            of.entry(part_of[c as usize]).or_default().push(c);
        }
        of.remove(&usize::MAX);
        of.into_iter().for_each(|(part, set)| out[part].push(set));
    }
    out
}

/// Charts in sets, all charts of a set with signs that go together.
struct Contracted {
    /// A sign per chart.
    signs: Vec<f64>,
    /// The two sets that became one, for each join. The first sets are the charts and the right side, then
    /// come the joins.
    halves: Vec<[u32; 2]>,
}

impl Contracted {
    /// The charts of the lesser half of each join, ascending; the largest halves first.
    fn lesser_halves(&self) -> Vec<Vec<u32>> {
        let leaves = self.signs.len() + 1;
        let mut size = vec![1usize; leaves];
        for &[a, b] in &self.halves {
            size.push(size[a as usize] + size[b as usize]);
        }
        let mut lesser: Vec<u32> = self
            .halves
            .iter()
            .map(|&[a, b]| if size[a as usize] < size[b as usize] { a } else { b })
            .collect();
        lesser.sort_by_key(|&s| (std::cmp::Reverse(size[s as usize]), s));
        let charts = |set: u32| {
            let (mut out, mut open) = (Vec::new(), vec![set]);
            while let Some(s) = open.pop() {
                match (s as usize).checked_sub(leaves) {
                    Some(join) => open.extend(self.halves[join]),
                    None => out.push(s),
                }
            }
            out.sort_unstable();
            out
        };
        lesser.into_iter().map(charts).collect()
    }
}

/// A sign for each of `n` things from how they agree, and from what is known of their sides: votes on things
/// by number. Where nothing is said they keep theirs.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn agree(
    n: usize,
    relations: &[Relation],
    votes: &[(u32, f64)],
    ctx: &Context<'_>,
) -> Result<Vec<f64>> {
    Ok(contract(n, relations, votes, ctx)?.signs)
}

/// A sign per chart. Sets of charts are joined in the order of the agreement between them, all pairs of their
/// charts together: one strong pair may err, a hundred pairs rarely do. (Greedy additive contraction, as for
/// multicuts: Keuper et al. 2015.) What is known of the charts' sides (`votes`, charts with their agreement)
/// joins in as one more chart, which shows the right side.
fn contract(
    charts: usize,
    relations: &[Relation],
    votes: &[(u32, f64)],
    ctx: &Context<'_>,
) -> Result<Contracted> {
    let right_side = charts as u32;
    let voted = votes.iter().filter(|(_, vote)| *vote != 0.0);
    let voted: Vec<Relation> =
        voted.map(|&(a, agreement)| Relation { a, b: right_side, agreement }).collect();
    let mut links: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); charts + 1];
    let mut heap = BinaryHeap::with_capacity(relations.len());
    for r in relations.iter().chain(&voted) {
        *links[r.a as usize].entry(r.b).or_insert(0.0) += r.agreement;
        *links[r.b as usize].entry(r.a).or_insert(0.0) += r.agreement;
    }
    for (a, of) in links.iter().enumerate() {
        for (&b, &w) in of.range(a as u32 + 1..) {
            heap.push(Link::new(a as u32, b, w));
        }
    }
    let mut sets = SignedSets::new(charts + 1);
    let mut number: Vec<u32> = (0..=right_side).collect();
    let mut halves = Vec::new();
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
        halves.push([number[a as usize], number[b as usize]]);
        number[a as usize] = right_side + halves.len() as u32;
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
    let signs = (0..right_side).map(|c| if turned(sets.find(c)) { -1.0 } else { 1.0 }).collect();
    Ok(Contracted { signs, halves })
}

/// Which charts are to be turned so that they face the right side: connected charts together, as `side` (for
/// each chart how much speaks for the side that it faces, less how much does not; nothing where nothing is
/// known) says in sum.
pub(crate) fn to_turn(charts: usize, relations: &[Relation], side: &[f64]) -> Vec<bool> {
    let part = connected(charts, relations);
    let mut sum = vec![0.0; charts];
    part.iter().zip(side).for_each(|(&part, s)| sum[part as usize] += s);
    part.iter().map(|&part| sum[part as usize] < 0.0).collect()
}

/// Turns the charts to the side that the surface faces, see [`to_turn`]. Returns which charts were turned.
pub(crate) fn face(charts: &mut [Chart], relations: &[Relation], side: &[f64]) -> Vec<bool> {
    let turned = to_turn(charts.len(), relations, side);
    for (chart, _) in charts.iter_mut().zip(&turned).filter(|c| *c.1) {
        chart.sign = -chart.sign;
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connected_charts_turn_together_and_stay_where_nothing_is_known() {
        let relations = [Relation { a: 0, b: 1, agreement: 1.0 }];
        assert_eq!(to_turn(3, &relations, &[1.0, -2.0, 1.0]), [true, true, false]);
        assert_eq!(to_turn(3, &relations, &[]), [false; 3]);
    }

    /// Two sets of three charts that agree among themselves; one pair across says the opposite of what two
    /// weaker ones say.
    #[test]
    fn two_sets_follow_all_their_pairs_together_and_not_the_strongest() -> Result<()> {
        let all =
            [(0, 1, 10.0), (1, 2, 10.0), (3, 4, 10.0), (4, 5, 10.0), (0, 3, -3.0), (1, 4, 2.0), (2, 5, 2.0)];
        let relations = all.map(|(a, b, agreement)| Relation { a, b, agreement });
        let sign = |opposing: &[Relation]| {
            let all = [&relations, opposing].concat();
            crate::Run::default().execute(|ctx| Ok(contract(6, &all, &[], ctx)?.signs))
        };
        assert_eq!(sign(&[])?, [1.0; 6]);
        let across = Relation { a: 2, b: 3, agreement: -1.5 };
        assert_eq!(sign(&[across])?, [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
        Ok(())
    }
}
