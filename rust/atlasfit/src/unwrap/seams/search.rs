//! The search for short seams within a bound.
//!
//! In: a sheet. Out: layouts within the bound.

use super::constants::{LEAST_ENERGY, Plan, SEAMS};
use super::grow::grown;
use super::initial::first_cut;
use super::sheet::{Layout, Sheet};
use super::trim::trimmed;
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// Layouts within the bound, the shortest first. Cuts that are a little longer at first may end much shorter:
/// several searches are made.
pub(super) fn searched(sheet: &Sheet<'_>, bound: f64, ctx: &Context<'_>) -> Result<Vec<Layout>> {
    let starts = starts(sheet, ctx)?;
    let searches: Vec<(&Layout, Plan)> = match &starts[..] {
        [rough, flat, ..] => {
            std::iter::once((rough, SEAMS.plans[0])).chain(SEAMS.plans.map(|p| (flat, p))).collect()
        }
        [only] => SEAMS.plans.iter().map(|&p| (only, p)).collect(),
        [] => Vec::new(),
    };
    let found: Vec<Option<Layout>> = (searches.par_iter().with_max_len(1))
        .map(|&(start, plan)| within(sheet, start.clone(), plan, bound, ctx))
        .collect::<Result<_>>()?;
    let mut found: Vec<Layout> = found.into_iter().flatten().collect();
    let shorter_first = |found: &mut Vec<Layout>| found.sort_by(|a, b| a.length.total_cmp(&b.length));
    shorter_first(&mut found);
    found.truncate(SEAMS.kept);
    let mut found = (found.into_par_iter().with_max_len(1))
        .map(|l| shortened(sheet, l, bound, SEAMS.in_vain, ctx))
        .collect::<Result<_>>()?;
    shorter_first(&mut found);
    Ok(found)
}

/// Any cut that lowers the energy makes room for others to be closed: rounds of both, while they help.
pub(super) fn shortened(
    sheet: &Sheet<'_>,
    mut now: Layout,
    bound: f64,
    patience: usize,
    ctx: &Context<'_>,
) -> Result<Layout> {
    let mut in_vain = 0;
    let mut tried = FxHashSet::default();
    for &plan in SEAMS.plans.iter().cycle() {
        ctx.check()?;
        if in_vain == patience {
            break;
        }
        in_vain += 1;
        let Some(longer) = grown(sheet, &now, plan, LEAST_ENERGY, &mut tried, ctx)? else { continue };
        let other = trimmed(sheet, longer, bound, ctx)?;
        if other.length < now.length * (1.0 - SEAMS.shorter) {
            now = other;
            in_vain = 0;
            tried.clear();
        }
    }
    Ok(now)
}

/// The start with cuts to where the distortion is, and these closed as far as the bound allows. `None` where
/// no cut helps any more.
pub(super) fn within(
    sheet: &Sheet<'_>,
    start: Layout,
    plan: Plan,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Option<Layout>> {
    let mut now = start;
    for growths in 0.. {
        if now.energy <= bound {
            break;
        }
        if growths == SEAMS.most_cuts {
            return Ok(None);
        }
        let enough = now.energy - SEAMS.gain * (now.energy - LEAST_ENERGY);
        let mut next = None;
        for &plan in [plan].iter().chain(&SEAMS.plans) {
            next = grown(sheet, &now, plan, bound, &mut FxHashSet::default(), ctx)?
                .filter(|l| l.energy < enough);
            if next.is_some() {
                break;
            }
        }
        if next.is_none() {
            // Cuts may have jammed: laid out anew they do not lie as they came to lie.
            next = sheet.fresh(now.cut.clone(), ctx).filter(|l| l.energy < enough);
            ctx.check()?;
        }
        let Some(next) = next else { return Ok(None) };
        now = next;
    }
    trimmed(sheet, now, bound, ctx).map(Some)
}

/// First layouts that are not far from flat: a part with a small border, which would be drawn out of all
/// measure, is cut to its far ends before.
fn starts(sheet: &Sheet<'_>, ctx: &Context<'_>) -> Result<Vec<Layout>> {
    let mut cut = first_cut(sheet, ctx)?;
    let mut out: Vec<Layout> = Vec::new();
    let mut best: Option<Layout> = None;
    for _ in 0..SEAMS.first_cuts {
        let fresh = sheet.fresh(cut.clone(), ctx);
        ctx.check()?;
        if let Some(l) = fresh
            && best.as_ref().is_none_or(|b| l.energy < b.energy)
        {
            if l.energy < SEAMS.first_energy[out.len()] {
                out.push(l.clone());
            }
            best = Some(l);
            if out.len() == SEAMS.first_energy.len() {
                break;
            }
        }
        let (distance, by) = sheet.distances(&sheet.opened(&cut), ctx)?;
        let far = |best: u32, v: u32| if distance[v as usize] > distance[best as usize] { v } else { best };
        let end = (0..sheet.vertices() as u32).fold(0, far);
        sheet.path(end, &by).into_iter().for_each(|e| cut[e as usize] = true);
    }
    // The best of them stands for one that was not reached.
    out.extend(best.filter(|_| out.len() < SEAMS.first_energy.len()));
    Ok(out)
}
