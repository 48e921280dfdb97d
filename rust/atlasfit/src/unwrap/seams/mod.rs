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
use rustc_hash::FxHashSet;
use sheet::Sheet;

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
    let plan = SEAMS.plans[0];
    if sheet.faces.len() > SEAMS.much && whole {
        let patches = Patches::new(s, vec![0; s.faces()], 1);
        let levels = coarsen(s, &patches, SEAMS.coarse, ctx)?;
        let coarse = &levels.last().surface;
        let faces = (0..coarse.faces() as u32).collect();
        // What cannot be opened there would take long to fail here.
        let Some(small) = Sheet::new(coarse, faces, ctx)? else { return Ok(None) };
        let rough = LEAST_ENERGY + SEAMS.slack * (bound - LEAST_ENERGY);
        let Some(found) = search::search(&small, rough, ctx)? else { return Ok(None) };
        let Some(start) = lifted(&small, &found, &sheet, ctx)? else { return Ok(None) };
        let Some(found) = search::within(&sheet, start, plan, bound, ctx)? else { return Ok(None) };
        return Ok(Some(search::shortened(&sheet, found, bound, SEAMS.in_vain_lifted, ctx)?.chart));
    }
    Ok(search::search(&sheet, bound, ctx)?.map(|l| l.chart))
}
