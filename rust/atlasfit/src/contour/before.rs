//! How parts of the surface that lie before each other face, such as the sides of a plate without rims.
//!
//! In: the surface and its parts, its charts, how they oppose each other. Out: relations between parts.

use super::constants::CONTOUR;
use super::facing::Component;
use super::surface::Surface;
use crate::atlas::{Chart, Relation};
use crate::error::Result;
use crate::orient::constants::ORIENT;
use crate::run::Context;
use std::collections::BTreeMap;

/// The part of a chart that none lies on.
const NO_PART: u32 = u32::MAX;

/// How open parts that lie before each other face, in nats: as the charts that they lie on oppose each other.
/// Each of two parts counts by the share of its charts that the other lies before. What is closed knows its
/// outside by itself.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn relations(
    s: &Surface,
    charts: &[Chart],
    opposing: &[Relation],
    parts: &[Component],
    ctx: &Context<'_>,
) -> Result<Vec<Relation>> {
    let part_of = parts_of_charts(s, charts.len(), parts, ctx)?;
    let mut size = vec![0u32; parts.len()];
    part_of.iter().for_each(|&k| size.get_mut(k as usize).into_iter().for_each(|n| *n += 1));
    // For each chart and each other part, the relation that says most.
    let mut most: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for (i, r) in opposing.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = [r.a, r.b].map(|c| part_of[c as usize]);
        let open = |k: u32| parts.get(k as usize).is_some_and(Component::is_open);
        if a == b || !open(a) || !open(b) {
            continue;
        }
        let says = r.agreement * charts[r.a as usize].sign * charts[r.b as usize].sign;
        for (chart, other) in [(r.a, b), (r.b, a)] {
            let known = most.entry((chart, other)).or_default();
            if says.abs() > known.abs() {
                *known = says;
            }
        }
    }
    let mut sums: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for ((chart, other), says) in most {
        let own = part_of[chart as usize];
        *sums.entry((own.min(other), own.max(other))).or_default() +=
            CONTOUR.goes_on * says / (ORIENT.counts * f64::from(size[own as usize]));
    }
    Ok(sums.into_iter().map(|((a, b), agreement)| Relation { a, b, agreement }).collect())
}

/// For each chart the part that has the most of it.
fn parts_of_charts(s: &Surface, charts: usize, parts: &[Component], ctx: &Context<'_>) -> Result<Vec<u32>> {
    let mut most = vec![(0u32, NO_PART); charts];
    let mut count = vec![0u32; charts];
    for (k, part) in (0..).zip(parts) {
        ctx.check()?;
        let on = || part.triangles.iter().map(|&t| s.chart[s.triangles[t as usize][0] as usize] as usize);
        on().for_each(|c| count.get_mut(c).into_iter().for_each(|n| *n += 1));
        for c in on().filter(|&c| c < charts) {
            most[c] = most[c].max((count[c], k));
            count[c] = 0;
        }
    }
    Ok(most.into_iter().map(|m| m.1).collect())
}
