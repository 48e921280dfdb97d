//! Packing: where each chart lies on its page.
//!
//! In: flattened charts (all at one scale), page size and padding in texels. Out: page, rotation and position per
//! chart. Charts are rasterised to bit masks and put, largest first, at the lowest free place over several
//! rotations, into strips of a few widths; the result closest to the page's shape wins. A whole row of positions is
//! tested at a time with word-wide shifts, so holes and bays of placed charts are used at no extra cost. Several
//! pages, or a given density, are pages of fixed size filled one after the other.

use super::Packer;
use super::chart::Chart;
use super::flatten::corners;
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;
use std::collections::HashMap;

/// Cells across a page aimed at: fine enough that rounding to cells costs about 2 % of it with 20 charts.
const CELLS: f64 = 512.0;
/// Share of the page expected to be covered, for choosing the size of a cell.
const EXPECTED_FILL: f64 = 0.62;
/// Strip widths tried one after the other.
const WIDTHS: usize = 4;
/// Orders tried at once, and rounds of trying; with many charts only `ORDER_WORK` / charts rounds.
const ORDERS: usize = 4;
const ORDER_ROUNDS: usize = 16;
const ORDER_WORK: usize = 2000;
/// Masks of at most this many cells each way count as alike if their boxes are.
const SMALL: usize = 8;
/// Charts above this share of the area are tried at eight rotations instead of four.
const TURN_MORE: f64 = 0.01;

/// Densities tried before the best one found counts, where pages have a fixed size.
const SCALES: usize = 12;

/// Rows that are tested together first.
const BLOCK: usize = 8;

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
pub(super) struct Goal {
    /// Page width and height in texels.
    pub page: [u32; 2],
    /// Free texels round every chart.
    pub padding: u32,
    /// Texels per unit; `None` = what fills the pages.
    pub density: Option<f64>,
    /// Most pages.
    pub pages: u32,
    pub packer: Packer,
    pub seed: u64,
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

/// A chart's cells in one rotation.
struct Mask {
    width: usize,
    height: usize,
    /// Cell runs (row, from, to), widest first: the first ones rule out most positions.
    runs: Vec<(u32, u32, u32)>,
    /// The same for cells that are set in all of [`BLOCK`] rows from `row`: one look at such a run stands for that
    /// many rows.
    blocks: Vec<(u32, u32, u32)>,
}

/// One rotation of one chart.
struct Pose {
    rotation: [f64; 2],
    /// Lower left corner of the tight mask in the rotated chart's units.
    origin: [f64; 2],
    tight: Mask,
    /// The same with the padding round it: `grow` more cells on every side.
    grown: Mask,
}

impl Pose {
    /// The place of its tight mask at a cell.
    fn at(&self, x: usize, y: usize, cell: f64) -> Place {
        let shift = [x as f64 * cell - self.origin[0], y as f64 * cell - self.origin[1]];
        Place { rotation: self.rotation, shift, ..Place::default() }
    }
}

struct Cells {
    width: usize,
    height: usize,
    on: Vec<bool>,
}

impl Cells {
    /// Every cell that a triangle touches. Returns the lower left corner too.
    fn of(tris: &[[u32; 3]], p: &[[f64; 2]], cell: f64) -> (Self, [f64; 2]) {
        let (lo, hi) = bounds(p);
        let width = ((hi[0] - lo[0]) / cell).floor() as usize + 1;
        let height = ((hi[1] - lo[1]) / cell).floor() as usize + 1;
        let mut on = vec![false; width * height];
        let q: Vec<[f64; 2]> = p.iter().map(|q| [(q[0] - lo[0]) / cell, (q[1] - lo[1]) / cell]).collect();
        for t in tris {
            let c = corners(*t, &q);
            let x0 = c[0][0].min(c[1][0]).min(c[2][0]) as usize;
            let x1 = (c[0][0].max(c[1][0]).max(c[2][0]) as usize).min(width - 1);
            let y0 = c[0][1].min(c[1][1]).min(c[2][1]) as usize;
            let y1 = (c[0][1].max(c[1][1]).max(c[2][1]) as usize).min(height - 1);
            if x1 == x0 || y1 == y0 {
                for y in y0..=y1 {
                    on[y * width + x0..=y * width + x1].fill(true);
                }
                continue;
            }
            for row in y0..=y1 {
                // The x-range of the triangle within the row.
                let (ra, rb) = (row as f64, row as f64 + 1.0);
                let (mut xa, mut xb) = (f64::INFINITY, f64::NEG_INFINITY);
                for k in 0..3 {
                    let (a, b) = (c[k], c[(k + 1) % 3]);
                    let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
                    if b[1] < ra || a[1] > rb {
                        continue;
                    }
                    let slope = if b[1] > a[1] { (b[0] - a[0]) / (b[1] - a[1]) } else { 0.0 };
                    let at = |y: f64| a[0] + slope * (y.clamp(a[1], b[1]) - a[1]);
                    let (u, v) = (at(ra), if b[1] > a[1] { at(rb) } else { b[0] });
                    xa = xa.min(u).min(v);
                    xb = xb.max(u).max(v);
                }
                if xa <= xb {
                    let (i, j) = (xa.max(0.0) as usize, (xb as usize).min(width - 1));
                    on[row * width + i.min(j)..=row * width + j].fill(true);
                }
            }
        }
        (Self { width, height, on }, lo)
    }

    /// A quarter turn counter-clockwise.
    fn turned(&self) -> Self {
        let (width, height) = (self.height, self.width);
        let mut on = vec![false; width * height];
        for y in 0..self.height {
            for x in 0..self.width {
                on[x * width + width - 1 - y] = self.on[y * self.width + x];
            }
        }
        Self { width, height, on }
    }

    /// Every cell within `by` cells, in a frame grown by as much.
    fn grown(&self, by: usize) -> Self {
        let (width, height) = (self.width + 2 * by, self.height + 2 * by);
        let mut on = vec![false; width * height];
        for y in 0..self.height {
            runs(&self.on[y * self.width..(y + 1) * self.width], |from, to| {
                for r in y..=y + 2 * by {
                    on[r * width + from..r * width + to + 2 * by].fill(true);
                }
            });
        }
        Self { width, height, on }
    }

    fn mask(&self) -> Mask {
        let widest_first = |all: &mut Vec<(u32, u32, u32)>| {
            all.sort_unstable_by_key(|r| (std::cmp::Reverse(r.2 - r.1), r.0, r.1));
        };
        let row = |y: usize| &self.on[y * self.width..(y + 1) * self.width];
        let (mut all, mut blocks) = (Vec::new(), Vec::new());
        for y in 0..self.height {
            runs(row(y), |from, to| all.push((y as u32, from as u32, to as u32)));
        }
        let mut common = vec![false; self.width];
        for y in (0..(self.height + 1).saturating_sub(BLOCK)).step_by(BLOCK) {
            common.copy_from_slice(row(y));
            for r in y + 1..y + BLOCK {
                common.iter_mut().zip(row(r)).for_each(|(c, &o)| *c &= o);
            }
            runs(&common, |from, to| blocks.push((y as u32, from as u32, to as u32)));
        }
        widest_first(&mut all);
        widest_first(&mut blocks);
        Mask { width: self.width, height: self.height, runs: all, blocks }
    }
}

/// Calls `each` with every run of true.
fn runs(row: &[bool], mut each: impl FnMut(usize, usize)) {
    let mut i = 0;
    while i < row.len() {
        if row[i] {
            let from = i;
            while i < row.len() && row[i] {
                i += 1;
            }
            each(from, i);
        } else {
            i += 1;
        }
    }
}

fn bounds(p: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for q in p {
        for k in 0..2 {
            lo[k] = lo[k].min(q[k]);
            hi[k] = hi[k].max(q[k]);
        }
    }
    (lo, hi)
}

/// Occupied cells, row after row, 64 to a word, and the longest free run of each row.
#[derive(Default)]
struct Rows {
    bits: Vec<u64>,
    free: Vec<u32>,
}

/// A strip of fixed width: its rows, and the union of each row with the [`BLOCK`] - 1 above it.
struct Strip {
    words: usize,
    width: usize,
    single: Rows,
    block: Rows,
}

/// ORs `from`, shifted down by `by` bits, into `into`.
fn shift_or(into: &mut [u64], from: &[u64], by: usize) {
    let (w, b) = (by / 64, by % 64);
    let n = into.len();
    if w >= n {
        return;
    }
    if b == 0 {
        for i in 0..n - w {
            into[i] |= from[i + w];
        }
        return;
    }
    for i in 0..n - w - 1 {
        into[i] |= (from[i + w] >> b) | (from[i + w + 1] << (64 - b));
    }
    into[n - w - 1] |= from[n - 1] >> b;
}

impl Strip {
    fn new(width: usize) -> Self {
        Self { words: width.div_ceil(64), width, single: Rows::default(), block: Rows::default() }
    }

    /// The lowest, then leftmost, free position from row `from` whose top stays at or below `limit`.
    fn find(&self, m: &Mask, from: usize, limit: usize) -> Option<(usize, usize)> {
        if m.width > self.width || m.height > limit {
            return None;
        }
        let last = self.width - m.width;
        let mut blocked = vec![0u64; self.words];
        let mut a = vec![0u64; self.words];
        let mut b = vec![0u64; self.words];
        'rows: for y in from..=limit - m.height {
            for (rows, runs) in [(&self.block, &m.blocks), (&self.single, &m.runs)] {
                for &(r, from, to) in runs.iter().take(12) {
                    if rows.free.get(y + r as usize).is_some_and(|&f| f < to - from) {
                        continue 'rows;
                    }
                }
            }
            blocked.fill(0);
            for (rows, runs) in [(&self.block, &m.blocks), (&self.single, &m.runs)] {
                for (n, &(r, from, to)) in runs.iter().enumerate() {
                    let at = (y + r as usize) * self.words;
                    let Some(row) = rows.bits.get(at..at + self.words) else { continue };
                    if rows.free[y + r as usize] as usize == self.width {
                        continue;
                    }
                    a.fill(0);
                    shift_or(&mut a, row, from as usize);
                    let (len, mut span) = ((to - from) as usize, 1);
                    while span < len {
                        let by = span.min(len - span);
                        b.copy_from_slice(&a);
                        shift_or(&mut a, &b, by);
                        span += by;
                    }
                    for (x, y) in blocked.iter_mut().zip(&a) {
                        *x |= y;
                    }
                    if n % 4 == 0 && first_free(&blocked, last).is_none() {
                        continue 'rows;
                    }
                }
            }
            if let Some(x) = first_free(&blocked, last) {
                return Some((x, y));
            }
        }
        None
    }

    fn put(&mut self, m: &Mask, x: usize, y: usize) {
        let need = y + m.height;
        for rows in [&mut self.single, &mut self.block] {
            if rows.free.len() < need {
                rows.bits.resize(need * self.words, 0);
                rows.free.resize(need, self.width as u32);
            }
        }
        for &(r, from, to) in &m.runs {
            let row = &mut self.single.bits[(y + r as usize) * self.words..(y + r as usize + 1) * self.words];
            for i in x + from as usize..x + to as usize {
                row[i / 64] |= 1 << (i % 64);
            }
        }
        let top = self.single.free.len();
        for r in y.saturating_sub(BLOCK - 1)..need {
            for w in 0..self.words {
                self.block.bits[r * self.words + w] =
                    (r..(r + BLOCK).min(top)).fold(0, |u, q| u | self.single.bits[q * self.words + w]);
            }
            for rows in [&mut self.single, &mut self.block] {
                rows.free[r] = longest_free(&rows.bits[r * self.words..(r + 1) * self.words], self.width);
            }
        }
    }
}

/// The longest run of zero bits among the first `width`.
fn longest_free(row: &[u64], width: usize) -> u32 {
    let (mut longest, mut start) = (0, 0);
    for (i, &w) in row.iter().enumerate() {
        let mut w = w;
        while w != 0 {
            let at = i * 64 + w.trailing_zeros() as usize;
            longest = longest.max(at.saturating_sub(start));
            // Skip the run of ones.
            let ones = (w >> (at % 64)).trailing_ones() as usize;
            start = at + ones;
            w = if at % 64 + ones >= 64 { 0 } else { w & (u64::MAX << (at % 64 + ones)) };
        }
    }
    longest.max(width.saturating_sub(start)) as u32
}

fn first_free(blocked: &[u64], last: usize) -> Option<usize> {
    for (i, &w) in blocked.iter().enumerate() {
        if i * 64 > last {
            return None;
        }
        if w != u64::MAX {
            let x = i * 64 + (!w).trailing_zeros() as usize;
            return (x <= last).then_some(x);
        }
    }
    None
}

fn rotated(uv: &[[f64; 2]], r: [f64; 2]) -> Vec<[f64; 2]> {
    uv.iter().map(|p| [r[0] * p[0] - r[1] * p[1], r[1] * p[0] + r[0] * p[1]]).collect()
}

/// The convex hull, counter-clockwise (Andrew 1979).
pub(super) fn hull(uv: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut p: Vec<[f64; 2]> = uv.to_vec();
    p.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for pass in 0..2 {
        let base = hull.len();
        let mut add = |q: [f64; 2]| {
            while hull.len() >= base + 2
                && super::flatten::twice_area(hull[hull.len() - 2], hull[hull.len() - 1], q) <= 0.0
            {
                hull.pop();
            }
            hull.push(q);
        };
        if pass == 0 {
            p.iter().for_each(|&q| add(q));
        } else {
            p.iter().rev().for_each(|&q| add(q));
        }
        hull.pop();
    }
    hull
}

/// The rotation that gives the bounding box of least area, its long side along x.
fn upright(uv: &[[f64; 2]]) -> [f64; 2] {
    let hull = hull(uv);
    let mut best = (f64::INFINITY, [1.0, 0.0]);
    for i in 0..hull.len() {
        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
        let d = [b[0] - a[0], b[1] - a[1]];
        let l = (d[0] * d[0] + d[1] * d[1]).sqrt();
        if l <= 0.0 {
            continue;
        }
        let r = [d[0] / l, -d[1] / l];
        let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for q in &hull {
            let q = [r[0] * q[0] - r[1] * q[1], r[1] * q[0] + r[0] * q[1]];
            for k in 0..2 {
                lo[k] = lo[k].min(q[k]);
                hi[k] = hi[k].max(q[k]);
            }
        }
        let (w, h) = (hi[0] - lo[0], hi[1] - lo[1]);
        if w * h < best.0 {
            best = (w * h, if w >= h { r } else { [-r[1], r[0]] });
        }
    }
    best.1
}

/// The rotations of a chart, quarter turns of its upright pose and, for a large one, of that turned by 45 degrees.
fn poses(c: &Chart, upright: [f64; 2], cell: f64, grow: usize, more: bool) -> Vec<Pose> {
    let mut out = Vec::new();
    let h = std::f64::consts::FRAC_1_SQRT_2;
    let tilted = [h * (upright[0] - upright[1]), h * (upright[0] + upright[1])];
    for base in if more { vec![upright, tilted] } else { vec![upright] } {
        let p = rotated(&c.uv, base);
        let (lo, _) = bounds(&p);
        let (mut cells, _) = Cells::of(&c.tris, &p, cell);
        let mut rotation = base;
        // Where the frame's lower left corner goes under quarter turns.
        let mut origin = lo;
        for _ in 0..4 {
            out.push(Pose { rotation, origin, tight: cells.mask(), grown: cells.grown(grow).mask() });
            // (x, y) -> (-y, x): the new left side is the old top.
            origin = [-(origin[1] + cells.height as f64 * cell), origin[0]];
            rotation = [-rotation[1], rotation[0]];
            cells = cells.turned();
        }
    }
    out
}

/// Packs the charts. Returns a place for each, and texels per unit.
pub(super) fn pack(charts: &[Chart], goal: &Goal, ctx: &Context<'_>) -> Result<(Vec<Place>, f64)> {
    if charts.is_empty() {
        return Ok((Vec::new(), 1.0));
    }
    let upright: Vec<[f64; 2]> = charts.par_iter().map(|c| upright(&c.uv)).collect();
    let (mut places, density) = match (goal.density, goal.pages, goal.packer) {
        (None, 1, Packer::Boxes) => one_page_of_boxes(charts, &upright, goal),
        (None, 1, Packer::Shapes) => one_page(charts, &upright, goal, ctx)?,
        _ => several_pages(charts, &upright, goal, ctx)?,
    };
    for p in &mut places {
        p.scale = goal.page.map(|texels| density / f64::from(texels));
    }
    Ok((places, density))
}

/// Fills one page as far as possible.
fn one_page(
    charts: &[Chart],
    upright: &[[f64; 2]],
    goal: &Goal,
    ctx: &Context<'_>,
) -> Result<(Vec<Place>, f64)> {
    let area: f64 = charts.iter().map(|c| c.area).sum();
    // The page is `aspect` times as high as wide; sizes are measured by its width.
    let aspect = f64::from(goal.page[1]) / f64::from(goal.page[0]);
    let side = (area / EXPECTED_FILL / aspect).sqrt();
    // A chart far longer than the page's expected side decides the page, and so the cells.
    let longest = charts
        .iter()
        .map(|c| {
            let (lo, hi) = bounds(&c.uv);
            (hi[0] - lo[0]).hypot(hi[1] - lo[1])
        })
        .fold(0.0, f64::max);
    let cell = side.max(longest * 0.8 / aspect.max(1.0)) * aspect.max(1.0) / CELLS;
    let cells_per_texel = CELLS / f64::from(goal.page[0].max(goal.page[1]));
    let grow = ((f64::from(goal.padding) * cells_per_texel).ceil() as usize).max(1);
    let poses: Vec<Vec<Pose>> = charts
        .par_iter()
        .zip(upright)
        .map(|(c, &r)| poses(c, r, cell, grow, c.area > TURN_MORE * area))
        .collect();
    let order = largest_first(&poses);
    let narrowest =
        poses.iter().map(|p| p.iter().map(|q| q.grown.width).min().unwrap_or(0)).max().unwrap_or(0);
    let size_of = |width: usize, top: usize| width.max((top as f64 / aspect).ceil() as usize);
    let mut best: Option<(usize, Vec<Place>)> = None;
    let mut width = ((area / 0.8 / aspect).sqrt() / cell) as usize;
    for _ in 0..if charts.len() > ORDER_WORK { 1 } else { WIDTHS } {
        ctx.check()?;
        width = width.max(narrowest);
        let limit = best.as_ref().map_or(usize::MAX / 4, |b| (b.0 as f64 * aspect) as usize);
        let Some((top, places)) = strip(&poses, &order, width, grow, cell, limit) else { break };
        let size = size_of(width, top);
        if best.as_ref().is_none_or(|b| size < b.0) {
            best = Some((size, places));
        }
        let top = (top as f64 / aspect).ceil() as usize;
        let next = if top > width {
            ((top * width) as f64).sqrt() as usize
        } else {
            width - (width - top).div_ceil(2)
        };
        if next == width || top == width || width == narrowest && top < width {
            break;
        }
        width = next;
    }
    // Then other orders, each into a page a little smaller than the best so far; those that fail stop early.
    // Many charts fill the gaps anyway, and each try costs more.
    let rounds = (ORDER_WORK / charts.len().max(1)).min(ORDER_ROUNDS) as u64;
    let variants = ORDERS as u64;
    let mut failures = 0;
    for round in 0..rounds {
        ctx.check()?;
        let Some((size, _)) = &best else { break };
        let target = size - size.div_ceil(100);
        if target < narrowest {
            break;
        }
        let limit = (target as f64 * aspect) as usize;
        let tries: Vec<Option<(usize, Vec<Place>)>> = (0..variants)
            .into_par_iter()
            .map(|v| {
                let mut keyed: Vec<(u64, usize)> = order
                    .iter()
                    .map(|&c| {
                        let seed = goal.seed.wrapping_mul(0x1_0000_01B3) ^ (round * variants + v);
                        ((extent(&poses[c]).0 as f64 * jitter(seed, c)) as u64, c)
                    })
                    .collect();
                keyed.sort_by_key(|&(k, c)| (std::cmp::Reverse(k), c));
                let order: Vec<usize> = keyed.into_iter().map(|k| k.1).collect();
                strip(&poses, &order, target, grow, cell, limit)
            })
            .collect();
        match tries.into_iter().flatten().min_by_key(|t| t.0) {
            Some((top, places)) => best = Some((size_of(target, top), places)),
            None => {
                failures += 1;
                if failures == 3 {
                    break;
                }
            }
        }
    }
    Ok(match best {
        Some((cells, places)) => (places, f64::from(goal.page[0]) / (cells as f64 * cell)),
        None => one_page_of_boxes(charts, upright, goal),
    })
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
        Packer::Shapes => fill_shapes(charts, upright, goal, density, area, ctx),
        Packer::Boxes => Ok(fill_boxes(charts, upright, goal, density)),
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
    area: f64,
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
    let poses: Vec<Vec<Pose>> = charts
        .par_iter()
        .zip(upright)
        .map(|(c, &r)| poses(c, r, cell, grow, c.area > TURN_MORE * area))
        .collect();
    let mut pages: Vec<Strip> = Vec::new();
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
            if pages[page].single.free.is_empty() {
                return Ok(None);
            }
        }
        return Ok(None);
    }
    Ok(Some(places))
}

/// A factor within a third of 1, fixed by its arguments (an integer hash after Steele, Lea, Flood 2014).
fn jitter(variant: u64, chart: usize) -> f64 {
    let mut z = (variant << 32 | chart as u64)
        .wrapping_mul(0x9E37_79B9_7F4A_7C15)
        .wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    0.67 + 0.66 * (z >> 11) as f64 / (1u64 << 53) as f64
}

/// Fills a strip of the given width in cells; `None` once it grows past `limit`. Returns its height too.
fn strip(
    poses: &[Vec<Pose>],
    order: &[usize],
    width: usize,
    grow: usize,
    cell: f64,
    limit: usize,
) -> Option<(usize, Vec<Place>)> {
    let mut strip = Strip::new(width);
    let mut top = 0;
    let mut places = vec![Place::default(); poses.len()];
    // Where masks of a size were last put: below that there is no room for small ones of the same size.
    let mut lowest: HashMap<(usize, usize), usize> = HashMap::new();
    for &c in order {
        let tallest = poses[c].iter().map(|p| p.grown.height).max()?;
        let mut found: Option<(usize, usize, usize, usize)> = None;
        let mut best = usize::MAX / 4;
        for (i, pose) in poses[c].iter().enumerate() {
            // A place counts by how high its middle lies: twice that, to stay whole.
            let height = pose.grown.height;
            let room = (top + tallest).min(limit).min((best - height.min(best)) / 2 + height);
            let size = (pose.grown.width, height);
            let from = if size.0.max(size.1) <= SMALL { *lowest.get(&size).unwrap_or(&0) } else { 0 };
            let at = strip.find(&pose.grown, from, room);
            if let Some((_, y)) = at {
                lowest.insert(size, y);
            }
            if let Some((x, y)) = at
                && 2 * y + height < best
            {
                best = 2 * y + height;
                found = Some((y + height, i, x, y));
            }
        }
        let (t, i, x, y) = found?;
        let pose = &poses[c][i];
        strip.put(&pose.tight, x + grow, y + grow);
        top = top.max(t);
        if top > limit {
            return None;
        }
        places[c] = pose.at(x + grow, y + grow, cell);
    }
    Some((top, places))
}

/// A chart's upright bounding box.
fn upright_box(c: &Chart, r: [f64; 2]) -> [[f64; 2]; 2] {
    let (lo, hi) = bounds(&rotated(&c.uv, r));
    [lo, hi]
}

/// One page of rows of bounding boxes.
fn one_page_of_boxes(charts: &[Chart], upright: &[[f64; 2]], goal: &Goal) -> (Vec<Place>, f64) {
    let boxes: Vec<[[f64; 2]; 2]> = charts.iter().zip(upright).map(|(c, &r)| upright_box(c, r)).collect();
    let padded: f64 = charts.iter().map(|c| c.area).sum::<f64>();
    let mut density = (f64::from(goal.page[0]) * f64::from(goal.page[1]) / padded).sqrt();
    loop {
        if let Some(places) = shelves(&boxes, upright, goal, density) {
            return (places, density);
        }
        density *= 0.99;
    }
}

/// Places the charts at a density on at most as many pages as allowed, in rows.
fn fill_boxes(charts: &[Chart], upright: &[[f64; 2]], goal: &Goal, density: f64) -> Option<Vec<Place>> {
    let boxes: Vec<[[f64; 2]; 2]> = charts.iter().zip(upright).map(|(c, &r)| upright_box(c, r)).collect();
    shelves(&boxes, upright, goal, density)
}

/// Rows of bounding boxes, highest first.
fn shelves(boxes: &[[[f64; 2]; 2]], upright: &[[f64; 2]], goal: &Goal, density: f64) -> Option<Vec<Place>> {
    let [width, height] = goal.page.map(|p| f64::from(p) / density);
    let gap = f64::from(goal.padding.max(1)) / density;
    let size = |c: usize| [0, 1].map(|k| boxes[c][1][k] - boxes[c][0][k]);
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| size(b)[1].total_cmp(&size(a)[1]).then(a.cmp(&b)));
    let (mut page, mut x, mut y, mut row) = (0, gap, gap, 0f64);
    let mut out = vec![Place::default(); boxes.len()];
    for c in order {
        let [w, h] = size(c);
        if x + w + gap > width {
            (x, y, row) = (gap, y + row + gap, 0.0);
        }
        if y + h + gap > height {
            (page, x, y, row) = (page + 1, gap, gap, 0.0);
        }
        if page == goal.pages || x + w + gap > width || y + h + gap > height {
            return None;
        }
        out[c] = Place {
            page,
            rotation: upright[c],
            shift: [x - boxes[c][0][0], y - boxes[c][0][1]],
            ..Place::default()
        };
        x += w + gap;
        row = row.max(h);
    }
    Some(out)
}
