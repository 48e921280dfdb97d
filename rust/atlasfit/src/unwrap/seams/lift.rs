//! Cuts of a coarse stand-in on the surface that it stands for.
//!
//! In: a layout of the stand-in, whose vertices are some of the surface's. Out: one of the surface, whose
//! cuts run along the shortest ways between the same vertices.

use super::sheet::{Layout, Sheet};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::paths::{Step, shortest_seen};
use crate::spatial::sets::Sets;
use crate::unwrap::surface::NONE;
use rustc_hash::FxHashMap;

/// The same cuts on the full sheet, laid flat; `None` where they do not make a disk of it.
pub(super) fn lifted(
    small: &Sheet<'_>,
    found: &Layout,
    sheet: &Sheet<'_>,
    ctx: &Context<'_>,
) -> Result<Option<Layout>> {
    let home: FxHashMap<u32, u32> =
        sheet.vertex.iter().enumerate().map(|(i, &v)| (v, i as u32)).rev().collect();
    let mut cut = vec![false; sheet.ends.len()];
    for (ends, _) in small.ends.iter().zip(&found.cut).filter(|c| *c.1) {
        let [Some(&a), Some(&b)] = ends.map(|v| home.get(&small.vertex[v as usize])) else {
            return Ok(None);
        };
        for e in shortest(sheet, a, b, &cut, ctx)? {
            cut[e as usize] = true;
        }
    }
    whole(sheet, &mut cut, ctx)?;
    joined(sheet, &mut cut, ctx)?;
    let out = sheet.fresh(cut, ctx);
    ctx.check()?;
    Ok(out)
}

/// The shortest way between two vertices; edges that are cut already cost little.
fn shortest(sheet: &Sheet<'_>, a: u32, b: u32, cut: &[bool], ctx: &Context<'_>) -> Result<Vec<u32>> {
    let steps = |v: u32| {
        sheet.near(v).iter().map(move |&e| {
            let length = sheet.length[e as usize] * if cut[e as usize] { 0.1 } else { 1.0 };
            Step { to: sheet.other(e, v), length, by: e }
        })
    };
    let from = std::iter::once(a);
    let reached = shortest_seen(from, steps, |v| v == b, ctx)?;
    let (mut v, mut out) = (b, Vec::new());
    while let Some(&(_, e)) = reached.get(&v).filter(|r| r.1 != NONE) {
        out.push(e);
        v = sheet.other(e, v);
    }
    Ok(out)
}

/// Cuts between borders until all borders are one.
fn joined(sheet: &Sheet<'_>, cut: &mut [bool], ctx: &Context<'_>) -> Result<()> {
    let mut sets = Sets::new(sheet.vertices());
    for (t, across) in sheet.tris.iter().zip(&sheet.across) {
        (0..3).filter(|&k| across[k] == NONE).for_each(|k| sets.join(t[k], t[(k + 1) % 3]));
    }
    for (ends, _) in sheet.ends.iter().zip(&*cut).filter(|c| *c.1) {
        sets.join(ends[0], ends[1]);
    }
    loop {
        let on = sheet.opened(cut);
        let Some(first) = (0..on.len() as u32).find(|&v| on[v as usize]) else { return Ok(()) };
        let own: Vec<bool> =
            (0..on.len() as u32).map(|v| on[v as usize] && sets.find(v) == sets.find(first)).collect();
        let (distance, by) = sheet.distances(&own, ctx)?;
        let others = (0..on.len()).filter(|&v| on[v] && !own[v] && distance[v].is_finite());
        let Some(near) = others.min_by(|&v, &w| distance[v].total_cmp(&distance[w])) else { return Ok(()) };
        for e in sheet.path(near as u32, &by) {
            cut[e as usize] = true;
            sets.join(sheet.ends[e as usize][0], sheet.ends[e as usize][1]);
        }
    }
}

/// Closes cuts, the longest first, that part the sheet.
fn whole(sheet: &Sheet<'_>, cut: &mut [bool], ctx: &Context<'_>) -> Result<()> {
    let mut sets = Sets::new(sheet.faces.len());
    let mut closed: Vec<u32> = Vec::new();
    for e in 0..sheet.ends.len() as u32 {
        ctx.check_at(e as usize)?;
        if cut[e as usize] {
            closed.push(e);
        } else {
            let [f, g] = sheet.sides(e);
            sets.join(f, g);
        }
    }
    closed.sort_by(|&a, &b| sheet.length[b as usize].total_cmp(&sheet.length[a as usize]).then(a.cmp(&b)));
    for e in closed {
        let [f, g] = sheet.sides(e);
        if sets.find(f) != sets.find(g) {
            sets.join(f, g);
            cut[e as usize] = false;
        }
    }
    Ok(())
}
