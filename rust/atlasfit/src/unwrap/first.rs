//! The first charts: patches of the segmentation laid flat.
//!
//! In: a surface and a patch per face. Out: charts that neither flip nor overlap; what does is cut until it
//! does not.

use super::chart::Chart;
use super::constants::UNWRAP;
use super::cut::{halves, pieces, whole_cells};
use super::flatten::arap::Arap;
use super::flatten::project::{blend_without_flips, mean_normal, project};
use super::flatten::shape::{all_positive, over_area};
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::inject;
use rayon::prelude::*;

/// Flattens the first patches; one that cannot be laid out flat is cut further. Without a stretch bound they
/// are only projected, which is enough to see whether they lie flat.
pub(crate) fn first_charts(
    s: &Surface,
    label: &[u32],
    count: usize,
    bound: Option<f64>,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let mut faces: Vec<Vec<u32>> = vec![Vec::new(); count];
    let mut index_of = vec![NONE; label.len()];
    for (f, &l) in label.iter().enumerate() {
        ctx.check_at(f)?;
        if l != NONE {
            index_of[f] = faces[l as usize].len() as u32;
            faces[l as usize].push(f as u32);
        }
    }
    let built: Vec<Vec<Chart>> = faces
        .into_par_iter()
        .enumerate()
        .map(|(id, faces)| {
            if ctx.check().is_err() || faces.is_empty() {
                return Vec::new();
            }
            let across = |_, f: usize, k: usize| {
                let h = s.twin[f][k];
                (h != NONE && label[h as usize / 3] == id as u32).then(|| index_of[h as usize / 3])
            };
            let chart = Chart::glue(s, faces, across, ctx);
            chart.map_or_else(Vec::new, |c| flatten_first(s, c, bound, ctx))
        })
        .collect();
    ctx.check()?;
    Ok(built.into_iter().flatten().collect())
}

/// Charts of the patches among some faces.
pub(crate) fn patch_charts(
    s: &Surface,
    faces: &[u32],
    label: &[u32],
    bound: f64,
    ctx: &Context<'_>,
) -> Vec<Chart> {
    let mut sorted: Vec<(u32, u32)> = faces.iter().map(|&f| (label[f as usize], f)).collect();
    sorted.sort_unstable();
    sorted
        .chunk_by(|a, b| a.0 == b.0)
        .flat_map(|group| {
            let own: Vec<u32> = group.iter().map(|g| g.1).collect();
            let across = |_, f: usize, k: usize| {
                let h = s.twin[f][k];
                if h == NONE { None } else { own.binary_search(&(h / 3)).ok().map(|i| i as u32) }
            };
            let chart = Chart::glue(s, own.clone(), across, ctx);
            chart.map_or_else(Vec::new, |c| flatten_first(s, c, Some(bound), ctx))
        })
        .collect()
}

/// Lays a patch flat; one that flips or overlaps is cut in two until it does not.
fn flatten_first(s: &Surface, mut c: Chart, bound: Option<f64>, ctx: &Context<'_>) -> Vec<Chart> {
    if ctx.check().is_err() {
        return Vec::new();
    }
    if c.faces.len() == 1 {
        return vec![Chart::single(s, c.faces[0])];
    }
    let n = mean_normal(s, &c.faces);
    project(s, &mut c, n);
    let stopped = || ctx.check().is_err();
    if all_positive(&c.tris, &c.uv) {
        if bound.is_some() && !stopped() {
            let mut arap = Arap::new(&c.tris, c.rest(s), &c.uv, &[], ctx);
            let mut uv = c.uv.clone();
            for _ in 0..UNWRAP.first_steps {
                arap.step(&c.tris, &mut uv, &[]);
            }
            blend_without_flips(&c.tris, &mut c.uv, &uv);
        }
        let Ok(injective) = inject::injective(&c.tris, &c.uv, &c.border, ctx) else { return Vec::new() };
        if injective {
            if let Some(bound) = bound {
                c.over = over_area(s, &c, bound);
                c.waste = c.wasted(s.page);
            }
            return vec![c];
        }
    }
    if stopped() {
        return Vec::new();
    }
    let side = first_cut(s, &c, n);
    pieces(s, &c, &side, ctx).into_iter().flat_map(|(piece, _)| flatten_first(s, piece, bound, ctx)).collect()
}

/// The side of a cut for each face of a chart that cannot be projected along `n`.
fn first_cut(s: &Surface, c: &Chart, n: Vec3) -> Vec<bool> {
    // Faces that look away from the rest are cut off first; else the longer side of the box is halved.
    let facing = |f: u32| s.normal[f as usize].dot(n) > UNWRAP.facing_cos;
    let away = c.faces.iter().filter(|&&f| !facing(f)).count();
    if away > 0 && away < c.faces.len() {
        whole_cells(s, &c.faces, c.faces.iter().map(|&f| !facing(f)).collect())
    } else {
        let centre = |f: u32| s.tri[f as usize].iter().fold(Vec3::ZERO, |a, &v| a + s.pos[v as usize]);
        let axis = (0..3)
            .map(|k| {
                let x = c.faces.iter().map(|&f| centre(f)[k]);
                (x.clone().fold(f64::NEG_INFINITY, f64::max) - x.fold(f64::INFINITY, f64::min), k)
            })
            .fold((-1.0, 0), |a, b| if b.0 > a.0 { b } else { a })
            .1;
        halves(s, &c.faces, |i| centre(c.faces[i])[axis])
    }
}
