//! Cuts are closed from their loose ends as far as the bound allows.
//!
//! In: a layout within the bound. Out: one with shorter cuts.

use super::constants::SEAMS;
use super::sheet::{Layout, Sheet};
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Closes what can be closed.
pub(super) fn trimmed(sheet: &Sheet<'_>, mut now: Layout, bound: f64, ctx: &Context<'_>) -> Result<Layout> {
    let mut piece = SEAMS.piece * now.length;
    let shortest = sheet.length.iter().sum::<f64>() / sheet.length.len() as f64;
    // What closing each end cost when it was last tried, for its length.
    let mut known: FxHashMap<u32, f64> = FxHashMap::default();
    loop {
        ctx.check()?;
        let mut ends: Vec<(f64, Vec<u32>)> = loose_ends(sheet, &now.cut, piece)
            .into_iter()
            .map(|path| (known.get(&path[0]).copied().unwrap_or(f64::NEG_INFINITY), path))
            .filter(|end| end.0 < f64::INFINITY)
            .collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        // New ends, and the cheapest of the others: a cost seldom changes much.
        let fresh = ends.iter().filter(|e| e.0 == f64::NEG_INFINITY).count();
        ends.truncate(fresh + SEAMS.again);
        let tried: Vec<Option<Layout>> =
            ends.par_iter().map(|(_, path)| closed(sheet, &now, path, ctx)).collect();
        ctx.check()?;
        let rate = |l: &Layout| (l.energy - now.energy) / (now.length - l.length).max(1e-12);
        let mut best: Option<(f64, u32, Layout)> = None;
        for ((_, path), layout) in ends.iter().zip(tried) {
            let rate = layout.as_ref().map_or(f64::INFINITY, rate);
            known.insert(path[0], rate);
            if let Some(l) = layout
                && best.as_ref().is_none_or(|b| rate < b.0)
            {
                best = Some((rate, path[0], l));
            }
        }
        let Some((_, end, l)) = best else {
            if piece <= shortest {
                return Ok(now);
            }
            piece *= 0.5;
            known.clear();
            continue;
        };
        let within = if l.energy <= bound {
            Some(l)
        } else {
            let cut = l.cut.clone();
            sheet.from(&l, cut, SEAMS.steps, ctx).filter(|l| l.energy <= bound)
        };
        ctx.check()?;
        match within {
            Some(l) => now = l,
            None => {
                known.insert(end, f64::INFINITY);
            }
        }
    }
}

/// The layout with a piece of a cut closed, edge by edge: the two sides of a long piece lie too far apart.
fn closed(sheet: &Sheet<'_>, now: &Layout, path: &[u32], ctx: &Context<'_>) -> Option<Layout> {
    let mut out = None;
    for (i, &e) in path.iter().enumerate() {
        let from = out.as_ref().unwrap_or(now);
        let mut cut = from.cut.clone();
        cut[e as usize] = false;
        let steps = if i + 1 == path.len() { SEAMS.trial_steps } else { 1 };
        out = Some(sheet.from(from, cut, steps, ctx)?);
    }
    out
}

/// The loose ends of a cut, from the outermost edge inward, about so long.
pub(super) fn loose_ends(sheet: &Sheet<'_>, cut: &[bool], piece: f64) -> Vec<Vec<u32>> {
    let mut out = Vec::new();
    let total = cut.iter().filter(|&&c| c).count();
    for end in (0..sheet.vertices() as u32).filter(|&v| !sheet.rim[v as usize]) {
        if sheet.cuts_at(end, cut) != 1 {
            continue;
        }
        let (mut v, mut length, mut path) = (end, 0.0, Vec::new());
        loop {
            let next = sheet.near(v).iter().find(|&&e| cut[e as usize] && path.last() != Some(&e));
            let Some(&e) = next else { break };
            // A closed surface keeps a cut.
            if !path.is_empty() && length + sheet.length[e as usize] > piece || path.len() + 2 >= total {
                break;
            }
            path.push(e);
            length += sheet.length[e as usize];
            v = sheet.other(e, v);
            if sheet.rim[v as usize] || sheet.cuts_at(v, cut) != 2 {
                break;
            }
        }
        if !path.is_empty() {
            out.push(path);
        }
    }
    out
}
