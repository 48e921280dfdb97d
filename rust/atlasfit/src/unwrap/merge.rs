//! Bottom-up merging of charts: neighbours become one chart while the merged flattening stays within the bound.
//!
//! In: flattened charts. Out: fewer flattened charts. Each round matches neighbours by how much of the smaller
//! one's border a merge removes, flattens the merged pairs in parallel, and keeps those that stretch little enough
//! and are injective.

use super::chart::Chart;
use super::flatten::{Arap, all_positive, over_area};
use super::inject::injective;
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use std::collections::HashSet;

/// Most local-global iterations spent on testing one merge.
const STEPS: usize = 14;
/// Share of a chart's area that may be stretched beyond the bound: the bound is a 95th percentile.
const OVER: f64 = 0.05;

/// Charts and who owns which face.
pub(super) struct Charts {
    pub list: Vec<Option<Chart>>,
    pub owner: Vec<u32>,
    pub index_of: Vec<u32>,
}

impl Charts {
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

/// Merges until nothing fits any more.
pub(super) fn merge(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    let mut failed: HashSet<(u32, u32)> = HashSet::new();
    loop {
        ctx.check()?;
        let mut pairs: Vec<(u32, u32, f64)> = Vec::new();
        let mut perimeter = vec![0f64; charts.list.len()];
        for (id, chart) in charts.list.iter().enumerate() {
            let Some(chart) = chart else { continue };
            for &(i, k) in &chart.border {
                let f = chart.faces[i as usize] as usize;
                let l = f64::from(s.length[f][k as usize]);
                perimeter[id] += l;
                let h = s.mate[f][k as usize];
                if h != NONE {
                    let other = charts.owner[h as usize / 3];
                    if other > id as u32 && other != NONE {
                        pairs.push((id as u32, other, l));
                    }
                }
            }
        }
        pairs.sort_by_key(|p| (p.0, p.1));
        let mut scored: Vec<(f64, u32, u32)> = Vec::new();
        for p in pairs.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            let (a, b) = (p[0].0, p[0].1);
            if failed.contains(&(a, b)) {
                continue;
            }
            let shared: f64 = p.iter().map(|p| p.2).sum();
            scored.push((shared / perimeter[a as usize].min(perimeter[b as usize]).max(1e-300), a, b));
        }
        if scored.is_empty() {
            return Ok(());
        }
        scored.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        // Only near-best pairs now: the next round sees what they leave.
        let floor = scored[0].0 * 0.6;
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
        let results: Vec<Option<Chart>> = chosen
            .par_iter()
            .map(|&(a, b)| {
                if ctx.check().is_err() {
                    return None;
                }
                let (x, y) = (charts.list[a as usize].as_ref()?, charts.list[b as usize].as_ref()?);
                join(s, charts, x, y, b, bound)
            })
            .collect();
        ctx.check()?;
        if std::env::var("UWDBG").is_ok() {
            let sz = |x: u32| charts.list[x as usize].as_ref().map_or(0, |c| c.faces.len());
            eprintln!(
                "round alive {} pairs {} chosen {} ok {} faces-ok {} faces-fail {}",
                charts.list.iter().flatten().count(),
                scored.len(),
                chosen.len(),
                results.iter().flatten().count(),
                chosen.iter().zip(&results).filter(|x| x.1.is_some()).map(|x| sz(x.0.0) + sz(x.0.1)).sum::<usize>(),
                chosen.iter().zip(&results).filter(|x| x.1.is_none()).map(|x| sz(x.0.0) + sz(x.0.1)).sum::<usize>(),
            );
        }
        for (&(a, b), result) in chosen.iter().zip(results) {
            match result {
                Some(merged) => {
                    charts.replace(a, b, merged);
                }
                None => {
                    failed.insert((a, b));
                }
            }
        }
    }
}

/// Tries to make one chart of two; `None` if it would stretch or overlap too much.
fn join(s: &Surface, charts: &Charts, a: &Chart, b: &Chart, b_id: u32, bound: f64) -> Option<Chart> {
    let mut shared = Vec::new();
    for &(i, k) in &a.border {
        let h = s.mate[a.faces[i as usize] as usize][k as usize];
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
            && let Some(c) = glue(s, charts, a, b, &shared, motion, bound)
        {
            return Some(c);
        }
    }
    let best = paths.into_iter().max_by(|x, y| {
        let l = |p: &[Shared]| p.iter().map(|e| e.length).sum::<f64>();
        l(x).total_cmp(&l(y))
    })?;
    let (motion, _) = align(a, b, &best);
    glue(s, charts, a, b, &best, motion, bound)
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
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
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

/// Joins two charts along given edges and flattens the result.
fn glue(
    s: &Surface,
    charts: &Charts,
    a: &Chart,
    b: &Chart,
    shared: &[Shared],
    motion: Motion,
    bound: f64,
) -> Option<Chart> {
    let na = a.vertices() as u32;
    let n = a.vertices() + b.vertices();
    let mut root: Vec<u32> = (0..n as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for e in shared {
        for k in 0..2 {
            let (x, y) = (find(&mut root, e.a[k]), find(&mut root, e.b[k] + na));
            root[x.max(y) as usize] = x.min(y);
        }
    }
    let mut name = vec![NONE; n];
    let mut uv: Vec<[f64; 2]> = Vec::with_capacity(n);
    let mut members: Vec<f64> = Vec::with_capacity(n);
    for i in 0..n as u32 {
        let r = find(&mut root, i) as usize;
        let p = if i < na { a.uv[i as usize] } else { moved(motion, b.uv[(i - na) as usize]) };
        if name[r] == NONE {
            name[r] = uv.len() as u32;
            uv.push(p);
            members.push(1.0);
        } else {
            let q = name[r] as usize;
            uv[q] = [uv[q][0] + p[0], uv[q][1] + p[1]];
            members[q] += 1.0;
        }
        name[i as usize] = name[r];
    }
    for (p, m) in uv.iter_mut().zip(&members) {
        *p = p.map(|x| x / m);
    }
    let offset = a.faces.len() as u32;
    let mut c = Chart {
        faces: a.faces.iter().chain(&b.faces).copied().collect(),
        tris: a
            .tris
            .iter()
            .map(|t| t.map(|v| name[v as usize]))
            .chain(b.tris.iter().map(|t| t.map(|v| name[(v + na) as usize])))
            .collect(),
        uv,
        border: Vec::new(),
        area: a.area + b.area,
        over: 0.0,
    };
    // Edges whose two sides now have the same end points are inside.
    let ids = [charts.owner[a.faces[0] as usize], charts.owner[b.faces[0] as usize]];
    let place = |f: usize| {
        let o = charts.owner[f];
        if o == ids[0] {
            charts.index_of[f]
        } else if o == ids[1] {
            charts.index_of[f] + offset
        } else {
            NONE
        }
    };
    let both = a.border.iter().copied().chain(b.border.iter().map(|&(i, k)| (i + offset, k)));
    for (i, k) in both {
        let h = s.mate[c.faces[i as usize] as usize][k as usize];
        let inside = h != NONE && {
            let j = place(h as usize / 3);
            j != NONE && {
                let (t, u) = (c.tris[i as usize], c.tris[j as usize]);
                let (k, l) = (k as usize, h as usize % 3);
                t[k] == u[(l + 1) % 3] && t[(k + 1) % 3] == u[l]
            }
        };
        if !inside {
            c.border.push((i, k));
        }
    }
    if c.border.is_empty() || c.tris.iter().any(|t| t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
        return None;
    }
    let arap = Arap::new(&c.tris, c.rest(s), &c.uv);
    let (mut rhs, mut work) = (Vec::new(), Vec::new());
    let allowed = OVER * c.area;
    for step in 0..STEPS {
        arap.step(&c.tris, &mut c.uv, &mut rhs, &mut work);
        if step % 3 == 1 || step + 1 == STEPS {
            c.over = over_area(s, &c, bound);
            if c.over <= allowed && all_positive(&c.tris, &c.uv) {
                return injective(&c.tris, &c.uv, &c.border).then_some(c);
            }
            if c.over > 0.6 * c.area {
                return None;
            }
        }
    }
    None
}
