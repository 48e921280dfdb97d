//! Cuts grow to where the distortion is.
//!
//! In: a layout. Out: the same with one more cut, from the border or another cut to a place of much energy:
//! of some that are tried, the one that lowers the energy most for its length.

use super::constants::{Plan, SEAMS};
use super::open::opened;
use super::sheet::{Layout, Sheet};
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// The layout with one more cut, which ends at none of the vertices `tried`; `None` where none lowers the
/// energy. Its end joins these.
pub(super) fn grown(
    sheet: &Sheet<'_>,
    now: &Layout,
    plan: Plan,
    bound: f64,
    tried: &mut FxHashSet<u32>,
    ctx: &Context<'_>,
) -> Result<Option<Layout>> {
    let (distance, by) = sheet.distances(&sheet.opened(&now.cut), ctx)?;
    let paths: Vec<(u32, Vec<u32>)> =
        (targets(sheet, now, plan, &distance, tried).into_iter()).map(|v| (v, sheet.path(v, &by))).collect();
    let energies: Vec<Option<f64>> =
        paths.par_iter().map(|(_, path)| opened(sheet, now, path, ctx)).collect();
    ctx.check()?;
    // What is below the bound gains nothing more.
    let rate = |energy: f64, path: &[u32]| {
        let length: f64 = path.iter().map(|&e| sheet.length[e as usize]).sum();
        (now.energy.max(bound) - energy.max(bound)) / length
    };
    let mut order: Vec<(f64, &(u32, Vec<u32>))> = (paths.iter().zip(energies))
        .filter_map(|(path, energy)| Some((rate(energy?, &path.1), path)))
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, (end, path)) in order.into_iter().take(SEAMS.best) {
        tried.insert(*end);
        let mut cut = now.cut.clone();
        path.iter().for_each(|&e| cut[e as usize] = true);
        let out = sheet.from(now, cut, SEAMS.grown_steps, ctx).filter(|l| l.energy < now.energy);
        ctx.check()?;
        if out.is_some() {
            return Ok(out);
        }
    }
    Ok(None)
}

/// Places of much energy far from any cut, apart from each other.
fn targets(
    sheet: &Sheet<'_>,
    now: &Layout,
    plan: Plan,
    distance: &[f64],
    tried: &FxHashSet<u32>,
) -> Vec<u32> {
    let mut heat = sheet.excess(now);
    for _ in 0..2 {
        heat = (0..sheet.vertices() as u32)
            .map(|v| {
                let near = sheet.near(v);
                let sum: f64 = near.iter().map(|&e| heat[sheet.other(e, v) as usize]).sum();
                (heat[v as usize] + sum) / (1 + near.len()) as f64
            })
            .collect();
    }
    let far = distance.iter().filter(|d| d.is_finite()).fold(0.0, |a: f64, &d| a.max(d));
    let least = plan.least.min(0.5 * far);
    let inner = |v: &u32| distance[*v as usize] > least && distance[*v as usize].is_finite();
    let mut out: Vec<u32> = tried.iter().copied().collect();
    out.sort_unstable();
    for power in SEAMS.powers {
        let score = |v: u32| heat[v as usize] * distance[v as usize].powf(power);
        let mut order: Vec<u32> = (0..sheet.vertices() as u32).filter(inner).collect();
        order.sort_by(|&a, &b| score(b).total_cmp(&score(a)).then(a.cmp(&b)));
        let mut own = 0;
        for v in order {
            let at = sheet.s.pos[sheet.vertex[v as usize] as usize];
            let apart = |w: &u32| {
                let d2 = at.dist2(sheet.s.pos[sheet.vertex[*w as usize] as usize]);
                d2 > (0.5 * distance[*w as usize].max(distance[v as usize])).powi(2)
            };
            if out.iter().all(apart) {
                out.push(v);
                own += 1;
                if own == SEAMS.targets {
                    break;
                }
            }
        }
    }
    out.split_off(tried.len())
}
