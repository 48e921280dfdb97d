//! Packing: where each chart lies on its page.
//!
//! In: flattened charts (all at one scale), page size and padding in texels. Out: page, rotation and position per
//! chart, and the texel density. Charts are rasterised to bit masks and put, largest first, at the lowest free
//! place over several rotations; a whole row of positions is tested at a time with word-wide shifts.

use super::chart::Chart;
use super::flatten::corners;

/// Resolution of the packing grid across a page.
const CELLS: usize = 512;

/// Where a chart goes: rotate by (c, s), then add the translation; the result is in page units [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub page: u32,
    pub rotation: [f64; 2],
    pub scale: f64,
    pub shift: [f64; 2],
}

struct Mask {
    width: usize,
    height: usize,
    /// Cell runs [from, to) per row.
    runs: Vec<(u32, u32, u32)>,
}

fn rasterise(tris: &[[u32; 3]], p: &[[f64; 2]], cell: f64, grow: usize) -> (Mask, [f64; 2]) {
    let mut lo = [f64::INFINITY; 2];
    let mut hi = [f64::NEG_INFINITY; 2];
    for q in p {
        for k in 0..2 {
            lo[k] = lo[k].min(q[k]);
            hi[k] = hi[k].max(q[k]);
        }
    }
    let g = grow as f64;
    let w = ((hi[0] - lo[0]) / cell).floor() as usize + 1 + 2 * grow;
    let h = ((hi[1] - lo[1]) / cell).floor() as usize + 1 + 2 * grow;
    let mut bits = vec![false; w * h];
    for t in tris {
        // Conservative: per row, the x-range of the triangle within the row, grown by the padding.
        let c = corners(*t, p).map(|q| [(q[0] - lo[0]) / cell + g, (q[1] - lo[1]) / cell + g]);
        let y0 = c.iter().fold(f64::INFINITY, |a, q| a.min(q[1]));
        let y1 = c.iter().fold(f64::NEG_INFINITY, |a, q| a.max(q[1]));
        for row in y0.floor() as usize..=(y1.floor() as usize).min(h - 1 - grow) {
            let (ra, rb) = (row as f64, row as f64 + 1.0);
            let (mut xa, mut xb) = (f64::INFINITY, f64::NEG_INFINITY);
            for k in 0..3 {
                let (a, b) = (c[k], c[(k + 1) % 3]);
                let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
                if b[1] < ra || a[1] > rb {
                    continue;
                }
                let at = |y: f64| {
                    if b[1] > a[1] {
                        a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1])).clamp(0.0, 1.0)
                    } else {
                        a[0]
                    }
                };
                for x in [at(ra), at(rb)] {
                    xa = xa.min(x);
                    xb = xb.max(x);
                }
                if b[1] == a[1] {
                    xa = xa.min(b[0]);
                    xb = xb.max(b[0]);
                }
            }
            if xa > xb {
                continue;
            }
            let (i, j) =
                ((xa.floor() as usize).saturating_sub(grow), (xb.floor() as usize + grow).min(w - 1));
            for r in row.saturating_sub(grow)..=(row + grow).min(h - 1) {
                bits[r * w + i..=r * w + j].fill(true);
            }
        }
    }
    let mut runs = Vec::new();
    for r in 0..h {
        let mut i = 0;
        while i < w {
            if bits[r * w + i] {
                let from = i;
                while i < w && bits[r * w + i] {
                    i += 1;
                }
                runs.push((r as u32, from as u32, i as u32));
            } else {
                i += 1;
            }
        }
    }
    // Widest first: it rules out most positions at once.
    runs.sort_by_key(|r| (std::cmp::Reverse(r.2 - r.1), r.0, r.1));
    (Mask { width: w, height: h, runs }, [lo[0] - g * cell, lo[1] - g * cell])
}

/// Occupied cells, row after row, 64 to a word.
struct Grid {
    words: usize,
    width: usize,
    rows: Vec<u64>,
}

fn shift_or(into: &mut [u64], from: &[u64], by: usize) {
    let (w, b) = (by / 64, by % 64);
    for i in 0..into.len() {
        let lo = from.get(i + w).copied().unwrap_or(0);
        let hi = from.get(i + w + 1).copied().unwrap_or(0);
        into[i] |= if b == 0 { lo } else { (lo >> b) | (hi << (64 - b)) };
    }
}

impl Grid {
    fn row(&self, y: usize) -> &[u64] {
        self.rows.get(y * self.words..(y + 1) * self.words).unwrap_or(&[])
    }
    /// The lowest, then leftmost, free position with top at most `limit`.
    fn find(&self, m: &Mask, limit: usize) -> Option<(usize, usize)> {
        if m.width > self.width || m.height > limit {
            return None;
        }
        let last = self.width - m.width;
        let mut blocked = vec![0u64; self.words];
        let mut a = vec![0u64; self.words];
        let mut b = vec![0u64; self.words];
        for y in 0..=limit - m.height {
            blocked.fill(0);
            let mut full = false;
            for (n, &(r, from, to)) in m.runs.iter().enumerate() {
                let row = self.row(y + r as usize);
                if row.is_empty() {
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
                    full = true;
                    break;
                }
            }
            if !full && let Some(x) = first_free(&blocked, last) {
                return Some((x, y));
            }
        }
        None
    }
    fn put(&mut self, m: &Mask, x: usize, y: usize) {
        let need = (y + m.height) * self.words;
        if self.rows.len() < need {
            self.rows.resize(need, 0);
        }
        for &(r, from, to) in &m.runs {
            for i in x + from as usize..x + to as usize {
                self.rows[(y + r as usize) * self.words + i / 64] |= 1 << (i % 64);
            }
        }
    }
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

/// Packs everything on one square page.
pub(super) fn pack(charts: &[Chart], page_size: u32, padding: u32) -> Vec<Place> {
    let area: f64 = charts.iter().map(|c| c.area).sum();
    let grow = ((f64::from(padding) * CELLS as f64 / f64::from(page_size)).ceil() as usize).max(1);
    let upright: Vec<[f64; 2]> = charts.iter().map(|c| upright(&c.uv)).collect();
    let extent: Vec<f64> = charts
        .iter()
        .zip(&upright)
        .map(|(c, r)| {
            let p = rotated(&c.uv, *r);
            let f = |k: usize| {
                p.iter().fold(f64::NEG_INFINITY, |a, q| a.max(q[k]))
                    - p.iter().fold(f64::INFINITY, |a, q| a.min(q[k]))
            };
            f(0) + 0.3 * f(1)
        })
        .collect();
    let mut order: Vec<usize> = (0..charts.len()).collect();
    order.sort_by(|&a, &b| extent[b].total_cmp(&extent[a]).then(a.cmp(&b)));
    let mut best: Option<(f64, Vec<Place>)> = None;
    // Wide enough for the widest chart standing on its short side.
    for fill in [0.8, 0.7] {
        let side = (area / fill).sqrt();
        let cell = side / CELLS as f64;
        let mut grid = Grid { words: CELLS.div_ceil(64), width: CELLS, rows: Vec::new() };
        let mut top = 0;
        let mut places =
            vec![Place { page: 0, rotation: [1.0, 0.0], scale: 1.0, shift: [0.0; 2] }; charts.len()];
        let mut right = CELLS;
        for &c in &order {
            let mut found: Option<(usize, usize, usize, Mask, [f64; 2], [f64; 2])> = None;
            for turn in 0..4 {
                let [x, y] = upright[c];
                let r = [[x, y], [-y, x], [-x, -y], [y, -x]][turn];
                let p = rotated(&charts[c].uv, r);
                let (tight, origin) = rasterise(&charts[c].tris, &p, cell, 0);
                let (grown, _) = rasterise(&charts[c].tris, &p, cell, grow);
                let limit = found.as_ref().map_or(top.max(CELLS) + grown.height + 64, |f| f.0 + 2 * grow);
                if let Some((x, y)) = grid.find(&grown, limit) {
                    let score = y + tight.height;
                    if found.as_ref().is_none_or(|f| score < f.0) {
                        found = Some((score, x + grow, y + grow, tight, r, origin));
                    }
                }
            }
            let Some((score, x, y, mask, r, origin)) = found else {
                // Wider than the page: signal failure of this width.
                right = usize::MAX;
                break;
            };
            grid.put(&mask, x, y);
            top = top.max(score);
            places[c] = Place {
                page: 0,
                rotation: r,
                scale: 1.0,
                shift: [x as f64 * cell - origin[0], y as f64 * cell - origin[1]],
            };
        }
        if right == usize::MAX {
            continue;
        }
        let size = (top + grow).max(right) as f64 * cell;
        if best.as_ref().is_none_or(|b| size < b.0) {
            best = Some((size, places));
        }
    }
    let (size, mut places) = best.unwrap_or_else(|| shelves(charts, &upright));
    for p in &mut places {
        p.scale = 1.0 / size;
        p.shift = p.shift.map(|x| x / size);
    }
    places
}

/// Rows of bounding boxes: what is left when a chart is wider than a well-filled page.
fn shelves(charts: &[Chart], upright: &[[f64; 2]]) -> (f64, Vec<Place>) {
    let boxes: Vec<[[f64; 2]; 2]> = charts
        .iter()
        .zip(upright)
        .map(|(c, r)| {
            let p = rotated(&c.uv, *r);
            let mut b = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
            for q in &p {
                for k in 0..2 {
                    b[0][k] = b[0][k].min(q[k]);
                    b[1][k] = b[1][k].max(q[k]);
                }
            }
            b
        })
        .collect();
    let width = boxes.iter().fold(0f64, |a, b| a.max(b[1][0] - b[0][0])) * 1.01;
    let gap = width * 0.005;
    let mut order: Vec<usize> = (0..charts.len()).collect();
    order.sort_by(|&a, &b| {
        (boxes[b][1][1] - boxes[b][0][1]).total_cmp(&(boxes[a][1][1] - boxes[a][0][1])).then(a.cmp(&b))
    });
    let (mut x, mut y, mut row) = (gap, gap, 0f64);
    let mut out = vec![Place { page: 0, rotation: [1.0, 0.0], scale: 1.0, shift: [0.0; 2] }; charts.len()];
    for c in order {
        let (w, h) = (boxes[c][1][0] - boxes[c][0][0], boxes[c][1][1] - boxes[c][0][1]);
        if x + w > width + gap {
            x = gap;
            y += row + gap;
            row = 0.0;
        }
        out[c] = Place {
            page: 0,
            rotation: upright[c],
            scale: 1.0,
            shift: [x - boxes[c][0][0], y - boxes[c][0][1]],
        };
        x += w + gap;
        row = row.max(h);
    }
    ((y + row + gap).max(width + 2.0 * gap), out)
}
