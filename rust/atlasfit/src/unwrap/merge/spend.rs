//! Merges at the others' expense: the stretch bound is one for the whole surface.
//!
//! In: merged charts of a small mesh, a loose bound. Out: fewer charts, of which some stretch beyond the
//! bound on more than their share.

use super::charts::{Borders, Charts};
use super::constants::MERGE;
use super::glue::flattened;
use super::join::join;
use super::limits::MergeLimits;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::constants::UNWRAP;
use crate::unwrap::surface::Surface;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Merges charts of small meshes that stretch beyond the bound on too much of their own area, but not of all
/// area: the bound is one for the whole surface. What costs least of that goes first.
pub(crate) fn spend(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    if bound <= MERGE.loose {
        return Ok(());
    }
    let limits = MergeLimits {
        bound,
        over: MERGE.over_spent,
        mismatch: MERGE.mismatch,
        hard: true,
        whole: true,
        darts: true,
    };
    // Charts grew by steps that stop once they are within their own bounds: they may do better.
    charts.list.par_iter_mut().flatten().for_each(|c| {
        if c.over > 0.0
            && ctx.check().is_ok()
            && let Some(better) = flattened(s, c.clone(), bound, ctx)
            && better.over < c.over
        {
            *c = better;
        }
    });
    ctx.check()?;
    let over = |charts: &Charts, id: u32| charts.list[id as usize].as_ref().map_or(0.0, |c| c.over);
    let (mut left, mut area) = (0.0, 0.0);
    for c in charts.list.iter().flatten() {
        (left, area) = (left - c.over, area + c.area);
    }
    left += MERGE.spent * UNWRAP.beyond * area;
    // What was tried: the merged chart, or that it does not fit.
    let mut tried: FxHashMap<(u32, u32), Option<Chart>> = FxHashMap::default();
    loop {
        ctx.check()?;
        let pairs = Borders::find(s, charts).pairs();
        let mut fresh = pairs.clone();
        fresh.retain(|p| !tried.contains_key(p));
        let results: Vec<Option<Chart>> = (fresh.par_iter())
            .map(|&pair| ctx.check().ok().and_then(|()| join(s, charts, pair, limits, ctx)))
            .collect();
        ctx.check()?;
        tried.extend(fresh.into_iter().zip(results));
        let cost = |a: u32, b: u32, c: &Chart| c.over - over(charts, a) - over(charts, b);
        let best = (tried.iter())
            .filter_map(|(&(a, b), c)| c.as_ref().map(|c| (cost(a, b, c), a, b)))
            .filter(|m| m.0 <= left)
            .min_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let Some((cost, a, b)) = best else { return Ok(()) };
        let Some(merged) = tried.remove(&(a, b)).flatten() else { return Ok(()) };
        left -= cost;
        let id = charts.replace(a, b, merged);
        // Who fits neither half will not fit the whole; what is open with a half is tried anew.
        let refused = |x: u32, p: u32| tried.get(&(x.min(p), x.max(p))).map(Option::is_none);
        let partners: Vec<u32> = (pairs.iter())
            .flat_map(|p| [(p.0, p.1), (p.1, p.0)])
            .filter(|p| p.0 == a || p.0 == b)
            .map(|p| p.1)
            .collect();
        let never: Vec<u32> = partners
            .into_iter()
            .filter(|&p| p != a && p != b && refused(a, p).unwrap_or(true) && refused(b, p).unwrap_or(true))
            .collect();
        tried.retain(|k, _| ![k.0, k.1].iter().any(|x| *x == a || *x == b));
        tried.extend(never.into_iter().map(|p| ((p.min(id), p.max(id)), None)));
    }
}
