//! Takes charts found on the coarse surface back to the full one.
//!
//! In: the surface, its patches and border paths, the coarse surface and its merged charts. Out: charts of
//! the full surface made of the same patches glued along the same paths, flattened at full resolution. A
//! chart that will not lie flat here is cut back into its patches, which are merged again at full resolution.

use super::coarse::Coarse;
use super::collapse::Level;
use super::constants::LARGE;
use super::patches::Patches;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::inject::{touching, wrong};
use crate::spatial::sets::Sets;
use crate::unwrap::chart::Chart;
use crate::unwrap::cut::cut;
use crate::unwrap::first::patch_charts;
use crate::unwrap::flatten::arap::Arap;
use crate::unwrap::flatten::graph::Graph;
use crate::unwrap::flatten::shape::{all_positive, cotangents, over_area};
use crate::unwrap::merge::{Charts, merge};
use crate::unwrap::surface::{NONE, Surface};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Which patches make one chart, and along which paths.
struct Plan {
    /// The patch that names the chart of each patch.
    root: Vec<u32>,
    /// Whether the two sides of a path are glued.
    glued: Vec<bool>,
}

/// The charts of the coarsest surface as patches. Patches that lie in several charts there are charts of
/// their own.
fn plan(patches: &Patches, coarse: &Coarse, charts: &Charts) -> Plan {
    let Level { surface, label, path } = coarse.last();
    let mut home = vec![NONE; patches.count];
    let mut torn = vec![false; patches.count];
    let mut inside = vec![[true; 3]; surface.faces()];
    for (id, c) in charts.list.iter().enumerate() {
        let Some(c) = c else { continue };
        for &f in &c.faces {
            let p = label[f as usize] as usize;
            torn[p] |= home[p] != NONE && home[p] != id as u32;
            home[p] = id as u32;
        }
        for &(i, k) in &c.border {
            inside[c.faces[i as usize] as usize][k as usize] = false;
        }
    }
    // A dart that ends within a path opens all of it.
    let mut glued = vec![true; patches.paths];
    let mut seen = vec![None; patches.paths];
    for f in 0..surface.faces() {
        for k in 0..3 {
            let (e, h) = (path[f][k], surface.twin[f][k]);
            if e == NONE || h == NONE {
                continue;
            }
            let (p, q) = (label[f], label[h as usize / 3]);
            glued[e as usize] &= inside[f][k] && !torn[p as usize] && !torn[q as usize];
            seen[e as usize] = Some((p, q));
        }
    }
    let mut sets = Sets::new(patches.count);
    for (glued, seen) in glued.iter_mut().zip(seen) {
        match seen {
            Some((p, q)) if *glued => sets.join(p, q),
            _ => *glued = false,
        }
    }
    Plan { root: (0..patches.count as u32).map(|p| sets.find(p)).collect(), glued }
}

/// Flat positions by vertex and patch.
type Known = FxHashMap<(u32, u32), [f64; 2]>;

/// What charts know of the positions of a surface with labelled patches.
fn known<'c>(
    s: &Surface,
    label: &[u32],
    charts: impl Iterator<Item = &'c Chart>,
    ctx: &Context<'_>,
) -> Result<Known> {
    let mut out = Known::default();
    for c in charts {
        for (i, (&f, t)) in c.faces.iter().zip(&c.tris).enumerate() {
            ctx.check_at(i)?;
            for k in 0..3 {
                out.entry((s.tri[f as usize][k], label[f as usize])).or_insert(c.uv[t[k] as usize]);
            }
        }
    }
    Ok(out)
}

/// Builds the plan's charts on one level and gives `each` to every one of them, in parallel.
fn build<T: Send>(
    s: &Surface,
    label: &[u32],
    path: &[[u32; 3]],
    plan: &Plan,
    each: impl Fn(Chart) -> T + Sync,
    ctx: &Context<'_>,
) -> Result<Vec<T>> {
    let Plan { root, glued } = plan;
    let mut faces: Vec<Vec<u32>> = vec![Vec::new(); root.len()];
    let mut index_of = vec![NONE; s.faces()];
    for f in 0..s.faces() {
        ctx.check_at(f)?;
        if label[f] != NONE {
            let r = root[label[f] as usize] as usize;
            index_of[f] = faces[r].len() as u32;
            faces[r].push(f as u32);
        }
    }
    // Each is a task, the largest first: charts differ in size, and a few hold most of the surface.
    let mut tasks: Vec<(usize, Vec<u32>)> = faces.into_iter().filter(|f| !f.is_empty()).enumerate().collect();
    tasks.sort_by_key(|t| std::cmp::Reverse(t.1.len()));
    let mut out: Vec<(usize, T)> = tasks
        .into_par_iter()
        .with_max_len(1)
        .filter_map(|(place, faces)| {
            if ctx.check().is_err() {
                return None;
            }
            let across = |_, f: usize, k: usize| {
                let h = s.twin[f][k];
                if h == NONE {
                    return None;
                }
                let (p, q) = (label[f], label[h as usize / 3]);
                let joined = p == q
                    || (path[f][k] != NONE
                        && glued[path[f][k] as usize]
                        && root[p as usize] == root[q as usize]);
                joined.then(|| index_of[h as usize / 3])
            };
            let mut c = Chart::glue(s, faces, across, ctx)?;
            let own = root[label[c.faces[0] as usize] as usize];
            c.zip(s, |f| (label[f] != NONE && root[label[f] as usize] == own).then(|| index_of[f]));
            Some((place, each(c)))
        })
        .collect();
    ctx.check()?;
    out.sort_by_key(|o| o.0);
    Ok(out.into_iter().map(|o| o.1).collect())
}

/// Builds and flattens the charts of the full surface.
pub(crate) fn refine(
    s: &Surface,
    patches: &Patches,
    coarse: &Coarse,
    charts: &Charts,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let plan = plan(patches, coarse, charts);
    let Level { surface, label, .. } = coarse.last();
    let mut at = known(surface, label, charts.list.iter().flatten(), ctx)?;
    for (below, Level { surface, label, path }) in coarse.levels.iter().enumerate().rev().skip(1) {
        let flat = |mut c: Chart| {
            flatten(surface, &mut c, label, |v| coarse.home(v, below + 1), &at, bound, ctx).then_some(c)
        };
        let list = build(surface, label, path, &plan, flat, ctx)?;
        at = known(surface, label, list.iter().flatten(), ctx)?;
    }
    let (label, path) = (&patches.label, &patches.path);
    let flat = |mut c: Chart| {
        if flatten(s, &mut c, label, |v| coarse.home(v, 0), &at, bound, ctx) {
            return clear(s, c, label, bound, ctx);
        }
        (Vec::new(), patch_charts(s, &c.faces, label, bound, ctx))
    };
    let done: Vec<(Vec<Chart>, Vec<Chart>)> = build(s, label, path, &plan, flat, ctx)?;
    let (good, bad): (Vec<Vec<Chart>>, Vec<Vec<Chart>>) = done.into_iter().unzip();
    let mut good: Vec<Chart> = good.into_iter().flatten().collect();
    let bad: Vec<Chart> = bad.into_iter().flatten().collect();
    if bad.is_empty() {
        return Ok(good);
    }
    // What was taken off finds a chart again; accepted ones stay apart as the coarse surface had it.
    let accepted = good.len();
    good.extend(bad);
    let mut again = Charts::new(s.faces(), good);
    again.kept_apart[..accepted].fill(true);
    merge(s, &mut again, bound, ctx)?;
    Ok(again.list.into_iter().flatten().collect())
}

/// Takes patches off a flattened chart until no triangle is flipped, no vertex wound round twice, and its
/// borders touch nowhere (at full resolution the two sides of a narrow slit may). Returns the accepted
/// charts, and those to be merged anew: they could not be accepted alone, or stretch too much.
fn clear(s: &Surface, c: Chart, label: &[u32], bound: f64, ctx: &Context<'_>) -> (Vec<Chart>, Vec<Chart>) {
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    let mut open = vec![c];
    while let Some(mut c) = open.pop() {
        let stopped = || ctx.check().is_err();
        if stopped() {
            break;
        }
        let of = |i: u32| label[c.faces[i as usize] as usize];
        let all = 0..c.faces.len() as u32;
        let Ok(wrong) = wrong(&c.tris, &c.uv, ctx) else { break };
        let mut off: Vec<u32> = all.clone().filter(|&i| wrong[i as usize]).map(of).collect();
        off.sort_unstable();
        off.dedup();
        if stopped() {
            break;
        }
        let mut spoiled = !off.is_empty();
        let touching = if spoiled { Ok(None) } else { touching(&c.tris, &c.uv, &c.border, ctx) };
        let Ok(touching) = touching else { break };
        if let Some(pair) = touching {
            let [p, q] = pair.map(of);
            let size = |p: u32| all.clone().filter(|&i| of(i) == p).count();
            off.push(if (size(p), p) < (size(q), q) { p } else { q });
            spoiled = p == q;
        }
        let is_off = |f: u32| off.binary_search(&label[f as usize]).is_ok();
        if stopped() {
            break;
        }
        if off.is_empty() {
            c.over = over_area(s, &c, bound);
            c.waste = c.wasted(s.page);
            if c.over <= LARGE.most_over * c.area {
                good.push(c);
            } else {
                bad.extend(patch_charts(s, &c.faces, label, bound, ctx));
            }
            continue;
        }
        let side: Vec<bool> = c.faces.iter().map(|&f| is_off(f)).collect();
        for piece in cut(s, &c, &side, ctx) {
            if spoiled && is_off(piece.faces[0]) {
                bad.extend(patch_charts(s, &piece.faces, label, bound, ctx));
            } else {
                open.push(piece);
            }
        }
    }
    (good, bad)
}

/// Flattens a chart from positions known on the next coarser level as well as it goes; false if there are
/// none. `home` gives the vertex there that a vertex here ended up in. Unfinished when the run is to stop:
/// the caller checks.
fn flatten(
    s: &Surface,
    c: &mut Chart,
    label: &[u32],
    home: impl Fn(u32) -> u32,
    known: &Known,
    bound: f64,
    ctx: &Context<'_>,
) -> bool {
    let mut pinned = vec![false; c.vertices()];
    let mut placed = vec![false; c.vertices()];
    for (j, (&f, t)) in c.faces.iter().zip(&c.tris).enumerate() {
        if ctx.check_at(j).is_err() {
            return false;
        }
        for k in 0..3 {
            let (v, i) = (s.tri[f as usize][k], t[k] as usize);
            if placed[i] {
                continue;
            }
            let at = home(v);
            if let Some(&p) = known.get(&(at, label[f as usize])) {
                c.uv[i] = p;
                placed[i] = true;
                pinned[i] = at == v;
            }
        }
    }
    if !pinned.iter().any(|&p| p) {
        return false;
    }
    // Everything between the pins by a harmonic map, then everything free.
    let rest = c.rest(s);
    Graph::from_triangles(c.vertices(), &c.tris, &cotangents(&rest), ctx).relax(
        &mut c.uv,
        &[],
        &pinned,
        LARGE.relax,
        ctx,
    );
    if ctx.check().is_err() {
        return false;
    }
    let mut arap = Arap::new(&c.tris, rest, &c.uv, &[], ctx);
    for _ in 0..LARGE.times {
        for step in 0..LARGE.steps {
            // The first ones take it to about its place.
            if step == LARGE.steps / 4 {
                arap.allow(bound, 0.0);
            }
            arap.step(&c.tris, &mut c.uv, &[]);
        }
        if all_positive(&c.tris, &c.uv) {
            break;
        }
    }
    true
}
