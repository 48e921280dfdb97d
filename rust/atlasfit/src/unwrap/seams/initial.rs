//! A first cut that makes a disk of a sheet.
//!
//! In: a sheet. Out: edges to cut: short loops and arcs (tree and cotree, Erickson, Har-Peled 2004; Erickson,
//! Whittlesey 2005), and for a sphere a path from one far end to the other.

use super::sheet::Sheet;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::sets::Sets;
use crate::unwrap::surface::NONE;

/// The edges of a first cut.
pub(super) fn first_cut(sheet: &Sheet<'_>, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let closed = !sheet.rim.contains(&true);
    let mut root = sheet.rim.clone();
    if closed {
        root[far_from(sheet, 0, ctx)? as usize] = true;
    }
    let (distance, by) = sheet.distances(&root, ctx)?;
    let mut in_tree = vec![false; sheet.ends.len()];
    by.iter().filter(|&&e| e != NONE).for_each(|&e| in_tree[e as usize] = true);
    // The dual tree takes the edges whose loops are longest; what it leaves are the shortest loops.
    let mut rest: Vec<(f64, u32)> = (0..sheet.ends.len() as u32)
        .filter(|&e| !in_tree[e as usize])
        .map(|e| {
            let [a, b] = sheet.ends[e as usize];
            (distance[a as usize] + distance[b as usize] + sheet.length[e as usize], e)
        })
        .collect();
    rest.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut sets = Sets::new(sheet.faces.len());
    let mut cut = vec![false; sheet.ends.len()];
    for (i, &(_, e)) in rest.iter().enumerate() {
        ctx.check_at(i)?;
        let [f, g] = sheet.sides(e);
        if sets.find(f) != sets.find(g) {
            sets.join(f, g);
            continue;
        }
        cut[e as usize] = true;
        for v in sheet.ends[e as usize] {
            sheet.path(v, &by).into_iter().for_each(|e| cut[e as usize] = true);
        }
    }
    if closed && !cut.contains(&true) {
        let a = root.iter().position(|&r| r).unwrap_or(0) as u32;
        sheet.path(far_from(sheet, a, ctx)?, &by).into_iter().for_each(|e| cut[e as usize] = true);
    }
    // Loops may share the way to the root: what hangs loose then goes, but a sphere's one path stays.
    if !closed || sheet.ends.iter().zip(&cut).filter(|c| *c.1).count() > 0 && is_looped(sheet, &cut) {
        prune(sheet, &mut cut);
    }
    Ok(cut)
}

/// Whether no vertex is the loose end of everything: there is a loop.
fn is_looped(sheet: &Sheet<'_>, cut: &[bool]) -> bool {
    let mut trial = cut.to_vec();
    prune(sheet, &mut trial);
    trial.contains(&true)
}

/// Takes loose ends off a cut.
pub(super) fn prune(sheet: &Sheet<'_>, cut: &mut [bool]) {
    let mut open: Vec<u32> = (0..sheet.vertices() as u32).filter(|&v| !sheet.rim[v as usize]).collect();
    while let Some(v) = open.pop() {
        if sheet.rim[v as usize] || sheet.cuts_at(v, cut) != 1 {
            continue;
        }
        if let Some(&e) = sheet.near(v).iter().find(|&&e| cut[e as usize]) {
            cut[e as usize] = false;
            open.push(sheet.other(e, v));
        }
    }
}

/// A vertex far from another one.
fn far_from(sheet: &Sheet<'_>, v: u32, ctx: &Context<'_>) -> Result<u32> {
    let mut from = vec![false; sheet.vertices()];
    from[v as usize] = true;
    let (distance, _) = sheet.distances(&from, ctx)?;
    let far = |best: u32, v: u32| if distance[v as usize] > distance[best as usize] { v } else { best };
    Ok((0..sheet.vertices() as u32).fold(v, far))
}
