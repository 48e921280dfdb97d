//! Two charts made one along given edges.
//!
//! In: two flattened charts, their shared edges, a rigid motion. Out: the merged chart, flattened, if it is
//! accepted: it stretches little enough, wastes little of the page, and overlaps nowhere.

use super::align::{Motion, Shared, moved};
use super::constants::MERGE;
use super::patch::{Pair, Patch, assemble, patch};
use crate::numeric::plane::corners;
use crate::run::Context;
use crate::spatial::inject::{border_touches, injective, turns_once};
use crate::unwrap::chart::{Chart, Seams, wasted};
use crate::unwrap::flatten::arap::Arap;
use crate::unwrap::flatten::dirichlet::{self, Disk};
use crate::unwrap::flatten::shape::{all_positive, over_area, stretch};
use crate::unwrap::surface::Surface;

/// Joins two charts along given edges, if the result stretches little enough and is injective.
pub(super) fn glue(pair: &Pair<'_>, shared: &[Shared], motion: Motion, ctx: &Context<'_>) -> Option<Chart> {
    let &Pair { s, a, b, limits, .. } = pair;
    let bound = limits.bound;
    if !worth_as_they_lie(pair, shared, motion) {
        return None;
    }
    let mut p = patch(pair, shared, motion)?;
    ctx.check().ok()?;
    let over = |p: &Patch| -> f64 {
        (p.tris.iter().zip(&p.rest).zip(&p.area))
            .filter(|((t, r), _)| stretch(**r, corners(**t, &p.uv)) > bound)
            .map(|(_, a)| a)
            .sum()
    };
    // What is stretched in the part of a that stays as it is.
    let far = a.over
        - (p.near.iter().map(|&i| i as usize))
            .filter(|&i| stretch(s.rest[a.faces[i] as usize], corners(a.tris[i], &a.uv)) > bound)
            .map(|i| s.area[a.faces[i] as usize])
            .sum::<f64>();
    let area = a.area + b.area;
    let allowed = limits.over * area - far;
    ctx.check().ok()?;
    let mut arap = Arap::new(&p.tris, p.rest.clone(), &p.uv, &p.pinned, ctx);
    let mut last = f64::INFINITY;
    for step in 0..MERGE.steps {
        arap.step(&p.tris, &mut p.uv, &p.pinned);
        // The first one closes the gaps.
        arap.allow(bound, MERGE.momentum);
        ctx.check().ok()?;
        if step % 3 != 1 && step + 1 != MERGE.steps {
            continue;
        }
        let now = over(&p);
        let positive = all_positive(&p.tris, &p.uv);
        if now <= allowed && positive {
            ctx.check().ok()?;
            let mut c = assemble(pair, &p)?;
            ctx.check().ok()?;
            c.over = far + now;
            c.waste = c.wasted(s.page);
            if !pair.worth.has(c.seams(s), c.waste) {
                return None;
            }
            let accepted = turns_once(&p.tris, &p.uv, &p.pinned, ctx).ok()?
                && !border_touches(&c.tris, &c.uv, &c.border, ctx).ok()?;
            return accepted.then_some(c);
        }
        // Hopeless: far too stretched, or hardly getting better. Success nearly always shows at once.
        let hope = if step == 1 { MERGE.first_hope } else { MERGE.hope };
        if now > hope * allowed || now > MERGE.progress * last || (step > 1 && !positive) {
            break;
        }
        last = now;
    }
    if !limits.hard || a.faces.len() + b.faces.len() > MERGE.hard_faces {
        return None;
    }
    // Without flips from the start, at the cost of the whole chart.
    let c = assemble(pair, &p)?;
    ctx.check().ok()?;
    let c = flattened(s, c, bound, ctx)?;
    (pair.worth.has(c.seams(s), c.waste) && c.over <= limits.over * c.area).then_some(c)
}

/// Whether the merged chart would be worth what it wastes, if the two lay in it as they lie now. The solve
/// hardly changes that, and costs far more.
fn worth_as_they_lie(pair: &Pair<'_>, shared: &[Shared], motion: Motion) -> bool {
    let &Pair { s, a, b, worth, .. } = pair;
    let inside = shared
        .iter()
        .fold(Seams::default(), |sum, e| sum.with(Seams { length: 2.0 * e.length, cost: 2.0 * e.cost }));
    let mut outline = a.outline();
    outline.extend(b.outline().iter().map(|&p| moved(motion, p)));
    worth.has(a.seams(s).with(b.seams(s)).without(inside), wasted(&outline, a.area + b.area, s.page))
}

/// The chart with positions of least symmetric Dirichlet energy, if it then overlaps nowhere.
pub(super) fn flattened(s: &Surface, mut c: Chart, bound: f64, ctx: &Context<'_>) -> Option<Chart> {
    let disk = Disk { tris: &c.tris, rest: &c.rest(s), border: &c.border, vertices: c.vertices() };
    c.uv = dirichlet::flatten(&disk, bound, ctx)?;
    c.over = over_area(s, &c, bound);
    c.waste = c.wasted(s.page);
    injective(&c.tris, &c.uv, &c.border, ctx).ok()?.then_some(c)
}

/// What an area of the page that is wasted costs, in lengths of seam, where the stretch may be up to `bound`.
pub(crate) fn price_of_waste(bound: f64) -> f64 {
    MERGE.waste * ((MERGE.usual - 1.0) / (bound - 1.0)).min(1.0)
}
