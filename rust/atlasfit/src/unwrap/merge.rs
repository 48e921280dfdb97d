//! Bottom-up merging of charts: neighbours become one chart while the merged flattening stays within the bound.
//!
//! In: flattened charts. Out: fewer flattened charts. Each round matches neighbours by how much of the smaller
//! one's border a merge removes, flattens the merged pairs in parallel, and keeps those that stretch little enough
//! and are injective. Where the bound is loose, what the whole surface may stretch beyond it is then spent on charts that do so on more than their
//! share.

use super::chart::Chart;
use super::dirichlet;
use super::flatten::{Arap, all_positive, corners, over_area, stretch, twice_area};
use super::inject::{border_touches, injective, turns_once};
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Most local-global iterations spent on testing one merge.
const STEPS: usize = 14;
/// Share of a chart's area that may be stretched beyond the bound: the bound is a 95th percentile.
const OVER: f64 = 0.05;
/// The same for charts that are merged at the others' expense, and the share of all that may be stretched beyond the bound which is spent on them.
const OVER_SPENT: f64 = 0.6;
const SPENT: f64 = 0.95;

/// Largest squared gap, relative to seam length times chart size, per squared stretch allowance, for which a merge
/// is tried at all. Of 760 merges tried beyond it on five shapes, 65 would have succeeded.
const MISMATCH: f64 = 1.44;

/// Times that all refusals are forgotten and tried again, plus one.
const PASSES: usize = 2;
/// Merges whose score is at least this share of the round's best are tried in the same round.
const FLOOR: f64 = 0.2;

/// Seam length that must be saved per hull area newly left empty (the surface has area 1). Larger means more, rounder
/// charts that pack better: on 20 test shapes 8, 18, 27, 40 gave 0.37, 0.43, 0.48, 0.51 of a peer's charts, 0.66,
/// 0.70, 0.71, 0.71 of its seams and 0.97, 1.00, 1.05, 1.06 of its coverage. Who allows more stretch than `USUAL` wants
/// fewer charts, whatever they waste.
const WASTE: f64 = 36.0;
const USUAL: f64 = 1.1;

/// Squared length of the longest chart that fits on a page without making it larger, some way to its diagonal.
const PAGE: f64 = 2.0;

/// Beyond this stretch bound what as-rigid-as-possible steps turn over is tried without flips, at some cost; within it hardly anything comes of it.
const LOOSE: f64 = 1.35;
/// The same for charts of at most this many faces: larger ones take seconds, for crumbs at their borders.
const HARD_FACES: usize = 20_000;

/// How far into the larger chart a merge may move vertices, in square roots of the smaller chart's area.
const REACH: f64 = 1.5;

/// Charts and who owns which face.
pub(super) struct Charts {
    pub list: Vec<Option<Chart>>,
    pub owner: Vec<u32>,
    pub index_of: Vec<u32>,
    /// Charts that are not merged with each other.
    pub settled: Vec<bool>,
}

impl Charts {
    /// Numbers the charts of a surface of `faces` faces, of which they need not cover all.
    pub(super) fn new(faces: usize, charts: Vec<Chart>) -> Self {
        let (mut owner, mut index_of) = (vec![NONE; faces], vec![NONE; faces]);
        for (id, c) in charts.iter().enumerate() {
            for (i, &f) in c.faces.iter().enumerate() {
                owner[f as usize] = id as u32;
                index_of[f as usize] = i as u32;
            }
        }
        let settled = vec![false; charts.len()];
        Self { list: charts.into_iter().map(Some).collect(), owner, index_of, settled }
    }

    /// Replaces charts `a` and `b` by `merged`; returns its id.
    fn replace(&mut self, a: u32, b: u32, merged: Chart) -> u32 {
        let id = self.list.len() as u32;
        self.list[a as usize] = None;
        self.list[b as usize] = None;
        for (i, &f) in merged.faces.iter().enumerate() {
            self.owner[f as usize] = id;
            self.index_of[f as usize] = i as u32;
        }
        self.list.push(Some(merged));
        self.settled.push(self.settled[a as usize] || self.settled[b as usize]);
        id
    }
}

#[derive(Clone, Copy)]
struct Shared {
    /// Chart-local end points in the first chart, and the same points in the second.
    a: [u32; 2],
    b: [u32; 2],
    length: f64,
}

/// Every border edge between two charts, as (chart, chart, length), the smaller number first, sorted; and the charts' perimeters.
fn neighbours(s: &Surface, charts: &Charts) -> (Vec<(u32, u32, f64)>, Vec<f64>) {
    let mut pairs: Vec<(u32, u32, f64)> = Vec::new();
    let mut perimeter = vec![0f64; charts.list.len()];
    for (id, chart) in charts.list.iter().enumerate() {
        let Some(chart) = chart else { continue };
        for &(i, k) in &chart.border {
            let f = chart.faces[i as usize] as usize;
            let l = f64::from(s.length[f][k as usize]);
            perimeter[id] += l;
            let h = s.twin[f][k as usize];
            if h != NONE {
                let other = charts.owner[h as usize / 3];
                if other > id as u32 && other != NONE {
                    pairs.push((id as u32, other, l));
                }
            }
        }
    }
    pairs.sort_by_key(|p| (p.0, p.1));
    (pairs, perimeter)
}

/// Merges until nothing fits any more.
pub(super) fn merge(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    // Partners that each chart was refused with.
    let mut failed: Vec<Vec<u32>> = vec![Vec::new(); charts.list.len()];
    let mut passes = 1;
    loop {
        ctx.check()?;
        let (pairs, perimeter) = neighbours(s, charts);
        ctx.check()?;
        let mut scored: Vec<(f64, u32, u32)> = Vec::new();
        for p in pairs.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            let (a, b) = (p[0].0, p[0].1);
            if failed[a as usize].contains(&b) || charts.settled[a as usize] && charts.settled[b as usize] {
                continue;
            }
            let shared: f64 = p.iter().map(|p| p.2).sum();
            let (pa, pb) = (perimeter[a as usize], perimeter[b as usize]);
            let (x, y) = (
                charts.list[a as usize].as_ref().map_or(0.0, |c| c.area),
                charts.list[b as usize].as_ref().map_or(0.0, |c| c.area),
            );
            // Half way between the share of the smaller one's border and the length against its size.
            let score = shared / (pa.min(pb) * x.min(y).sqrt()).max(1e-300).sqrt();
            scored.push((score, a, b));
        }
        if scored.is_empty() {
            // Refusals were handed down while charts grew; with all grown, each is tried afresh once.
            if passes == PASSES {
                return Ok(());
            }
            passes += 1;
            failed.iter_mut().for_each(Vec::clear);
            continue;
        }
        scored.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        // Only near-best pairs now: the next round sees what they leave.
        let floor = scored[0].0 * FLOOR;
        let mut busy = vec![false; charts.list.len()];
        let mut chosen = Vec::new();
        for &(score, a, b) in &scored {
            if score < floor {
                break;
            }
            if !busy[a as usize] && !busy[b as usize] {
                busy[a as usize] = true;
                busy[b as usize] = true;
                chosen.push((a, b));
            }
        }
        // Whether to try hard: once nothing else fits, and where stretch is allowed.
        let goal = Goal { bound, over: OVER, hard: passes == PASSES && bound > LOOSE };
        let results: Vec<Option<Chart>> = chosen
            .par_iter()
            .map(|&(a, b)| {
                if ctx.check().is_err() {
                    return None;
                }
                join_two(s, charts, a, b, goal, ctx)
            })
            .collect();
        ctx.check()?;
        for (&(a, b), result) in chosen.iter().zip(results) {
            match result {
                Some(merged) => {
                    let id = charts.replace(a, b, merged);
                    // A neighbour that did not fit one half, and does not touch the other or does not fit it
                    // either, will not fit the whole.
                    let touches = |x: u32, y: u32| {
                        let key = (x.min(y), x.max(y));
                        pairs.binary_search_by(|p| (p.0, p.1).cmp(&key)).is_ok()
                    };
                    let mut refused = std::mem::take(&mut failed[a as usize]);
                    let other = std::mem::take(&mut failed[b as usize]);
                    refused.retain(|&p| other.contains(&p) || !touches(p, b));
                    refused.extend(other.into_iter().filter(|&p| !touches(p, a)));
                    refused.sort_unstable();
                    refused.dedup();
                    for &p in &refused {
                        failed[p as usize].push(id);
                    }
                    failed.push(refused);
                }
                None => {
                    failed[a as usize].push(b);
                    failed[b as usize].push(a);
                }
            }
        }
    }
}

/// Merges charts of small meshes that stretch beyond the bound on too much of their own area, but not of all area: the bound is one for the whole
/// surface. What costs least of that goes first.
pub(super) fn spend(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    if bound <= LOOSE {
        return Ok(());
    }
    let goal = Goal { bound, over: OVER_SPENT, hard: true };
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
    left += SPENT * OVER * area;
    // What was tried: the merged chart, or that it does not fit.
    let mut tried: FxHashMap<(u32, u32), Option<Chart>> = FxHashMap::default();
    loop {
        ctx.check()?;
        let (pairs, _) = neighbours(s, charts);
        let mut fresh: Vec<(u32, u32)> = pairs.iter().map(|p| (p.0, p.1)).collect();
        fresh.dedup();
        fresh.retain(|p| !tried.contains_key(p));
        let results: Vec<Option<Chart>> = (fresh.par_iter())
            .map(|&(a, b)| ctx.check().ok().and_then(|()| join_two(s, charts, a, b, goal, ctx)))
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

/// What a merge must hold.
#[derive(Clone, Copy)]
struct Goal {
    /// The stretch bound.
    bound: f64,
    /// Share of the merged chart's area that may be beyond it.
    over: f64,
    /// Whether to flatten without flips what as-rigid-as-possible steps do not manage.
    hard: bool,
}

/// [`join`] for charts by their numbers.
fn join_two(s: &Surface, charts: &Charts, a: u32, b: u32, goal: Goal, ctx: &Context<'_>) -> Option<Chart> {
    let (x, y) = (charts.list[a as usize].as_ref()?, charts.list[b as usize].as_ref()?);
    if x.faces.len() >= y.faces.len() {
        join(s, charts, x, y, b, goal, ctx)
    } else {
        join(s, charts, y, x, a, goal, ctx)
    }
}

/// Tries to make one chart of two; `None` if it would stretch or overlap too much.
fn join(
    s: &Surface,
    charts: &Charts,
    a: &Chart,
    b: &Chart,
    b_id: u32,
    goal: Goal,
    ctx: &Context<'_>,
) -> Option<Chart> {
    let mut shared = Vec::new();
    for &(i, k) in &a.border {
        let h = s.twin[a.faces[i as usize] as usize][k as usize];
        if h != NONE && charts.owner[h as usize / 3] == b_id {
            let (t, j) = (a.tris[i as usize], k as usize);
            let (u, l) = (b.tris[charts.index_of[h as usize / 3] as usize], h as usize % 3);
            shared.push(Shared {
                a: [t[j], t[(j + 1) % 3]],
                b: [u[(l + 1) % 3], u[l]],
                length: f64::from(s.length[a.faces[i as usize] as usize][k as usize]),
            });
        }
    }
    let paths = paths(&shared);
    if paths.len() > 1 {
        let (motion, rms) = align(a, b, &shared);
        if rms < 0.05 * a.area.min(b.area).sqrt()
            && let Some(c) = glue(s, charts, a, b, (&shared, motion), goal, ctx)
        {
            return Some(c);
        }
    }
    let best = paths.into_iter().max_by(|x, y| {
        let l = |p: &[Shared]| p.iter().map(|e| e.length).sum::<f64>();
        l(x).total_cmp(&l(y))
    })?;
    let (motion, rms) = align(a, b, &best);
    let length: f64 = best.iter().map(|e| e.length).sum();
    // The gap that rigid motion leaves, against the size of what must stretch to close it.
    if rms * rms > MISMATCH * (goal.bound - 1.0).powi(2) * length * a.area.min(b.area).sqrt() {
        return None;
    }
    glue(s, charts, a, b, (&best, motion), goal, ctx)
}

/// Connected runs of shared edges.
fn paths(shared: &[Shared]) -> Vec<Vec<Shared>> {
    let mut ends: Vec<((u32, u32), u32)> = Vec::with_capacity(shared.len() * 2);
    for (i, e) in shared.iter().enumerate() {
        ends.push(((e.a[0], e.b[0]), i as u32));
        ends.push(((e.a[1], e.b[1]), i as u32));
    }
    ends.sort_unstable();
    let mut root: Vec<u32> = (0..shared.len() as u32).collect();
    for w in ends.windows(2) {
        if w[0].0 == w[1].0 {
            let (x, y) = (find(&mut root, w[0].1), find(&mut root, w[1].1));
            root[x.max(y) as usize] = x.min(y);
        }
    }
    let mut out: Vec<(u32, Vec<Shared>)> = Vec::new();
    for (i, e) in shared.iter().enumerate() {
        let r = find(&mut root, i as u32);
        match out.iter_mut().find(|o| o.0 == r) {
            Some(o) => o.1.push(*e),
            None => out.push((r, vec![*e])),
        }
    }
    out.into_iter().map(|o| o.1).collect()
}

/// A planar rigid motion: rotation (c, s), then translation.
type Motion = [f64; 4];

fn moved(m: Motion, p: [f64; 2]) -> [f64; 2] {
    [m[0] * p[0] - m[1] * p[1] + m[2], m[1] * p[0] + m[0] * p[1] + m[3]]
}

/// The rigid motion that lays b's side of the shared edges on a's, and the root mean square distance left.
fn align(a: &Chart, b: &Chart, shared: &[Shared]) -> (Motion, f64) {
    let points = || {
        shared
            .iter()
            .flat_map(|e| [0, 1].map(|k| (a.uv[e.a[k] as usize], b.uv[e.b[k] as usize], e.length.max(1e-12))))
    };
    let (mut ca, mut cb, mut w) = ([0.0; 2], [0.0; 2], 0.0);
    for (p, q, l) in points() {
        for k in 0..2 {
            ca[k] += l * p[k];
            cb[k] += l * q[k];
        }
        w += l;
    }
    let (ca, cb) = (ca.map(|x| x / w), cb.map(|x| x / w));
    let (mut c, mut d) = (0.0, 0.0);
    for (p, q, l) in points() {
        let (p, q) = ([p[0] - ca[0], p[1] - ca[1]], [q[0] - cb[0], q[1] - cb[1]]);
        c += l * (q[0] * p[0] + q[1] * p[1]);
        d += l * (q[0] * p[1] - q[1] * p[0]);
    }
    let n = (c * c + d * d).sqrt();
    let (c, d) = if n > 0.0 { (c / n, d / n) } else { (1.0, 0.0) };
    let m = [c, d, ca[0] - c * cb[0] + d * cb[1], ca[1] - d * cb[0] - c * cb[1]];
    let rest: f64 = points()
        .map(|(p, q, l)| {
            let q = moved(m, q);
            l * ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2))
        })
        .sum();
    (m, (rest / w).sqrt())
}

/// The part of a merge that is solved: all of b, and what of a lies near the shared edges. Vertices of a further
/// away are pinned. A small chart is so tested at its own cost, not at the large one's.
struct Patch {
    /// Faces of a that take part, then all of b, as places in the charts.
    near: Vec<u32>,
    tris: Vec<[u32; 3]>,
    rest: Vec<[f64; 3]>,
    area: Vec<f64>,
    uv: Vec<[f64; 2]>,
    pinned: Vec<bool>,
    /// Patch vertex of each vertex of a ([`NONE`] if not taking part) and of b.
    of_a: Vec<u32>,
    of_b: Vec<u32>,
}

/// The representative of `i` in a union-find forest.
pub(super) fn find(root: &mut [u32], mut i: u32) -> u32 {
    while root[i as usize] != i {
        root[i as usize] = root[root[i as usize] as usize];
        i = root[i as usize];
    }
    i
}

/// Lays out the patch: b moved onto a, glued vertices averaged. `None` if a triangle would collapse.
fn patch(s: &Surface, a: &Chart, b: &Chart, shared: &[Shared], motion: Motion) -> Option<Patch> {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for v in shared.iter().flat_map(|e| e.a) {
        for k in 0..2 {
            lo[k] = lo[k].min(a.uv[v as usize][k]);
            hi[k] = hi[k].max(a.uv[v as usize][k]);
        }
    }
    let margin = REACH * b.area.sqrt() + 0.2 * (hi[0] - lo[0] + hi[1] - lo[1]);
    let inside: Vec<bool> =
        a.uv.iter().map(|p| (0..2).all(|k| p[k] >= lo[k] - margin && p[k] <= hi[k] + margin)).collect();
    let mut near: Vec<u32> = (0..a.tris.len() as u32)
        .filter(|&i| a.tris[i as usize].iter().any(|&v| inside[v as usize]))
        .collect();
    let whole = near.len() * 10 > a.tris.len() * 7;
    if whole {
        near = (0..a.tris.len() as u32).collect();
    }
    // Number the vertices: first of a, then of b, then unite what is glued.
    let mut of_a = vec![NONE; a.vertices()];
    let mut uv = Vec::with_capacity(near.len() + b.vertices());
    let mut pinned = Vec::with_capacity(near.len() + b.vertices());
    for &i in &near {
        for &v in &a.tris[i as usize] {
            if of_a[v as usize] == NONE {
                of_a[v as usize] = uv.len() as u32;
                uv.push(a.uv[v as usize]);
                pinned.push(!whole && !inside[v as usize]);
            }
        }
    }
    let na = uv.len() as u32;
    uv.extend(b.uv.iter().map(|&p| moved(motion, p)));
    let mut root: Vec<u32> = (0..uv.len() as u32).collect();
    for e in shared {
        for k in 0..2 {
            let (x, y) = (find(&mut root, of_a[e.a[k] as usize]), find(&mut root, e.b[k] + na));
            root[x.max(y) as usize] = x.min(y);
        }
    }
    let mut name = vec![NONE; uv.len()];
    let mut merged: Vec<[f64; 2]> = Vec::with_capacity(uv.len());
    let mut members: Vec<f64> = Vec::with_capacity(uv.len());
    let mut pins = Vec::with_capacity(uv.len());
    for i in 0..uv.len() as u32 {
        let r = find(&mut root, i) as usize;
        if name[r] == NONE {
            name[r] = merged.len() as u32;
            merged.push([0.0; 2]);
            members.push(0.0);
            pins.push(i < na && pinned[i as usize]);
        }
        let q = name[r] as usize;
        name[i as usize] = q as u32;
        merged[q] = [merged[q][0] + uv[i as usize][0], merged[q][1] + uv[i as usize][1]];
        members[q] += 1.0;
    }
    for (p, m) in merged.iter_mut().zip(&members) {
        *p = p.map(|x| x / m);
    }
    for v in of_a.iter_mut().filter(|v| **v != NONE) {
        *v = name[*v as usize];
    }
    let of_b: Vec<u32> = (0..b.vertices()).map(|v| name[v + na as usize]).collect();
    let tris: Vec<[u32; 3]> = near
        .iter()
        .map(|&i| a.tris[i as usize].map(|v| of_a[v as usize]))
        .chain(b.tris.iter().map(|t| t.map(|v| of_b[v as usize])))
        .collect();
    if tris.iter().any(|t| t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
        return None;
    }
    let faces = || near.iter().map(|&i| a.faces[i as usize]).chain(b.faces.iter().copied());
    Some(Patch {
        rest: faces().map(|f| s.rest[f as usize]).collect(),
        area: faces().map(|f| s.area[f as usize]).collect(),
        near,
        tris,
        uv: merged,
        pinned: pins,
        of_a,
        of_b,
    })
}

/// Joins two charts along given edges, if the result stretches little enough and is injective.
fn glue(
    s: &Surface,
    charts: &Charts,
    a: &Chart,
    b: &Chart,
    (shared, motion): (&[Shared], Motion),
    goal: Goal,
    ctx: &Context<'_>,
) -> Option<Chart> {
    let bound = goal.bound;
    let mut p = patch(s, a, b, shared, motion)?;
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
    let allowed = goal.over * area - far;
    ctx.check().ok()?;
    let arap = Arap::new(&p.tris, p.rest.clone(), &p.uv, &p.pinned, ctx);
    let (mut rhs, mut work) = (Vec::new(), Vec::new());
    let mut last = f64::INFINITY;
    for step in 0..STEPS {
        arap.step(&p.tris, &mut p.uv, &p.pinned, &mut rhs, &mut work);
        ctx.check().ok()?;
        if step % 3 != 1 && step + 1 != STEPS {
            continue;
        }
        let now = over(&p);
        let positive = all_positive(&p.tris, &p.uv);
        if now <= allowed && positive {
            let mut c = assemble(s, charts, a, b, &p)?;
            c.over = far + now;
            c.waste = waste(&c);
            let c = worth(c, a, b, shared, bound)?;
            let sound = turns_once(&p.tris, &p.uv, &p.pinned) && !border_touches(&c.tris, &c.uv, &c.border);
            return sound.then_some(c);
        }
        // Hopeless: far too stretched, or hardly getting better. Success nearly always shows at once.
        let hope = if step == 1 { 5.0 } else { 2.0 };
        if now > hope * allowed || now > 0.9 * last || (step > 1 && !positive) {
            break;
        }
        last = now;
    }
    if !goal.hard || a.faces.len() + b.faces.len() > HARD_FACES {
        return None;
    }
    // Without flips from the start, at the cost of the whole chart.
    let c = flattened(s, assemble(s, charts, a, b, &p)?, bound, ctx)?;
    worth(c, a, b, shared, bound).filter(|c| c.over <= goal.over * c.area)
}

/// The chart with positions of least symmetric Dirichlet energy, if it then overlaps nowhere.
fn flattened(s: &Surface, mut c: Chart, bound: f64, ctx: &Context<'_>) -> Option<Chart> {
    c.uv = dirichlet::flatten(&c.tris, &c.rest(s), &c.border, c.vertices(), bound, ctx)?;
    c.over = over_area(s, &c, bound);
    c.waste = waste(&c);
    injective(&c.tris, &c.uv, &c.border).then_some(c)
}

/// The merged chart, if the seam it saves is worth what it wastes of the page.
fn worth(c: Chart, a: &Chart, b: &Chart, shared: &[Shared], bound: f64) -> Option<Chart> {
    let weight = WASTE * ((USUAL - 1.0) / (bound - 1.0)).min(1.0).powi(2);
    let worth = weight * (c.waste - a.waste - b.waste) < shared.iter().map(|e| e.length).sum::<f64>();
    worth.then_some(c)
}

/// The merged chart, with the patch's positions.
fn assemble(s: &Surface, charts: &Charts, a: &Chart, b: &Chart, p: &Patch) -> Option<Chart> {
    let mut of_patch = vec![NONE; p.uv.len()];
    let mut uv = Vec::with_capacity(a.vertices() + b.vertices());
    let mut name = |q: u32, alone: [f64; 2]| {
        if q == NONE {
            uv.push(alone);
            return uv.len() as u32 - 1;
        }
        if of_patch[q as usize] == NONE {
            of_patch[q as usize] = uv.len() as u32;
            uv.push(p.uv[q as usize]);
        }
        of_patch[q as usize]
    };
    let of_a: Vec<u32> = p.of_a.iter().zip(&a.uv).map(|(&q, &u)| name(q, u)).collect();
    let of_b: Vec<u32> = p.of_b.iter().map(|&q| name(q, [0.0; 2])).collect();
    let offset = a.faces.len() as u32;
    let mut c = Chart {
        faces: a.faces.iter().chain(&b.faces).copied().collect(),
        tris: (a.tris.iter().map(|t| t.map(|v| of_a[v as usize])))
            .chain(b.tris.iter().map(|t| t.map(|v| of_b[v as usize])))
            .collect(),
        uv,
        border: Vec::new(),
        area: a.area + b.area,
        over: 0.0,
        waste: 0.0,
    };
    c.border = a.border.iter().copied().chain(b.border.iter().map(|&(i, k)| (i + offset, k))).collect();
    let ids = [charts.owner[a.faces[0] as usize], charts.owner[b.faces[0] as usize]];
    c.zip(s, |f| match charts.owner[f] {
        o if o == ids[0] => Some(charts.index_of[f]),
        o if o == ids[1] => Some(charts.index_of[f] + offset),
        _ => None,
    });
    (!c.border.is_empty()).then_some(c)
}

/// What a chart wastes when packed, roughly: the area of its convex hull that it leaves empty, and what it makes the
/// page larger by being longer than the page.
pub(super) fn waste(c: &Chart) -> f64 {
    let hull = super::pack::hull(&c.outline());
    let of_hull: f64 =
        (0..hull.len()).map(|i| twice_area(hull[0], hull[i], hull[(i + 1) % hull.len()])).sum::<f64>() * 0.5;
    let longest =
        (hull.iter().flat_map(|p| hull.iter().map(|q| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2))))
            .fold(0.0, f64::max);
    (of_hull - c.area).max(0.0) + (longest / PAGE - 1.0).max(0.0)
}
