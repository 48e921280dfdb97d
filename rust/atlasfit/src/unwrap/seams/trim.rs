//! Cuts are closed from their loose ends as far as the bound allows.
//!
//! In: a layout within the bound. Out: one with shorter cuts.

use super::close::{Closed, closed};
use super::constants::SEAMS;
use super::sheet::{Layout, Sheet};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::flatten::newton::Until;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Closes what can be closed.
pub(super) fn trimmed(sheet: &Sheet<'_>, mut now: Layout, bound: f64, ctx: &Context<'_>) -> Result<Layout> {
    let mut piece = SEAMS.piece * now.length;
    let shortest = sheet.length.iter().sum::<f64>() / sheet.length.len() as f64;
    // What closing each end cost when it was last tried, for its length.
    let mut known: FxHashMap<u32, f64> = FxHashMap::default();
    let until = |wanted| Until { steps: SEAMS.steps, least: SEAMS.least, wanted };
    // Whether all has given way since the last piece was closed.
    let mut settled = false;
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
        let tried: Vec<Option<Closed>> =
            ends.par_iter().map(|(_, path)| closed(sheet, &now, path, ctx)).collect();
        ctx.check()?;
        let rate = |c: &Closed| (c.energy - now.energy) / (now.length - c.length).max(1e-12);
        let mut best: Option<(f64, u32, Closed)> = None;
        for ((_, path), closed) in ends.iter().zip(tried) {
            let rate = closed.as_ref().map_or(f64::INFINITY, rate);
            known.insert(path[0], rate);
            if let Some(c) = closed
                && best.as_ref().is_none_or(|b| rate < b.0)
            {
                best = Some((rate, path[0], c));
            }
        }
        let Some((_, end, c)) = best else {
            if piece <= shortest {
                return Ok(now);
            }
            piece *= 0.5;
            known.clear();
            continue;
        };
        if c.energy > bound && !settled {
            // What all can give way by is used before something is given up.
            let eased = sheet.until(now.cut.clone(), now.chart.clone(), until(None), ctx);
            ctx.check()?;
            now = eased.unwrap_or(now);
            settled = true;
            known.clear();
            continue;
        }
        let mut next = None;
        if now.energy + SEAMS.left * (c.energy - now.energy) <= bound {
            next = c.layout(sheet, &now, ctx);
            if c.energy > bound {
                next = next.and_then(|l| sheet.until(l.cut, l.chart, until(Some(bound)), ctx));
            }
        }
        ctx.check()?;
        match next.filter(|l| l.energy <= bound) {
            Some(l) => (now, settled) = (l, false),
            None => {
                known.insert(end, f64::INFINITY);
            }
        }
    }
}

/// The loose ends of a cut, from the outermost edge inward, about so long.
pub(super) fn loose_ends(sheet: &Sheet<'_>, cut: &[bool], piece: f64) -> Vec<Vec<u32>> {
    let mut out = Vec::new();
    let total = cut.iter().filter(|&&c| c).count();
    // A cut that ends at a border parts two borders, perhaps: closed from there, it leaves a hole.
    for end in 0..sheet.vertices() as u32 {
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
