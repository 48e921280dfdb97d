//! Which charts on a page are near each other, where, and how far apart.

use super::constants::TIGHTEN;
use super::placement::Placement;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::planar::{bounds, turned};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// A chart as it was placed: its border, in shares of the page (`tighten` says which).
pub(super) struct Shape {
    /// Border edges; their first ends are all border vertices.
    pub edges: Vec<[[f64; 2]; 2]>,
    /// The middle of its box, which it turns about.
    pub middle: [f64; 2],
    /// The greatest distance of a border vertex from the middle.
    pub radius: f64,
    /// How readily it turns: one over its border's mean squared distance from the middle; 0 for a chart that
    /// must not turn, or whose border lies along the page's sides for the most part.
    pub turns: f64,
}

impl Shape {
    /// A chart with an outline as placed; `unit` of the surface are one here.
    pub(super) fn new(outline: &[[f64; 2]], turns: bool, place: &Placement, unit: f64) -> Self {
        let at = |p: &[f64; 2]| plus(turned(*p, place.rotation), place.shift).map(|x| x / unit);
        let points: Vec<[f64; 2]> = outline.iter().map(at).collect();
        let (lo, hi) = bounds(&points);
        let middle = [0, 1].map(|k| 0.5 * (lo[k] + hi[k]));
        let far2 = |p: &[f64; 2]| (p[0] - middle[0]).powi(2) + (p[1] - middle[1]).powi(2);
        let mean2 = points.iter().map(far2).sum::<f64>() / points.len().max(1) as f64;
        let edges: Vec<[[f64; 2]; 2]> = points.chunks_exact(2).map(|e| [e[0], e[1]]).collect();
        let turns = turns && !lies_along_page(&edges);
        Self {
            edges,
            middle,
            radius: points.iter().map(far2).fold(0.0, f64::max).sqrt(),
            turns: if turns && mean2 > 0.0 { 1.0 / mean2 } else { 0.0 },
        }
    }

    /// The chart after a motion.
    pub(super) fn moved(&self, motion: &Motion) -> Moved {
        let middle = plus(self.middle, motion.shift);
        let rotation = motion.rotation();
        let at = |p: [f64; 2]| plus(middle, turned([p[0] - self.middle[0], p[1] - self.middle[1]], rotation));
        let edges: Vec<[[f64; 2]; 2]> = self.edges.iter().map(|e| e.map(at)).collect();
        let (lo, hi) = bounds(edges.as_flattened());
        Moved { edges, middle, lo, hi }
    }
}

/// How a chart has moved since it was placed: turned about its middle by an angle in radians, and shifted.
#[derive(Clone, Copy, Default)]
pub(super) struct Motion {
    pub shift: [f64; 2],
    pub angle: f64,
}

impl Motion {
    /// The cosine and sine of its angle.
    pub(super) fn rotation(&self) -> [f64; 2] {
        [self.angle.cos(), self.angle.sin()]
    }
}

/// A chart where it is now.
pub(super) struct Moved {
    edges: Vec<[[f64; 2]; 2]>,
    /// What it turns about.
    pub middle: [f64; 2],
    /// Its box.
    lo: [f64; 2],
    hi: [f64; 2],
}

/// A page, in the units of the shapes.
#[derive(Clone, Copy)]
pub(super) struct Page {
    pub size: [f64; 2],
    /// Least distance between charts, and from the border.
    pub gap: f64,
}

/// Whether most of a border runs along the sides of the page: texels then fit its edges.
fn lies_along_page(edges: &[[[f64; 2]; 2]]) -> bool {
    let (mut all, mut along) = (0.0, 0.0);
    for &[a, b] in edges {
        let [x, y] = [0, 1].map(|k| (b[k] - a[k]).abs());
        let length = x.hypot(y);
        all += length;
        along += if x.min(y) <= TIGHTEN.askew * length { length } else { 0.0 };
    }
    along > 0.5 * all
}

/// The distance of a chart from another, or from a side of the page, at one place.
#[derive(Clone, Copy)]
pub(super) struct Contact {
    pub a: u32,
    /// [`WALL`] for a side of the page.
    pub b: u32,
    pub gap: f64,
    /// The direction to `a`.
    pub normal: [f64; 2],
    /// How far `a` comes along the normal if it turns by one, and `b`.
    pub arms: [f64; 2],
}

/// A side of the page, in place of a chart.
pub(super) const WALL: u32 = u32::MAX;

/// Vertices and edges of different charts that are near each other, or may come near.
pub(super) struct Near {
    /// For each chart: its border vertex (the first end of this edge), another chart, and that one's edge.
    pairs: Vec<Vec<[u32; 3]>>,
    /// The charts' motions and the page's width when this was found.
    motions: Vec<Motion>,
    width: f64,
}

impl Near {
    /// Looks for them through a grid of cells.
    pub(super) fn find(moved: &[Moved], motions: &[Motion], page: Page, ctx: &Context<'_>) -> Result<Self> {
        let reach = page.gap + TIGHTEN.reach + TIGHTEN.margin;
        let cells = page.size.map(|s| (s / reach) as usize + 3);
        let cell = |p: [f64; 2]| [0, 1].map(|k| ((p[k] / reach).max(0.0) as usize + 1).min(cells[k] - 2));
        // Every edge, cut into pieces no longer than a cell, in all cells of its pieces' boxes.
        let mut entries: Vec<(u32, u32, u32)> = Vec::new();
        for (i, chart) in moved.iter().enumerate() {
            ctx.check()?;
            for (e, &[a, b]) in chart.edges.iter().enumerate() {
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
        let pairs = (0..moved.len())
            .into_par_iter()
            .map(|i| {
                let mut pairs = Vec::new();
                for (n, &[p, _]) in moved[i].edges.iter().enumerate() {
                    ctx.check_at(n)?;
                    let [x, y] = cell(p);
                    let first = pairs.len();
                    for row in y - 1..=y + 1 {
                        let from = start[row * cells[0] + x - 1] as usize;
                        let to = start[row * cells[0] + x + 2] as usize;
                        for &(j, e) in sorted[from..to].iter().filter(|s| s.0 as usize != i) {
                            // Long edges lie in several cells.
                            let pair = [n as u32, j, e];
                            let away = away(p, moved[j as usize].edges[e as usize]);
                            if dot(away, away) < reach * reach && !pairs[first..].contains(&pair) {
                                pairs.push(pair);
                            }
                        }
                    }
                }
                Ok(pairs)
            })
            .collect::<Result<_>>()?;
        Ok(Self { pairs, motions: motions.to_vec(), width: page.size[0] })
    }

    /// Whether no two places that were out of reach can have come near since.
    pub(super) fn holds(&self, shapes: &[Shape], motions: &[Motion], page: Page) -> bool {
        let pull = 1.0 - page.size[0] / self.width;
        let moved = |i: usize| {
            let (s, old, new) = (&shapes[i], &self.motions[i], &motions[i]);
            let rest = [0, 1].map(|k| new.shift[k] - old.shift[k] + pull * (s.middle[k] + old.shift[k]));
            dot(rest, rest).sqrt() + s.radius * (pull + (new.angle - old.angle).abs())
        };
        (0..shapes.len()).all(|i| 2.0 * moved(i) < TIGHTEN.margin)
    }

    /// The nearest places of charts that are near each other or a side of the page: one for every direction
    /// between two of them, and for either side of where each would turn.
    pub(super) fn contacts(&self, moved: &[Moved], page: Page, ctx: &Context<'_>) -> Result<Vec<Contact>> {
        let reach = page.gap + TIGHTEN.reach;
        let of = |i: usize| {
            let a = &moved[i];
            let mut nearest: FxHashMap<(u32, u8), Contact> = FxHashMap::default();
            let mut meet = |contact: Contact| {
                let sides = contact
                    .arms
                    .iter()
                    .fold(direction(contact.normal), |d, &arm| 2 * d + u8::from(arm > 0.0));
                let known = nearest.entry((contact.b, sides)).or_insert(contact);
                if contact.gap < known.gap {
                    *known = contact;
                }
            };
            for (at, &[n, j, e]) in self.pairs[i].iter().enumerate() {
                ctx.check_at(at)?;
                let (p, b) = (a.edges[n as usize][0], &moved[j as usize]);
                let d = away(p, b.edges[e as usize]);
                let gap = dot(d, d);
                if gap < reach * reach {
                    let gap = gap.sqrt();
                    let normal = if gap > 0.0 { d.map(|x| x / gap) } else { [1.0, 0.0] };
                    let arms = [arm(p, a.middle, normal), arm([p[0] - d[0], p[1] - d[1]], b.middle, normal)];
                    meet(Contact { a: i as u32, b: j, gap, normal, arms });
                }
            }
            for k in 0..2 {
                for normal in [1.0, -1.0] {
                    let inside = |x: f64| if normal > 0.0 { x } else { page.size[k] - x };
                    if inside(a.lo[k]).min(inside(a.hi[k])) >= reach {
                        continue;
                    }
                    let mut to = [0.0; 2];
                    to[k] = normal;
                    for &[p, _] in &a.edges {
                        let arms = [arm(p, a.middle, to), 0.0];
                        meet(Contact { a: i as u32, b: WALL, gap: inside(p[k]), normal: to, arms });
                    }
                }
            }
            let mut found: Vec<_> = nearest.into_iter().collect();
            found.sort_unstable_by_key(|f| f.0);
            Ok(found)
        };
        let found: Vec<Vec<_>> = (0..moved.len()).into_par_iter().map(of).collect::<Result<_>>()?;
        Ok(found.into_iter().flatten().map(|f| f.1).collect())
    }
}

/// The least distance of two charts, as far as it is looked for.
pub(super) fn least_gap(contacts: &[Contact], page: Page) -> f64 {
    contacts.iter().filter(|c| c.b != WALL).map(|c| c.gap).fold(page.gap + TIGHTEN.reach, f64::min)
}

/// How far a point comes along a normal if it turns by one about a middle.
fn arm(p: [f64; 2], middle: [f64; 2], normal: [f64; 2]) -> f64 {
    (p[0] - middle[0]) * normal[1] - (p[1] - middle[1]) * normal[0]
}

/// The dot product.
pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The sum.
pub(super) fn plus(p: [f64; 2], d: [f64; 2]) -> [f64; 2] {
    [p[0] + d[0], p[1] + d[1]]
}

/// From the nearest point of an edge to `p`.
pub(super) fn away(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> [f64; 2] {
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
