//! Cuts charts across that are so long that one of them would decide the page and leave most of it empty, or
//! that fit on no page at the density asked for.
//!
//! In: flattened charts. Out: the same, long ones in pieces that stay as they lie.

use super::chart::Chart;
use super::constants::UNWRAP;
use super::cut::{adjacent_faces, cut};
use super::flatten::shape::over_area;
use super::options::UnwrapOptions;
use super::pack::{PACK, room};
use super::planar::{bounds, hull, rotated, upright};
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::numeric::plane::corners;
use crate::numeric::sort::sort_by;
use crate::run::Context;
use rustc_hash::FxHashMap;

/// Halves long charts until none is too long for the pages asked for. `bound` is that of the stretch.
pub(crate) fn shorten(
    s: &Surface,
    list: Vec<Chart>,
    options: &UnwrapOptions,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    if options.max_charts.is_some() || options.max_energy.is_some() || options.keep_uvs {
        return Ok(list);
    }
    let area = list.iter().map(|c| c.area).sum::<f64>();
    if options.fills_one_page() {
        let page = options.page_size.map(f64::from);
        // The area of a page that the charts would fill as charts do.
        let most = UNWRAP.too_large * (area / PACK.expected_fill);
        let too_long = |hull: &[[f64; 2]]| least_page(hull, page, UNWRAP.page_turns) > most;
        return halved(s, list, too_long, bound, ctx);
    }
    let Some(density) = options.texels_per_unit else { return Ok(list) };
    // Where all pages together have too few texels the density is lowered: to this at the most.
    let texels = options.page_size.iter().map(|&p| f64::from(p)).product::<f64>();
    let all = (texels * f64::from(options.most_pages()) * PACK.expected_fill / area).sqrt();
    let density = (density * s.unit).min(all);
    let page = room(options.page_size, options.padding_px);
    let most = page[0] * page[1] / (density * density);
    let too_long = |hull: &[[f64; 2]]| {
        // As the packer turns it.
        least_page(&rotated(hull, upright(hull)), page, 2 * PACK.turns_fixed) > most
    };
    halved(s, list, too_long, bound, ctx)
}

/// Halves charts until none of their hulls is too long.
fn halved(
    s: &Surface,
    list: Vec<Chart>,
    too_long: impl Fn(&[[f64; 2]]) -> bool,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let mut out = Vec::with_capacity(list.len());
    let mut open: Vec<Chart> = list.into_iter().rev().collect();
    while let Some(c) = open.pop() {
        ctx.check()?;
        let hull = hull(&c.outline());
        if c.faces.len() == 1 || !too_long(&hull) {
            out.push(c);
            continue;
        }
        let mut pieces = cut(s, &c, &across(s, &c, upright(&hull), ctx)?, ctx);
        for piece in &mut pieces {
            piece.over = over_area(s, piece, bound);
        }
        // What does not come apart stays.
        match pieces.len() {
            1 => out.append(&mut pieces),
            _ => open.extend(pieces.into_iter().rev()),
        }
    }
    ctx.check()?;
    Ok(out)
}

/// Marks the part of a chart to one side of its shortest cut across, somewhere near the middle of its
/// length. `turn` lays it along x. No polygon is cut.
fn across(s: &Surface, c: &Chart, turn: [f64; 2], ctx: &Context<'_>) -> Result<Vec<bool>> {
    let n = c.faces.len();
    let along = |i: usize| {
        let x = corners(c.tris[i], &c.uv).map(|p| turn[0] * p[0] - turn[1] * p[1]);
        x.iter().sum::<f64>() / 3.0
    };
    // A polygon lies where its first face lies.
    let mut place: FxHashMap<u32, f64> = FxHashMap::default();
    c.faces.iter().enumerate().for_each(|(i, &f)| {
        place.entry(s.cell(f)).or_insert_with(|| along(i));
    });
    let key = |i: usize| {
        let cell = s.cell(c.faces[i]);
        (place[&cell], cell)
    };
    ctx.check()?;
    let mut order: Vec<(f64, u32, usize)> = (0..n).map(|i| (key(i).0, key(i).1, i)).collect();
    sort_by(&mut order, |a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))), ctx)?;
    let mut rank = vec![0; n];
    order.iter().enumerate().for_each(|(r, o)| rank[o.2] = r);
    // Length of the cut before each place in the order, as differences from the place before.
    let mut length = vec![0.0; n + 1];
    for (i, adjacent) in adjacent_faces(s, c, ctx)?.iter().enumerate() {
        ctx.check_at(i)?;
        let p = corners(c.tris[i], &c.uv);
        for (k, &j) in adjacent.iter().enumerate().filter(|e| *e.1 != NONE && rank[i] < rank[*e.1 as usize]) {
            let (a, b) = (p[k], p[(k + 1) % 3]);
            let l = (b[0] - a[0]).hypot(b[1] - a[1]);
            length[rank[i] + 1] += l;
            length[rank[j as usize] + 1] -= l;
        }
    }
    let (from, to) = (order[0].0, order[n - 1].0);
    let (mut now, mut best) = (0.0, (f64::INFINITY, n / 2));
    for r in 0..n {
        now += length[r];
        let off = ((order[r].0 - from) / (to - from) - 0.5).abs();
        // Halves make the smallest page.
        let cost = now * (1.0 + off);
        let whole = r > 0 && order[r].1 != order[r - 1].1;
        if whole && off < UNWRAP.middle && cost < best.0 {
            best = (cost, r);
        }
    }
    let mut side = vec![false; n];
    order[..best.1].iter().for_each(|o| side[o.2] = true);
    Ok(side)
}

/// Area of the smallest page of a shape on which the points lie in one of so many rotations in a half turn.
fn least_page(points: &[[f64; 2]], [width, height]: [f64; 2], turns: usize) -> f64 {
    (0..turns)
        .map(|turn| {
            let (s, c) = (std::f64::consts::PI * turn as f64 / turns as f64).sin_cos();
            let (lo, hi) = bounds(&rotated(points, [c, s]));
            ((hi[0] - lo[0]) / width).max((hi[1] - lo[1]) / height).powi(2) * width * height
        })
        .fold(f64::INFINITY, f64::min)
}
