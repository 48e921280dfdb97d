//! Charts within a bound on the stretch of all of them together, and no more of them than asked for where
//! more stretch allows that.
//!
//! In: a surface and what is asked for. Out: charts and the bound that they hold.

use super::chart::Chart;
use super::constants::UNWRAP;
use super::flatten::newton::mean_energy;
use super::flatten::shape::stretch;
use super::kept::kept_charts;
use super::options::{STRETCH_LIMIT, UnwrapOptions};
use super::seams::{Opened, opened};
use super::surface::Surface;
use crate::error::Result;
use crate::numeric::plane::corners;
use crate::run::Context;
use rayon::prelude::*;

/// Charts that hold a bound.
pub(super) struct Bounded {
    pub charts: Vec<Chart>,
    /// On the stretch of 95% of the area.
    pub bound: f64,
}

/// Charts as the options ask for; `charts_within` makes charts for a bound on each one's own stretch.
pub(super) fn bounded(
    s: &mut Surface,
    uvs: &[[[f32; 2]; 3]],
    options: &UnwrapOptions,
    charts_within: impl Fn(&Surface, f64) -> Result<Vec<Chart>>,
    ctx: &Context<'_>,
) -> Result<Bounded> {
    let bound = options.max_stretch;
    if options.keep_uvs {
        return Ok(Bounded { charts: kept_charts(s, uvs, bound, ctx)?, bound });
    }
    if let Some(energy) = options.max_energy {
        let charts = within_energy(s, energy, &|bound| charts_within(s, bound), ctx)?;
        return Ok(Bounded { charts, bound });
    }
    let best = Bounded { charts: held(s, bound, &|bound| charts_within(s, bound), ctx)?, bound };
    match options.max_charts {
        Some(most) if best.charts.len() > most => {
            s.page.counts = false;
            at_most(s, most, best, &|bound| charts_within(s, bound), ctx)
        }
        _ => Ok(best),
    }
}

/// At most so many charts, or as few as more stretch leads to: first those that only the page asked for go,
/// then the bound is raised. Of the bounds that are tried the least one that serves counts.
fn at_most(
    s: &Surface,
    most: usize,
    mut best: Bounded,
    charts_within: &impl Fn(f64) -> Result<Vec<Chart>>,
    ctx: &Context<'_>,
) -> Result<Bounded> {
    // Each connected part takes one.
    let enough = most.max(s.parts(ctx)?.len());
    let (mut bound, mut in_vain) = (best.bound, 0);
    let mut too_tight = bound;
    while best.charts.len() > enough && bound <= STRETCH_LIMIT && in_vain <= UNWRAP.patience {
        let charts = held(s, bound, charts_within, ctx)?;
        in_vain += 1;
        if charts.len() > enough {
            too_tight = bound;
        }
        if charts.len() < best.charts.len() {
            best = Bounded { charts, bound };
            in_vain = 0;
        }
        if bound == STRETCH_LIMIT {
            break;
        }
        bound = (1.0 + (bound - 1.0) * UNWRAP.loosen).min(STRETCH_LIMIT);
    }
    if best.charts.len() > enough {
        return Ok(best);
    }
    for _ in 0..UNWRAP.narrowings {
        if best.bound <= too_tight {
            break;
        }
        let bound = 1.0 + ((too_tight - 1.0) * (best.bound - 1.0)).sqrt();
        let charts = held(s, bound, charts_within, ctx)?;
        if charts.len() <= enough {
            best = Bounded { charts, bound };
        } else {
            too_tight = bound;
        }
    }
    Ok(best)
}

/// Charts that hold a bound all together, at one density: what they are made for is tightened until they do.
fn held(
    s: &Surface,
    bound: f64,
    charts_within: &impl Fn(f64) -> Result<Vec<Chart>>,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let mut asked = bound;
    let mut least: Option<(f64, Vec<Chart>)> = None;
    for tried in 0..=UNWRAP.tightenings {
        let mut charts = charts_within(asked)?;
        ctx.check()?;
        let mut reached = judge(s, &mut charts, bound, ctx)?;
        if reached > bound {
            charts.par_iter_mut().for_each(Chart::take_own_area);
            reached = judge(s, &mut charts, bound, ctx)?;
        }
        if least.as_ref().is_none_or(|l| reached < l.0) {
            least = Some((reached, charts));
        }
        if reached <= bound {
            break;
        }
        // What hardly helped is done more of.
        let less = UNWRAP.tightened * (bound - 1.0) / (reached - 1.0);
        asked = 1.0 + (asked - 1.0) * less.powi(tried + 1);
    }
    Ok(least.map_or_else(Vec::new, |l| l.1))
}

/// Charts of mean energy at most `most`: each part of the surface in one, cut open, and where that fails in
/// as many as a tighter and tighter bound on the stretch asks for.
fn within_energy(
    s: &Surface,
    most: f64,
    charts_within: &impl Fn(f64) -> Result<Vec<Chart>>,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let Opened { mut charts, failed } = opened(s, most, ctx)?;
    if failed.is_empty() {
        return Ok(charts);
    }
    let mut bound = 1.0 + UNWRAP.energetic;
    loop {
        let mut more = charts_within(bound)?;
        more.retain(|c| failed.contains(&c.faces[0]));
        let (mut energy, mut area) = (0.0, 0.0);
        for c in &more {
            energy += c.area * mean_energy(&c.tris, &c.rest(s), &c.uv);
            area += c.area;
        }
        if energy <= most * area || bound - 1.0 < UNWRAP.least_excess {
            charts.extend(more);
            return Ok(charts);
        }
        bound = 1.0 + (bound - 1.0) * UNWRAP.less_energetic;
    }
}

/// The stretch that 95% of the area stays within, at the density at which the charts have the surface's area.
/// Sets what area of each chart is beyond the bound.
pub(super) fn judge(s: &Surface, charts: &mut [Chart], bound: f64, ctx: &Context<'_>) -> Result<f64> {
    let areas: Vec<[f64; 2]> = charts.par_iter().map(|c| [c.area, c.flat_area()]).collect();
    let [area, flat] = areas.iter().fold([0.0; 2], |sum, a| [sum[0] + a[0], sum[1] + a[1]]);
    let density = (area / flat).sqrt();
    let stretched: Vec<Vec<(f64, f64)>> = (charts.par_iter_mut())
        .map(|c| {
            let mut beyond = Vec::new();
            for (i, (&f, t)) in c.faces.iter().zip(&c.tris).enumerate() {
                ctx.check_at(i)?;
                let at = corners(*t, &c.uv).map(|p| p.map(|x| x * density));
                let stretch = stretch(s.rest[f as usize], at);
                if stretch > bound {
                    beyond.push((stretch, s.area[f as usize]));
                }
            }
            c.over = beyond.iter().map(|b| b.1).sum();
            Ok(beyond)
        })
        .collect::<Result<_>>()?;
    let mut beyond: Vec<(f64, f64)> = stretched.into_iter().flatten().collect();
    beyond.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut left = UNWRAP.beyond * area;
    let reached = beyond.iter().find(|b| {
        left -= b.1;
        left < 0.0
    });
    Ok(reached.map_or(bound, |b| b.0))
}
