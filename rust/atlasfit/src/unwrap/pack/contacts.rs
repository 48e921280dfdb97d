//! Which charts on a page are near each other, where, and how far apart.

use super::constants::TIGHTEN;
use super::placement::Placement;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::planar::bounds;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// A chart as it was placed: its border, in shares of the page (`tighten` says which).
pub(super) struct Shape {
    /// Border edges; their first ends are all border vertices.
    pub edges: Vec<[[f64; 2]; 2]>,
    /// Its box.
    pub lo: [f64; 2],
    pub hi: [f64; 2],
}

impl Shape {
    /// A chart with an outline as placed; `unit` of the surface are one here.
    pub(super) fn new(outline: &[[f64; 2]], place: &Placement, unit: f64) -> Self {
        let [c, s] = place.rotation;
        let at = |p: &[f64; 2]| {
            let turned = [c * p[0] - s * p[1], s * p[0] + c * p[1]];
            [0, 1].map(|k| (turned[k] + place.shift[k]) / unit)
        };
        let points: Vec<[f64; 2]> = outline.iter().map(at).collect();
        let (lo, hi) = bounds(&points);
        Self { edges: points.chunks_exact(2).map(|e| [e[0], e[1]]).collect(), lo, hi }
    }
}

/// A page, in the units of the shapes.
#[derive(Clone, Copy)]
pub(super) struct Page {
    pub size: [f64; 2],
    /// Least distance between charts, and from the border.
    pub gap: f64,
}

/// The distance of two charts at one place, and the direction from the second to the first.
#[derive(Clone, Copy)]
pub(super) struct Contact {
    pub a: u32,
    pub b: u32,
    pub gap: f64,
    pub normal: [f64; 2],
}

/// Vertices and edges of different charts that are near each other, or may come near.
pub(super) struct Near {
    /// For each chart: its border vertex (the first end of this edge), another chart, and that one's edge.
    pairs: Vec<Vec<[u32; 3]>>,
    /// The charts' shifts and the page's width when this was found.
    shifts: Vec<[f64; 2]>,
    width: f64,
}

impl Near {
    /// Looks for them through a grid of cells.
    pub(super) fn find(shapes: &[Shape], shifts: &[[f64; 2]], page: Page, ctx: &Context<'_>) -> Result<Self> {
        let reach = page.gap + TIGHTEN.reach + TIGHTEN.margin;
        let cells = page.size.map(|s| (s / reach) as usize + 3);
        let cell = |p: [f64; 2]| [0, 1].map(|k| ((p[k] / reach).max(0.0) as usize + 1).min(cells[k] - 2));
        // Every edge, cut into pieces no longer than a cell, in all cells of its pieces' boxes.
        let mut entries: Vec<(u32, u32, u32)> = Vec::new();
        for (i, shape) in shapes.iter().enumerate() {
            ctx.check()?;
            for (e, edge) in shape.edges.iter().enumerate() {
                let [a, b] = edge.map(|p| plus(p, shifts[i]));
                let pieces = ((b[0] - a[0]).hypot(b[1] - a[1]) / reach).ceil().max(1.0);
                for n in 0..pieces as usize {
                    let at = |t: f64| [0, 1].map(|k| a[k] + (b[k] - a[k]) * t / pieces);
                    let (p, q) = (cell(at(n as f64)), cell(at(n as f64 + 1.0)));
                    for y in p[1].min(q[1])..=p[1].max(q[1]) {
                        for x in p[0].min(q[0])..=p[0].max(q[0]) {
                            entries.push(((y * cells[0] + x) as u32, i as u32, e as u32));
                        }
                    }
                }
            }
        }
        let mut start = vec![0u32; cells[0] * cells[1] + 1];
        entries.iter().for_each(|e| start[e.0 as usize + 1] += 1);
        (1..start.len()).for_each(|c| start[c] += start[c - 1]);
        let mut next = start.clone();
        let mut sorted = vec![(0u32, 0u32); entries.len()];
        for &(c, i, e) in &entries {
            sorted[next[c as usize] as usize] = (i, e);
            next[c as usize] += 1;
        }
        let pairs = (0..shapes.len())
            .into_par_iter()
            .map(|i| {
                let mut pairs = Vec::new();
                for (n, edge) in shapes[i].edges.iter().enumerate() {
                    ctx.check_at(n)?;
                    let p = plus(edge[0], shifts[i]);
                    let [x, y] = cell(p);
                    let first = pairs.len();
                    for row in y - 1..=y + 1 {
                        let from = start[row * cells[0] + x - 1] as usize;
                        let to = start[row * cells[0] + x + 2] as usize;
                        for &(j, e) in sorted[from..to].iter().filter(|s| s.0 as usize != i) {
                            let other =
                                shapes[j as usize].edges[e as usize].map(|q| plus(q, shifts[j as usize]));
                            // Long edges lie in several cells.
                            let pair = [n as u32, j, e];
                            let away = away(p, other);
                            if dot(away, away) < reach * reach && !pairs[first..].contains(&pair) {
                                pairs.push(pair);
                            }
                        }
                    }
                }
                Ok(pairs)
            })
            .collect::<Result<_>>()?;
        Ok(Self { pairs, shifts: shifts.to_vec(), width: page.size[0] })
    }

    /// Whether no two places that were out of reach can have come near since.
    pub(super) fn holds(&self, shapes: &[Shape], shifts: &[[f64; 2]], page: Page) -> bool {
        let pull = 1.0 - page.size[0] / self.width;
        let moved = |i: usize| {
            let s = &shapes[i];
            let rest = [0, 1].map(|k| {
                let middle = 0.5 * (s.lo[k] + s.hi[k]) + self.shifts[i][k];
                shifts[i][k] - self.shifts[i][k] + pull * middle
            });
            dot(rest, rest).sqrt() + 0.5 * pull * (s.hi[0] - s.lo[0]).hypot(s.hi[1] - s.lo[1])
        };
        (0..shapes.len()).all(|i| 2.0 * moved(i) < TIGHTEN.margin)
    }

    /// The nearest places of charts that are near each other, one for every direction between two of them.
    pub(super) fn contacts(
        &self,
        shapes: &[Shape],
        shifts: &[[f64; 2]],
        page: Page,
        ctx: &Context<'_>,
    ) -> Result<Vec<Contact>> {
        let reach = page.gap + TIGHTEN.reach;
        let of = |i: usize| {
            let mut nearest: FxHashMap<(u32, u8), Contact> = FxHashMap::default();
            for (at, &[n, j, e]) in self.pairs[i].iter().enumerate() {
                ctx.check_at(at)?;
                let p = plus(shapes[i].edges[n as usize][0], shifts[i]);
                let other = shapes[j as usize].edges[e as usize].map(|q| plus(q, shifts[j as usize]));
                let d = away(p, other);
                let gap = dot(d, d);
                if gap >= reach * reach {
                    continue;
                }
                let gap = gap.sqrt();
                let normal = if gap > 0.0 { [d[0] / gap, d[1] / gap] } else { [1.0, 0.0] };
                let contact = Contact { a: i as u32, b: j, gap, normal };
                let known = nearest.entry((j, direction(normal))).or_insert(contact);
                if gap < known.gap {
                    *known = contact;
                }
            }
            let mut found: Vec<_> = nearest.into_iter().collect();
            found.sort_unstable_by_key(|f| f.0);
            Ok(found)
        };
        let found: Vec<Vec<_>> = (0..shapes.len()).into_par_iter().map(of).collect::<Result<_>>()?;
        Ok(found.into_iter().flatten().map(|f| f.1).collect())
    }
}

/// The least distance of two charts, as far as it is looked for.
pub(super) fn least_gap(contacts: &[Contact], page: Page) -> f64 {
    contacts.iter().map(|c| c.gap).fold(page.gap + TIGHTEN.reach, f64::min)
}

/// The dot product.
pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The sum.
fn plus(p: [f64; 2], d: [f64; 2]) -> [f64; 2] {
    [p[0] + d[0], p[1] + d[1]]
}

/// From the nearest point of an edge to `p`.
fn away(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> [f64; 2] {
    let d = [b[0] - a[0], b[1] - a[1]];
    let along = [p[0] - a[0], p[1] - a[1]];
    let t = (dot(along, d) / dot(d, d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    [along[0] - t * d[0], along[1] - t * d[1]]
}

/// One of 16 directions.
fn direction(n: [f64; 2]) -> u8 {
    let [x, y] = n.map(f64::abs);
    let steep = x.min(y) > (std::f64::consts::PI / 8.0).tan() * x.max(y);
    [n[0] > 0.0, n[1] > 0.0, x > y, steep].iter().fold(0, |d, &bit| 2 * d + u8::from(bit))
}
