//! Seams as an optimisation: few charts, one for each connected part where that can be, cut open only as far
//! as a bound on the distortion asks for.
//!
//! In: a surface and a bound on the symmetric Dirichlet energy. Out: charts, if each part of the surface
//! could be opened. After OptCuts (Li, Kaufman, Kim, Solomon, Sheffer 2018), which moves seams vertex by
//! vertex: here whole cuts grow to where the distortion is and are closed from their ends again, first on a
//! coarse stand-in.

mod around;
mod close;
mod constants;
mod grow;
mod initial;
mod lift;
mod open;
mod search;
mod sheet;
mod trim;

use super::chart::Chart;
use super::large::{Patches, coarsen};
use super::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use constants::{LEAST_ENERGY, SEAMS};
use lift::lifted;
use rayon::prelude::*;
use rustc_hash::FxHashSet;
use sheet::{Layout, Sheet};
use trim::trimmed;

/// Parts of a surface that were opened.
pub(super) struct Opened {
    /// One for each.
    pub charts: Vec<Chart>,
    /// Faces of the other parts.
    pub failed: FxHashSet<u32>,
}

/// Charts of mean energy at most `bound` with short seams: one for each connected part of the surface that
/// can be opened so.
pub(super) fn opened(s: &Surface, bound: f64, ctx: &Context<'_>) -> Result<Opened> {
    let mut out = Opened { charts: Vec::new(), failed: FxHashSet::default() };
    for faces in s.parts(ctx)? {
        match part_opened(s, faces.clone(), bound, ctx)? {
            Some(chart) => out.charts.push(chart),
            None => out.failed.extend(faces),
        }
    }
    Ok(out)
}

/// One connected part in one chart.
fn part_opened(s: &Surface, faces: Vec<u32>, bound: f64, ctx: &Context<'_>) -> Result<Option<Chart>> {
    if let [f] = faces[..] {
        return Ok(Some(Chart::single(s, f)));
    }
    let whole = faces.len() == s.faces();
    let Some(sheet) = Sheet::new(s, faces, ctx)? else { return Ok(None) };
    if sheet.faces.len() > SEAMS.much && whole {
        return by_stand_in(s, &sheet, bound, ctx);
    }
    Ok(search::searched(&sheet, bound, ctx)?.into_iter().next().map(|l| l.chart))
}

/// A whole surface in one chart, by cuts found on a coarse stand-in.
fn by_stand_in(s: &Surface, sheet: &Sheet<'_>, bound: f64, ctx: &Context<'_>) -> Result<Option<Chart>> {
    let patches = Patches::new(s, vec![0; s.faces()], 1);
    let levels = coarsen(s, &patches, SEAMS.coarse, ctx)?;
    let coarse = &levels.last().surface;
    let faces = (0..coarse.faces() as u32).collect();
    // What cannot be opened there would take long to fail here.
    let Some(small) = Sheet::new(coarse, faces, ctx)? else { return Ok(None) };
    let found = search::searched(&small, energy_of(SEAMS.slack * excess(bound)), ctx)?;
    let within: Vec<Option<Layout>> = (found.into_par_iter().with_max_len(1))
        .map(|found| match start_from(&small, found, sheet, bound, ctx)? {
            Some(start) => search::within(sheet, start, SEAMS.plans[0], bound, ctx),
            None => Ok(None),
        })
        .collect::<Result<_>>()?;
    let shortest = within.into_iter().flatten().min_by(|a, b| a.length.total_cmp(&b.length));
    let Some(shortest) = shortest else { return Ok(None) };
    Ok(Some(search::shortened(sheet, shortest, bound, SEAMS.in_vain_lifted, ctx)?.chart))
}

/// Cuts found on a stand-in, on the sheet that it stands for. As long as there is much less energy here than
/// there may be, more of them are closed there, where that is cheap.
fn start_from(
    small: &Sheet<'_>,
    mut found: Layout,
    sheet: &Sheet<'_>,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Option<Layout>> {
    let used = |start: &Layout| excess(start.energy) / excess(bound);
    let mut best = lifted(small, &found, sheet, ctx)?;
    for _ in 0..SEAMS.loosened {
        let Some(start) = &best else { break };
        if used(start) >= SEAMS.used_up {
            break;
        }
        let looser = energy_of(excess(found.energy) * used(start).recip().min(SEAMS.most_looser));
        let next = trimmed(small, found, looser, ctx)?;
        found = search::shortened(small, next, looser, SEAMS.in_vain, ctx)?;
        let shorter = lifted(small, &found, sheet, ctx)?;
        let Some(start) = shorter.filter(|l| used(l) <= SEAMS.used_up.recip()) else { break };
        best = Some(start);
    }
    Ok(best)
}

/// What a mean energy has above an isometry's.
fn excess(energy: f64) -> f64 {
    energy - LEAST_ENERGY
}

/// The mean energy with so much above it.
fn energy_of(excess: f64) -> f64 {
    LEAST_ENERGY + excess
}
