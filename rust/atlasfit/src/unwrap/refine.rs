//! Takes charts found on the coarse surface back to the full one.
//!
//! In: the surface, its patches and border paths, the coarse surface and its merged charts. Out: charts of the full
//! surface made of the same patches glued along the same paths, flattened at full resolution. A chart that will not
//! lie flat here is cut back into its patches, which are merged again at full resolution.

use super::chart::Chart;
use super::coarse::{Coarse, border_paths};
use super::flatten::{Arap, all_positive, cotangents, over_area};
use super::inject::{touching, turns_once, wrong};
use super::merge::{self, Charts};
use super::solver::Graph;
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use std::collections::HashMap;

/// Local-global iterations after the interpolated start.
const STEPS: usize = 8;
/// Charts with more vertices are relaxed iteratively: exact solves would cost n^1.5.
const DIRECT: usize = 6000;
/// Conjugate gradient steps for the start: pins are a few edges apart.
const RELAX: usize = 20;
/// A chart stretched beyond the bound on more than this share of its area is cut up again.
const OVER: f64 = 0.12;

/// The patches of a surface and the border paths between them.
pub(super) struct Patches {
    /// Patch per face; [`NONE`] for unusable faces.
    pub label: Vec<u32>,
    /// Number of patches.
    pub count: usize,
    /// Border path per half-edge slot; [`NONE`] inside patches.
    pub path: Vec<[u32; 3]>,
    /// Number of paths.
    pub paths: usize,
}

impl Patches {
    /// Names the paths between labelled patches.
    pub(super) fn new(s: &Surface, label: Vec<u32>, count: usize) -> Self {
        let (path, paths) = border_paths(s, &label);
        Self { label, count, path, paths }
    }
}

/// Builds and flattens the charts of the full surface.
pub(super) fn refine(
    s: &Surface,
    patches: &Patches,
    coarse: &Coarse,
    charts: &Charts,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let (label, path) = (&patches.label, &patches.path);
    // Patches that stayed in one piece on the coarse surface, and the chart each belongs to.
    let mut home = vec![NONE; patches.count];
    let mut torn = vec![false; patches.count];
    let mut inside = vec![[true; 3]; coarse.surface.faces()];
    for (id, c) in charts.list.iter().enumerate() {
        let Some(c) = c else { continue };
        for &f in &c.faces {
            let p = coarse.label[f as usize] as usize;
            torn[p] |= home[p] != NONE && home[p] != id as u32;
            home[p] = id as u32;
        }
        for &(i, k) in &c.border {
            inside[c.faces[i as usize] as usize][k as usize] = false;
        }
    }
    let mut glued = vec![false; patches.paths];
    let mut root: Vec<u32> = (0..patches.count as u32).collect();
    for f in 0..coarse.surface.faces() {
        for k in 0..3 {
            let (e, h) = (coarse.path[f][k], coarse.surface.mate[f][k]);
            if e == NONE || h == NONE || !inside[f][k] {
                continue;
            }
            let (p, q) = (coarse.label[f], coarse.label[h as usize / 3]);
            if !torn[p as usize] && !torn[q as usize] {
                glued[e as usize] = true;
                let (x, y) = (merge::find(&mut root, p), merge::find(&mut root, q));
                root[x.max(y) as usize] = x.min(y);
            }
        }
    }
    ctx.check()?;
    for p in 0..patches.count as u32 {
        root[p as usize] = merge::find(&mut root, p);
    }
    // Flat positions known from the coarse charts, by vertex and patch.
    let mut known: HashMap<(u32, u32), [f64; 2]> = HashMap::new();
    for c in charts.list.iter().flatten() {
        for (&f, t) in c.faces.iter().zip(&c.tris) {
            for k in 0..3 {
                known
                    .entry((coarse.surface.tri[f as usize][k], coarse.label[f as usize]))
                    .or_insert(c.uv[t[k] as usize]);
            }
        }
    }
    ctx.check()?;
    let mut faces: Vec<Vec<u32>> = vec![Vec::new(); patches.count];
    let mut index_of = vec![NONE; s.faces()];
    for f in 0..s.faces() {
        if label[f] != NONE {
            let r = root[label[f] as usize] as usize;
            index_of[f] = faces[r].len() as u32;
            faces[r].push(f as u32);
        }
    }
    let done: Vec<(Vec<Chart>, Vec<Chart>)> = faces
        .into_par_iter()
        .filter(|f| !f.is_empty())
        .map(|faces| {
            if ctx.check().is_err() {
                return (Vec::new(), Vec::new());
            }
            let across = |e: u32| {
                let (f, k) = (e as usize / 3, e as usize % 3);
                let h = s.mate[f][k];
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
            let mut c = Chart::glue(s, faces, across);
            let own = root[label[c.faces[0] as usize] as usize];
            c.zip(s, |f| (label[f] != NONE && root[label[f] as usize] == own).then(|| index_of[f]));
            if flatten(s, &mut c, label, coarse, &known, ctx) {
                return clear(s, c, label, bound, ctx);
            }
            (Vec::new(), super::patch_charts(s, &c.faces, label, bound, ctx))
        })
        .collect();
    ctx.check()?;
    let (good, bad): (Vec<Vec<Chart>>, Vec<Vec<Chart>>) = done.into_iter().unzip();
    let mut good: Vec<Chart> = good.into_iter().flatten().collect();
    let bad: Vec<Chart> = bad.into_iter().flatten().collect();
    if bad.is_empty() {
        return Ok(good);
    }
    // What was taken off finds a chart again, the sound ones stay apart as the coarse surface had it.
    let settled = good.len();
    good.extend(bad);
    let mut again = Charts::new(s.faces(), good);
    again.settled[..settled].fill(true);
    merge::merge(s, &mut again, bound, ctx)?;
    Ok(again.list.into_iter().flatten().collect())
}

/// Takes patches off a flattened chart until no triangle is flipped and no vertex wound round twice, then until its borders touch nowhere. Returns
/// the sound charts, and those to be merged anew.
fn clear(s: &Surface, c: Chart, label: &[u32], bound: f64, ctx: &Context<'_>) -> (Vec<Chart>, Vec<Chart>) {
    let wrong = wrong(&c.tris, &c.uv);
    let mut off: Vec<u32> =
        c.faces.iter().zip(&wrong).filter(|w| *w.1).map(|w| label[*w.0 as usize]).collect();
    if off.is_empty() {
        return untangle(s, c, label, bound, ctx);
    }
    off.sort_unstable();
    off.dedup();
    let is_off = |f: u32| off.binary_search(&label[f as usize]).is_ok();
    let side: Vec<bool> = c.faces.iter().map(|&f| is_off(f)).collect();
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    for piece in super::cut(s, &c, &side) {
        if is_off(piece.faces[0]) || !turns_once(&piece.tris, &piece.uv, &[]) {
            bad.extend(super::patch_charts(s, &piece.faces, label, bound, ctx));
        } else {
            let (sound, rest) = untangle(s, piece, label, bound, ctx);
            good.extend(sound);
            bad.extend(rest);
        }
    }
    (good, bad)
}

/// Takes patches off a flattened chart until its borders touch nowhere (at full resolution the two sides of a narrow
/// slit may). Returns the sound charts, and those to be merged anew because they stretch too much or touch within a
/// patch.
fn untangle(s: &Surface, c: Chart, label: &[u32], bound: f64, ctx: &Context<'_>) -> (Vec<Chart>, Vec<Chart>) {
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    let mut open = vec![c];
    while let Some(mut c) = open.pop() {
        if ctx.check().is_err() {
            break;
        }
        let Some(pair) = touching(&c.tris, &c.uv, &c.border) else {
            c.over = over_area(s, &c, bound);
            c.waste = merge::waste(&c.uv, c.area);
            if c.over <= OVER * c.area {
                good.push(c);
            } else {
                bad.extend(super::patch_charts(s, &c.faces, label, bound, ctx));
            }
            continue;
        };
        let of = |i: u32| label[c.faces[i as usize] as usize];
        let [p, q] = pair.map(of);
        if p == q {
            bad.extend(super::patch_charts(s, &c.faces, label, bound, ctx));
            continue;
        }
        let size = |p: u32| (0..c.faces.len() as u32).filter(|&i| of(i) == p).count();
        let off = if (size(p), p) < (size(q), q) { p } else { q };
        let side: Vec<bool> = (0..c.faces.len() as u32).map(|i| of(i) == off).collect();
        open.extend(super::cut(s, &c, &side));
    }
    (good, bad)
}

/// Flattens a chart from the known positions as well as it goes; false if there are none.
fn flatten(
    s: &Surface,
    c: &mut Chart,
    label: &[u32],
    coarse: &Coarse,
    known: &HashMap<(u32, u32), [f64; 2]>,
    ctx: &Context<'_>,
) -> bool {
    let mut pinned = vec![false; c.vertices()];
    let mut placed = vec![false; c.vertices()];
    for (&f, t) in c.faces.iter().zip(&c.tris) {
        for k in 0..3 {
            let (v, i) = (s.tri[f as usize][k], t[k] as usize);
            if placed[i] {
                continue;
            }
            let at = coarse.parent[v as usize];
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
    let (mut rhs, mut work) = (Vec::new(), Vec::new());
    Graph::from_triangles(c.vertices(), &c.tris, &cotangents(&rest)).relax(
        &mut c.uv,
        &[],
        &pinned,
        RELAX,
        ctx,
    );
    let arap = if c.vertices() > DIRECT {
        Arap::iterative(&c.tris, rest, c.vertices(), ctx)
    } else {
        Arap::new(&c.tris, rest, &c.uv, &[], ctx)
    };
    for _ in 0..3 {
        for _ in 0..STEPS {
            arap.step(&c.tris, &mut c.uv, &[], &mut rhs, &mut work);
        }
        if all_positive(&c.tris, &c.uv) {
            break;
        }
    }
    true
}
