//! A chart as a bitmap of cells.

use crate::unwrap::planar::bounds;

/// A bitmap, row after row.
pub(super) struct Bitmap {
    pub width: usize,
    pub height: usize,
    /// Words of a row.
    pub words: usize,
    on: Vec<u64>,
}

impl Bitmap {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let words = width.div_ceil(64);
        Self { width, height, words, on: vec![0; words * height] }
    }
    /// The words of a row.
    pub(super) fn row(&self, y: usize) -> &[u64] {
        &self.on[y * self.words..(y + 1) * self.words]
    }
    fn fill(&mut self, y: usize, from: usize, to: usize) {
        set_range(&mut self.on[y * self.words..(y + 1) * self.words], from, to);
    }

    /// Every cell that a region touches: those on its outline, and those whose middle is inside. Returns the
    /// lower left corner too.
    pub(super) fn of(outline: &[[f64; 2]], cell: f64) -> (Self, [f64; 2]) {
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

    /// Fills every cell that a triangle touches; its corners are in cells.
    pub(super) fn touch(&mut self, t: [[f64; 2]; 3]) {
        let (lo, hi) = bounds(&t);
        if hi[0] < 0.0 || hi[1] < 0.0 {
            return;
        }
        let rows = hi[1].min(self.height as f64) as usize + 1;
        for y in lo[1].max(0.0) as usize..rows.min(self.height) {
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
                let (bottom, top) = (a[1].max(y as f64), b[1].min(y as f64 + 1.0));
                if bottom > top {
                    continue;
                }
                let level = b[1] <= a[1];
                let at = |y: f64| a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]);
                for x in if level { [a[0], b[0]] } else { [at(bottom), at(top)] } {
                    (from, to) = (from.min(x), to.max(x));
                }
            }
            let width = self.width as f64;
            let (first, end) = (from.clamp(0.0, width) as usize, (to + 1.0).clamp(0.0, width) as usize);
            if first < end {
                self.fill(y, first, end);
            }
        }
    }

    /// A quarter turn counter-clockwise.
    pub(super) fn turned(&self) -> Self {
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
    pub(super) fn grown(&self, by: usize) -> Self {
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
}

/// Sets bits `from..to`.
pub(crate) fn set_range(row: &mut [u64], from: usize, to: usize) {
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
pub(super) fn runs(row: &[u64], mut each: impl FnMut(usize, usize)) {
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
