//! Surface and points put on the creases.
//!
//! In: a surface or points, creases. Out: the mesh cut along them, its vertices and the points on the sides
//! that meet there; farther off all stays as it was.

use super::chains::Creases;
use super::constants::CREASE;
use super::pull::{Pulls, pull};
use super::unfold::unfold;
use crate::atlas::ProjectedPoint;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::lists::Lists;
use rayon::prelude::*;

/// Moves the points beside creases onto the sides that meet there.
pub(super) fn points(projected: &mut [ProjectedPoint], creases: &Creases, ctx: &Context<'_>) -> Result<()> {
    let places = projected.par_iter().map(|p| (p.position, p.normal));
    for (i, pull) in Pulls::new(creases, places, ctx)?.iter() {
        let p = &mut projected[i];
        if p.chart == u32::MAX {
            continue;
        }
        p.position = p.position * (1.0 - pull.weight) + pull.to * pull.weight;
        p.normal = (p.normal * (1.0 - pull.weight) + pull.normal * pull.weight).normalized();
    }
    Ok(())
}

/// Cuts the surface along creases and moves its vertices onto the sides.
pub(super) fn surface(s: &mut Surface, creases: &Creases, ctx: &Context<'_>) -> Result<()> {
    let places = s.positions.par_iter().zip(&s.normals).map(|(p, n)| (*p, *n));
    let mut pulls = Pulls::new(creases, places, ctx)?;
    let edges = Edges::new(&s.triangles, ctx)?;
    unfold(s, creases, &mut pulls, &edges, ctx)?;
    snap(s, &mut pulls, &edges, ctx)?;
    for (v, pull) in pulls.iter() {
        ctx.check_at(v)?;
        let (to, normal) =
            if pull.across == 0.0 { (pull.on_line, pull.ridge) } else { (pull.to, pull.normal) };
        s.positions[v] = s.positions[v] * (1.0 - pull.weight) + to * pull.weight;
        s.normals[v] = (s.normals[v] * (1.0 - pull.weight) + normal * pull.weight).normalized();
    }
    cut(s, creases, &pulls, &edges, ctx)
}

/// Where an edge crosses a crease, as a share of the way from its first end.
fn crossing(pulls: &Pulls, [a, b]: [u32; 2]) -> Option<f64> {
    let (a, b) = (pulls.of(a)?, pulls.of(b)?);
    let believed = a.weight.min(b.weight) > 0.5;
    let crosses = a.chain == b.chain && believed && a.across * b.across < 0.0;
    crosses.then(|| a.across / (a.across - b.across))
}

/// Says of vertices next to a crease that they are on it.
fn snap(s: &Surface, pulls: &mut Pulls, edges: &Edges, ctx: &Context<'_>) -> Result<()> {
    let mut near: Vec<(f64, u32)> = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        let Some(share) = crossing(pulls, [a, b]) else { continue };
        if share < CREASE.snap {
            near.push((share, a));
        } else if share > 1.0 - CREASE.snap {
            near.push((1.0 - share, b));
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // Two neighbours on the crease are an edge of it; a third beside both would flatten a triangle.
    let around = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    for (_, v) in near {
        let on = |w: &&u32| pulls.of(**w).is_some_and(|p| p.across == 0.0);
        let full = around.of(v).iter().any(|&f| s.triangles[f as usize].iter().filter(on).count() > 1);
        if let Some(pull) = pulls.of_mut(v).filter(|_| !full) {
            pull.across = 0.0;
        }
    }
    Ok(())
}

/// Cuts the triangles that creases cross.
fn cut(s: &mut Surface, creases: &Creases, pulls: &Pulls, edges: &Edges, ctx: &Context<'_>) -> Result<()> {
    let mut middle = ctx.filled([u32::MAX; 3], s.triangles.len())?;
    let mut near = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        let Some(share) = crossing(pulls, [a, b]) else { continue };
        let [p, q] = [a, b].map(|v| s.positions[v as usize]);
        let at = p + (q - p) * share;
        let normal = s.normals[a as usize] + s.normals[b as usize];
        let Some(pull) = pull(creases, at, normal, &mut near) else { continue };
        let new = s.positions.len() as u32;
        s.positions.push(at + (pull.on_line - at) * pull.weight);
        s.normals.push(pull.ridge);
        s.chart.push(s.chart[if share < 0.5 { a } else { b } as usize]);
        for half in edge {
            let t = s.triangles[half.face()];
            let start = half.start(&s.triangles);
            let side = t.iter().position(|&v| v == start).unwrap_or(0);
            middle[half.face()][side] = new;
        }
    }
    for (f, middle) in middle.into_iter().enumerate() {
        ctx.check_at(f)?;
        split(s, f, middle);
    }
    Ok(())
}

/// Cuts a triangle at the new vertices of its sides, of which the k-th runs from corner k to the next.
fn split(s: &mut Surface, f: usize, middle: [u32; 3]) {
    let new = |k: usize| middle[k % 3] != u32::MAX;
    let t = s.triangles[f];
    let corner = |k: usize| t[k % 3];
    match (0..3).filter(|&k| new(k)).count() {
        0 => {}
        1 => {
            let k = (0..3).find(|&k| new(k)).unwrap_or(0);
            let m = middle[k];
            s.triangles[f] = [corner(k), m, corner(k + 2)];
            s.triangles.push([m, corner(k + 1), corner(k + 2)]);
        }
        2 => {
            // Sides k and k + 1 are cut: the corner between them is alone on its side.
            let k = (0..3).find(|&k| new(k) && new(k + 1)).unwrap_or(0);
            let [m, n] = [middle[k], middle[(k + 1) % 3]];
            s.triangles[f] = [m, corner(k + 1), n];
            let at = |v: u32| s.positions[v as usize];
            let [a, c] = [corner(k), corner(k + 2)];
            if at(a).dist2(at(n)) < at(m).dist2(at(c)) {
                s.triangles.extend([[a, m, n], [a, n, c]]);
            } else {
                s.triangles.extend([[a, m, c], [m, n, c]]);
            }
        }
        _ => {
            let [m, n, o] = middle;
            s.triangles[f] = [m, n, o];
            s.triangles.extend([[t[0], m, o], [m, t[1], n], [o, n, t[2]]]);
        }
    }
}
