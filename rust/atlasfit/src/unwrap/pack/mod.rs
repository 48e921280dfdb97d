//! Packing: where each chart lies on its page.
//!
//! In: flattened charts (all at one scale), page size and padding in texels. Out: page, rotation and position per chart.
//! Charts are rasterised to bit masks (`mask`) in several rotations and put at the lowest free place (`strip`). For one
//! page, the order of placing is searched for (`search`), then the charts are pushed together (`tighten`). Several pages,
//! or a given density, are pages of fixed size filled one after the other. `boxes` is the fast way; `outside` asks a
//! packer that is no part of the library.

mod boxes;
mod mask;
mod outside;
mod search;
mod strip;
mod tighten;

pub(super) use mask::{bounds, hull, rotated, upright};
pub use outside::{FlatChart, PagePacker, Pages, Spot};

use super::Packer;
use super::chart::Chart;
use crate::error::Result;
use crate::run::Context;
use boxes::{fill_boxes, one_page_of_boxes};
use mask::{Pose, poses};
use outside::fill_outside;
use rayon::prelude::*;
use search::{CELLS, one_page};
use strip::Strip;

/// Share of the page expected to be covered, for a first guess.
pub(super) const EXPECTED_FILL: f64 = 0.62;
/// Densities tried before the best one found counts, where pages have a fixed size.
const SCALES: usize = 12;
/// Rotations tried, in quarters, where pages have a fixed size.
const TURNS: usize = 2;
/// Words of a page's row where pages have a fixed size.
const WORDS: usize = CELLS as usize / 64;

/// Where a chart goes: rotate by (c, s), add the shift, scale; the result is in page units [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub page: u32,
    pub rotation: [f64; 2],
    pub shift: [f64; 2],
    pub scale: [f64; 2],
}

impl Default for Place {
    fn default() -> Self {
        Self { page: 0, rotation: [1.0, 0.0], shift: [0.0; 2], scale: [1.0; 2] }
    }
}

/// What to pack for. Lengths on the surface are in its frame.
#[derive(Clone, Copy)]
pub(super) struct Goal<'a> {
    /// Page width and height in texels.
    pub page: [u32; 2],
    /// Free texels round every chart.
    pub padding: u32,
    /// Texels per unit; `None` = what fills the pages.
    pub density: Option<f64>,
    /// Most pages.
    pub pages: u32,
    pub packer: Packing<'a>,
    pub seed: u64,
}

/// Who packs.
#[derive(Clone, Copy)]
pub(super) enum Packing<'a> {
    Own(Packer),
    Outside(&'a dyn PagePacker),
}

impl Place {
    /// A chart's vertices on the page.
    pub(super) fn positions(&self, uv: &[[f64; 2]]) -> Vec<[f32; 2]> {
        let [c, s] = self.rotation;
        uv.iter()
            .map(|q| {
                let p = [c * q[0] - s * q[1], s * q[0] + c * q[1]];
                [0, 1].map(|k| ((p[k] + self.shift[k]) * self.scale[k]).clamp(0.0, 1.0) as f32)
            })
            .collect()
    }
}

/// Packs the charts. Returns a place for each, and texels per unit.
pub(super) fn pack(charts: &[Chart], goal: &Goal, ctx: &Context<'_>) -> Result<(Vec<Place>, f64)> {
    if charts.is_empty() {
        return Ok((Vec::new(), 1.0));
    }
    let upright: Vec<[f64; 2]> = charts.par_iter().map(|c| upright(&c.outline())).collect();
    let (mut places, density) = match (goal.density, goal.pages, goal.packer) {
        (None, 1, Packing::Own(Packer::Boxes)) => one_page_of_boxes(charts, &upright, goal),
        (None, 1, Packing::Own(Packer::Shapes)) => one_page(charts, &upright, goal, ctx)?,
        _ => several_pages(charts, &upright, goal, ctx)?,
    };
    for p in &mut places {
        p.scale = goal.page.map(|texels| density / f64::from(texels));
    }
    Ok((places, density))
}

/// How much a chart decides where others go, for the order of placing.
fn extent(poses: &[Pose]) -> (usize, usize) {
    (poses[0].tight.width * 10 + poses[0].tight.height * 3, poses[0].tight.height)
}

fn largest_first(poses: &[Vec<Pose>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by_key(|&c| (std::cmp::Reverse(extent(&poses[c])), c));
    order
}

/// Fills pages of fixed size: at the density asked for, or the highest at which all fit.
fn several_pages(
    charts: &[Chart],
    upright: &[[f64; 2]],
    goal: &Goal,
    ctx: &Context<'_>,
) -> Result<(Vec<Place>, f64)> {
    let area: f64 = charts.iter().map(|c| c.area).sum();
    let try_at = |density: f64| match goal.packer {
        Packing::Own(Packer::Shapes) => fill_shapes(charts, upright, goal, density, ctx),
        Packing::Own(Packer::Boxes) => Ok(fill_boxes(charts, upright, goal, density)),
        Packing::Outside(packer) => fill_outside(packer, charts, upright, goal, density, ctx),
    };
    let full = |fill: f64| {
        let texels = f64::from(goal.page[0]) * f64::from(goal.page[1]) * f64::from(goal.pages);
        (texels * fill / area).sqrt()
    };
    // Too high a density cannot fit; the highest that does lies between these.
    let (mut low, mut high) = (None, full(1.0));
    let mut at = goal.density.unwrap_or_else(|| full(EXPECTED_FILL)).min(high);
    for _ in 0..SCALES {
        match try_at(at)? {
            Some(places) if goal.density.is_some_and(|d| at >= d) => return Ok((places, at)),
            Some(places) => low = Some((places, at)),
            None => high = at,
        }
        at = match &low {
            Some((_, l)) if high / l < 1.01 => break,
            Some((_, l)) => (l * high).sqrt(),
            None => at * 0.85,
        };
    }
    loop {
        if let Some(found) = low {
            return Ok(found);
        }
        if let Some(places) = try_at(at)? {
            return Ok((places, at));
        }
        at *= 0.7;
    }
}

/// Places the charts at a density on at most as many pages as allowed, by shape.
fn fill_shapes(
    charts: &[Chart],
    upright: &[[f64; 2]],
    goal: &Goal,
    density: f64,
    ctx: &Context<'_>,
) -> Result<Option<Vec<Place>>> {
    ctx.check()?;
    let texels = (f64::from(goal.page[0].max(goal.page[1])) / CELLS).max(1.0);
    let cell = texels / density;
    let [width, height] = goal.page.map(|p| (f64::from(p) / texels) as usize);
    // What is larger than a page fits on none: found before its mask takes memory.
    let longest = cell * (width as f64).hypot(height as f64);
    let too_large = |c: &Chart| {
        let (lo, hi) = bounds(&c.uv);
        (hi[0] - lo[0]).hypot(hi[1] - lo[1]) > longest * std::f64::consts::SQRT_2
    };
    if charts.iter().any(too_large) {
        return Ok(None);
    }
    let grow = ((f64::from(goal.padding) / texels).ceil() as usize).max(1);
    let poses: Vec<Vec<Pose>> =
        charts.par_iter().zip(upright).map(|(c, &r)| poses(c, r, cell, grow, TURNS)).collect();
    let mut pages: Vec<Strip<WORDS>> = Vec::new();
    let mut places = vec![Place::default(); charts.len()];
    'charts: for c in largest_first(&poses) {
        ctx.check()?;
        for page in 0..goal.pages as usize {
            if page == pages.len() {
                pages.push(Strip::new(width));
            }
            let best = (poses[c].iter())
                .filter_map(|p| {
                    pages[page].find(&p.grown, 0, height).map(|at| (2 * at.1 + p.grown.height, at, p))
                })
                .min_by_key(|b| b.0);
            if let Some((_, (x, y), pose)) = best {
                pages[page].put(&pose.tight, x + grow, y + grow);
                places[c] = Place { page: page as u32, ..pose.at(x + grow, y + grow, cell) };
                continue 'charts;
            }
            if pages[page].is_empty() {
                return Ok(None);
            }
        }
        return Ok(None);
    }
    Ok(Some(places))
}
