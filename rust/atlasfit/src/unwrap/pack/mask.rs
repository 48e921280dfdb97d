//! A chart as cells: bit masks in several rotations, with and without the padding round it.

use super::Place;
use super::strip::BLOCK;
use crate::unwrap::chart::Chart;
use crate::unwrap::flatten::twice_area;

/// Runs of cells: (row, from, to).
pub(super) type Runs = Vec<(u32, u32, u32)>;

/// A chart's cells in one rotation.
pub(super) struct Mask {
    pub width: usize,
    pub height: usize,
    /// All cells, widest runs first: the first ones rule out most positions.
    pub runs: Runs,
    /// The cells that are set in all of [`BLOCK`] rows from `row`: one look at such a run stands for that many rows.
    pub blocks: Runs,
}

/// One rotation of one chart.
pub(super) struct Pose {
    pub rotation: [f64; 2],
    /// Lower left corner of the tight mask in the rotated chart's units.
    pub origin: [f64; 2],
    pub tight: Mask,
    /// The same with the padding round it: `grow` more cells on every side.
    pub grown: Mask,
}

impl Pose {
    /// The place of its tight mask at a cell.
    pub(super) fn at(&self, x: usize, y: usize, cell: f64) -> Place {
        let shift = [x as f64 * cell - self.origin[0], y as f64 * cell - self.origin[1]];
        Place { rotation: self.rotation, shift, ..Place::default() }
    }
}

/// A bitmap, row after row.
struct Bits {
    width: usize,
    height: usize,
    words: usize,
    on: Vec<u64>,
}

impl Bits {
    fn new(width: usize, height: usize) -> Self {
        let words = width.div_ceil(64);
        Self { width, height, words, on: vec![0; words * height] }
    }
    fn row(&self, y: usize) -> &[u64] {
        &self.on[y * self.words..(y + 1) * self.words]
    }
    fn fill(&mut self, y: usize, from: usize, to: usize) {
        set_range(&mut self.on[y * self.words..(y + 1) * self.words], from, to);
    }

    /// Every cell that a region touches: those on its outline, and those whose middle is inside. Returns the lower left corner too.
    fn of(outline: &[[f64; 2]], cell: f64) -> (Self, [f64; 2]) {
        let (lo, hi) = bounds(outline);
        let width = ((hi[0] - lo[0]) / cell).floor() as usize + 1;
        let height = ((hi[1] - lo[1]) / cell).floor() as usize + 1;
        let mut out = Self::new(width, height);
        // Where the outline crosses the middle of a row.
        let mut crossings: Vec<(u32, f64)> = Vec::new();
        for edge in outline.chunks_exact(2) {
            let [a, b] = [edge[0], edge[1]].map(|p| [(p[0] - lo[0]) / cell, (p[1] - lo[1]) / cell]);
            let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
            let (first, last) = (a[1] as usize, (b[1] as usize).min(height - 1));
            let slope = if b[1] > a[1] { (b[0] - a[0]) / (b[1] - a[1]) } else { 0.0 };
            let at = |y: f64| if y >= b[1] { b[0] } else { a[0] + slope * (y - a[1]).max(0.0) };
            for row in first..=last {
                let y = row as f64;
                let (u, v) = if first == last { (a[0], b[0]) } else { (at(y), at(y + 1.0)) };
                let (from, to) = (u.min(v).max(0.0) as usize, (u.max(v) as usize).min(width - 1));
                out.fill(row, from.min(to), to + 1);
                if a[1] <= y + 0.5 && y + 0.5 < b[1] {
                    crossings.push((row as u32, at(y + 0.5)));
                }
            }
        }
        crossings.sort_unstable_by(|p, q| p.0.cmp(&q.0).then(p.1.total_cmp(&q.1)));
        for pair in crossings.chunks_exact(2) {
            let [from, to] = [pair[0].1, pair[1].1].map(|x| ((x - 0.5).ceil().max(0.0) as usize).min(width));
            if from < to {
                out.fill(pair[0].0 as usize, from, to);
            }
        }
        (out, lo)
    }

    /// A quarter turn counter-clockwise.
    fn turned(&self) -> Self {
        let mut out = Self::new(self.height, self.width);
        for y in 0..self.height {
            let (word, bit) = ((self.height - 1 - y) / 64, 1u64 << ((self.height - 1 - y) % 64));
            runs(self.row(y), |from, to| {
                for x in from..to {
                    out.on[x * out.words + word] |= bit;
                }
            });
        }
        out
    }

    /// Every cell less than `by` cells away, in a frame grown by as much on every side.
    fn grown(&self, by: usize) -> Self {
        let mut out = Self::new(self.width + 2 * by, self.height + 2 * by);
        // Half width of the disc at each row above its middle: cells apart by d hold points apart by d - 1.
        let reach: Vec<usize> = (0..=by)
            .map(|dy| {
                let far = |dx: usize| (dx.saturating_sub(1).pow(2) + dy.saturating_sub(1).pow(2)) < by * by;
                (0..=by).take_while(|&dx| far(dx)).count().saturating_sub(1)
            })
            .collect();
        for y in 0..self.height {
            runs(self.row(y), |from, to| {
                for (dy, &dx) in reach.iter().enumerate() {
                    for r in [y + by - dy, y + by + dy] {
                        out.fill(r, from + by - dx, to + by + dx);
                    }
                }
            });
        }
        out
    }

    fn mask(&self) -> Mask {
        let widest_first = |all: &mut Runs| {
            all.sort_unstable_by_key(|r| (std::cmp::Reverse(r.2 - r.1), r.0, r.1));
        };
        let (mut all, mut blocks) = (Vec::new(), Vec::new());
        for y in 0..self.height {
            runs(self.row(y), |from, to| all.push((y as u32, from as u32, to as u32)));
        }
        let mut common = vec![0; self.words];
        for y in (0..(self.height + 1).saturating_sub(BLOCK)).step_by(BLOCK) {
            common.copy_from_slice(self.row(y));
            for r in y + 1..y + BLOCK {
                common.iter_mut().zip(self.row(r)).for_each(|(c, &o)| *c &= o);
            }
            runs(&common, |from, to| blocks.push((y as u32, from as u32, to as u32)));
        }
        widest_first(&mut all);
        widest_first(&mut blocks);
        Mask { width: self.width, height: self.height, runs: all, blocks }
    }
}

/// Sets bits `from..to`.
pub(super) fn set_range(row: &mut [u64], from: usize, to: usize) {
    let (a, b) = (from / 64, to / 64);
    let head = u64::MAX << (from % 64);
    let tail = (1u64 << (to % 64)) - 1;
    if a == b {
        row[a] |= head & tail;
        return;
    }
    row[a] |= head;
    row[a + 1..b].fill(u64::MAX);
    if tail != 0 {
        row[b] |= tail;
    }
}

/// Calls `each` with every run of ones.
fn runs(row: &[u64], mut each: impl FnMut(usize, usize)) {
    let mut start = None;
    for (i, &word) in row.iter().enumerate() {
        let mut at = 0;
        while at < 64 {
            let rest = if start.is_some() { !word } else { word } >> at;
            if rest == 0 {
                break;
            }
            at += rest.trailing_zeros() as usize;
            match start.take() {
                Some(from) => each(from, 64 * i + at),
                None => start = Some(64 * i + at),
            }
        }
    }
    if let Some(from) = start {
        each(from, 64 * row.len());
    }
}

/// The box of some points.
pub(in crate::unwrap) fn bounds(p: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for q in p {
        for k in 0..2 {
            lo[k] = lo[k].min(q[k]);
            hi[k] = hi[k].max(q[k]);
        }
    }
    (lo, hi)
}

/// Points turned by (c, s).
pub(in crate::unwrap) fn rotated(uv: &[[f64; 2]], r: [f64; 2]) -> Vec<[f64; 2]> {
    uv.iter().map(|p| [r[0] * p[0] - r[1] * p[1], r[1] * p[0] + r[0] * p[1]]).collect()
}

/// The convex hull, counter-clockwise (Andrew 1979).
pub(in crate::unwrap) fn hull(uv: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut p: Vec<[f64; 2]> = uv.to_vec();
    p.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for pass in 0..2 {
        let base = hull.len();
        let mut add = |q: [f64; 2]| {
            while hull.len() >= base + 2 && twice_area(hull[hull.len() - 2], hull[hull.len() - 1], q) <= 0.0 {
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
pub(in crate::unwrap) fn upright(uv: &[[f64; 2]]) -> [f64; 2] {
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
        let (lo, hi) = bounds(&rotated(&hull, r));
        let (w, h) = (hi[0] - lo[0], hi[1] - lo[1]);
        if w * h < best.0 {
            best = (w * h, if w >= h { r } else { [-r[1], r[0]] });
        }
    }
    best.1
}

/// The rotations of a chart: `turns` times four, from its upright pose.
pub(super) fn poses(c: &Chart, upright: [f64; 2], cell: f64, grow: usize, turns: usize) -> Vec<Pose> {
    let (outline, mut out) = (c.outline(), Vec::new());
    for turn in 0..turns {
        let (s, k) = (std::f64::consts::FRAC_PI_2 * turn as f64 / turns as f64).sin_cos();
        let mut rotation = [k * upright[0] - s * upright[1], s * upright[0] + k * upright[1]];
        let (mut cells, mut origin) = Bits::of(&rotated(&outline, rotation), cell);
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
