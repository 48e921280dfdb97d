//! Charts as the UVs that a mesh already has lay them out: only packing is left to do.
//!
//! In: a surface that is cut at the seams of its UVs, and these. Out: charts of the same shapes, at one
//! density. What flips or overlaps is cut when they are packed, as in any other chart.

use super::chart::Chart;
use super::flatten::shape::over_area;
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::lists::Lists;
use crate::spatial::sets::Sets;

/// The charts of the UVs of each face's corners. `bound` is the stretch beyond which area is counted.
pub(crate) fn kept_charts(
    s: &Surface,
    corner_uv: &[[[f32; 2]; 3]],
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let mut sets = Sets::new(s.faces());
    for (f, twins) in s.twin.iter().enumerate() {
        ctx.check_at(f)?;
        for &h in twins.iter().filter(|&&h| h != NONE) {
            sets.join(f as u32, h / 3);
        }
    }
    let root: Vec<[u32; 1]> = (0..s.faces() as u32).map(|f| [sets.find(f)]).collect();
    let lists = Lists::new(s.faces(), &root, ctx)?;
    let mut place = ctx.filled(NONE, s.faces())?;
    let mut out = Vec::new();
    for id in 0..s.faces() as u32 {
        let faces: Vec<u32> = lists.of(id).iter().copied().filter(|&f| s.usable[f as usize]).collect();
        if faces.is_empty() {
            continue;
        }
        for (i, &f) in faces.iter().enumerate() {
            place[f as usize] = i as u32;
        }
        let across = |_, f: usize, k: usize| {
            let h = s.twin[f][k];
            if h == NONE { None } else { Some(place[h as usize / 3]) }
        };
        let Some(mut chart) = Chart::glue(s, faces, across, ctx) else { continue };
        for (t, &f) in chart.tris.iter().zip(&chart.faces) {
            for (&v, uv) in t.iter().zip(corner_uv[f as usize]) {
                chart.uv[v as usize] = uv.map(f64::from);
            }
        }
        chart.take_own_area();
        chart.over = over_area(s, &chart, bound);
        out.push(chart);
    }
    ctx.check()?;
    Ok(out)
}
