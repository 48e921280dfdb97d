//! One merge: which edges two charts share, and along which of them they become one.

use super::align::{Shared, align, paths};
use super::charts::Charts;
use super::constants::MERGE;
use super::dart::Path;
use super::glue::{glue, price_of_waste};
use super::limits::MergeLimits;
use super::overlap::overlaps;
use super::patch::{Pair, Worth};
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::surface::{NONE, Surface};
use std::ops::Range;

/// Tries to make one chart of two; `None` if it would stretch or overlap too much.
pub(super) fn join(
    s: &Surface,
    charts: &Charts,
    (a, b): (u32, u32),
    limits: MergeLimits,
    ctx: &Context<'_>,
) -> Option<Chart> {
    let chart = |id: u32| charts.list[id as usize].as_ref();
    let larger_first = chart(a)?.faces.len() >= chart(b)?.faces.len();
    let ids = if larger_first { [a, b] } else { [b, a] };
    let (a, b) = (chart(ids[0])?, chart(ids[1])?);
    let place = |f: usize| charts.place_in(ids, f);
    let worth = Worth {
        seams: a.seams(s).with(b.seams(s)),
        waste: a.waste + b.waste,
        price: price_of_waste(limits.bound),
        least: 0.0,
    };
    joined(&Pair { s, a, b, place: &place, limits, worth }, ctx)
}

/// Tries to make one chart of a pair; `None` if it would stretch or overlap too much, or is not worth it.
pub(super) fn joined(pair: &Pair<'_>, ctx: &Context<'_>) -> Option<Chart> {
    let &Pair { a, b, limits, .. } = pair;
    let shared = shared_edges(pair);
    let paths = paths(&shared);
    if limits.whole && paths.len() > 1 {
        let (motion, rms) = align(a, b, &shared);
        if rms < MERGE.closed * a.area.min(b.area).sqrt()
            && let Some(c) = glue(pair, &shared, motion, ctx)
        {
            return Some(c);
        }
    }
    let best = paths.into_iter().max_by(|x, y| {
        let cost = |p: &[Shared]| p.iter().map(|e| e.cost).sum::<f64>();
        cost(x).total_cmp(&cost(y))
    })?;
    let (motion, gap) = align(a, b, &best);
    if limits.whole
        && misfit(pair, &best, gap) <= limits.mismatch
        && let Some(c) = glue(pair, &best, motion, ctx)
    {
        return Some(c);
    }
    if !limits.darts {
        return None;
    }
    let path = Path::new(a, b, best);
    let mut parts: Vec<Range<usize>> = (1..MERGE.dart_parts)
        .rev()
        .filter_map(|of| path.best_part(f64::from(of) / f64::from(MERGE.dart_parts)))
        .collect();
    // Paths of few edges have few parts.
    parts.dedup();
    for range in parts {
        ctx.check().ok()?;
        let part = &path.edges[range.clone()];
        let (motion, gap) = align(a, b, part);
        if misfit(pair, part, gap) > limits.mismatch || overlaps([a, b], &path, &range, motion, ctx).ok()? {
            continue;
        }
        if let Some(c) = glue(pair, part, motion, ctx) {
            return Some(c);
        }
    }
    None
}

/// The squared gap that rigid motion leaves, against the size of what must stretch to close it.
fn misfit(pair: &Pair<'_>, path: &[Shared], gap: f64) -> f64 {
    let &Pair { a, b, limits, .. } = pair;
    let length: f64 = path.iter().map(|e| e.length).sum();
    gap * gap / ((limits.bound - 1.0).powi(2) * length * a.area.min(b.area).sqrt())
}

/// The edges that the pair shares, in the order of the first chart's border.
fn shared_edges(pair: &Pair<'_>) -> Vec<Shared> {
    let &Pair { s, a, b, place, .. } = pair;
    let mut shared = Vec::new();
    for &(i, k) in &a.border {
        let h = s.twin[a.faces[i as usize] as usize][k as usize];
        if h == NONE {
            continue;
        }
        if let Some((true, of_b)) = place(h as usize / 3) {
            let (t, j) = (a.tris[i as usize], k as usize);
            let (u, l) = (b.tris[of_b as usize], h as usize % 3);
            let f = a.faces[i as usize] as usize;
            shared.push(Shared {
                a: [t[j], t[(j + 1) % 3]],
                b: [u[(l + 1) % 3], u[l]],
                length: f64::from(s.length[f][j]),
                cost: s.cost(f, j),
            });
        }
    }
    shared
}
