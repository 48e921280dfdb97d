//! Charts cut in pieces.
//!
//! In: a chart and a side per face. Out: charts of the connected faces of one side. No polygon is cut where
//! that can be avoided.

use super::chart::Chart;
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;

/// Widens `side` so that it cuts no cell, if a cut is left then; a `side` that holds all faces becomes every
/// other one.
pub(crate) fn whole_cells(s: &Surface, faces: &[u32], side: Vec<bool>) -> Vec<bool> {
    let mut marked: Vec<u32> = faces.iter().zip(&side).filter(|f| *f.1).map(|f| s.cell(*f.0)).collect();
    marked.sort_unstable();
    let wide: Vec<bool> = faces.iter().map(|&f| marked.binary_search(&s.cell(f)).is_ok()).collect();
    let cuts = |side: &[bool]| side.iter().any(|&b| b) && !side.iter().all(|&b| b);
    if cuts(&wide) {
        wide
    } else if cuts(&side) {
        side
    } else {
        (0..side.len()).map(|i| i % 2 == 0).collect()
    }
}

/// Half of the faces, those of least `x` (of a place among them), without cutting a cell where there are
/// several.
pub(crate) fn halves(s: &Surface, faces: &[u32], x: impl Fn(usize) -> f64) -> Vec<bool> {
    // A cell lies where its first face lies.
    let mut first: Vec<(u32, f64)> = faces.iter().enumerate().map(|(i, &f)| (s.cell(f), x(i))).collect();
    first.sort_by_key(|c| c.0);
    first.dedup_by_key(|c| c.0);
    let one = first.len() == 1;
    let key = |i: usize| match first.binary_search_by_key(&s.cell(faces[i]), |c| c.0) {
        Ok(c) if !one => (first[c].1, first[c].0),
        _ => (x(i), faces[i]),
    };
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by(|&i, &j| {
        let (a, b) = (key(i), key(j));
        a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(i.cmp(&j))
    });
    // The first place at or behind the middle, or else before it, where another cell begins.
    let begins = |k: &usize| one || key(order[*k]).1 != key(order[*k - 1]).1;
    let half = (order.len() / 2).max(1);
    let at = (half..order.len()).find(begins).or_else(|| (1..half).rev().find(begins)).unwrap_or(half);
    let mut side = vec![false; order.len()];
    order[..at].iter().for_each(|&i| side[i] = true);
    side
}

/// For each edge of a chart's faces, the place in the chart of the face beyond it; [`NONE`] at its border.
pub(crate) fn adjacent_faces(s: &Surface, c: &Chart, ctx: &Context<'_>) -> Result<Vec<[u32; 3]>> {
    // Zeros cost nothing until they are written over, however large the surface.
    let mut place = vec![0u32; s.faces()];
    for (i, &f) in c.faces.iter().enumerate() {
        ctx.check_at(i)?;
        place[f as usize] = i as u32;
    }
    let mut out = vec![[0; 3]; c.faces.len()];
    c.border.iter().for_each(|&(i, k)| out[i as usize][k as usize] = NONE);
    for (i, (&f, out)) in c.faces.iter().zip(&mut out).enumerate() {
        ctx.check_at(i)?;
        for (b, h) in out.iter_mut().zip(s.twin[f as usize]) {
            if *b != NONE {
                *b = place[h as usize / 3];
            }
        }
    }
    Ok(out)
}

/// The connected parts of a chart's faces of equal `side`, each with its faces' places in the chart.
/// Unfinished when the run is to stop: the caller checks.
pub(crate) fn pieces(s: &Surface, c: &Chart, side: &[bool], ctx: &Context<'_>) -> Vec<(Chart, Vec<u32>)> {
    let n = c.faces.len();
    let stop = |i: usize| ctx.check_at(i).is_err();
    let Ok(adjacent) = adjacent_faces(s, c, ctx) else { return Vec::new() };
    let (mut part, mut rank) = (vec![NONE; n], vec![0; n]);
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for i in 0..n {
        if part[i] != NONE {
            continue;
        }
        part[i] = groups.len() as u32;
        let mut group = vec![i as u32];
        let mut next = 0;
        while next < group.len() {
            if stop(next) {
                return Vec::new();
            }
            let i = group[next] as usize;
            rank[i] = next as u32;
            next += 1;
            for j in adjacent[i].into_iter().filter(|&j| j != NONE) {
                if part[j as usize] == NONE && side[j as usize] == side[i] {
                    part[j as usize] = groups.len() as u32;
                    group.push(j);
                }
            }
        }
        groups.push(group);
    }
    groups
        .into_iter()
        .filter_map(|g| {
            let faces: Vec<u32> = g.iter().map(|&i| c.faces[i as usize]).collect();
            let across = |i: usize, _, k: usize| {
                let i = g[i] as usize;
                let j = adjacent[i][k];
                (j != NONE && part[j as usize] == part[i]).then(|| rank[j as usize])
            };
            Chart::glue(s, faces, across, ctx).map(|piece| (piece, g))
        })
        .collect()
}

/// Cuts a chart in two or more by `side`; everything stays where it lies. Unfinished when the run is to stop:
/// the caller checks.
pub(crate) fn cut(s: &Surface, c: &Chart, side: &[bool], ctx: &Context<'_>) -> Vec<Chart> {
    let mut parts = pieces(s, c, side, ctx);
    for (piece, members) in &mut parts {
        for (t, &i) in piece.tris.iter().zip(members.iter()) {
            for k in 0..3 {
                piece.uv[t[k] as usize] = c.uv[c.tris[i as usize][k] as usize];
            }
        }
    }
    parts.into_iter().map(|p| p.0).collect()
}
