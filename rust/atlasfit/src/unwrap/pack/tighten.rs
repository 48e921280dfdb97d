//! The last texels of a packing: the page shrinks a little at a time, and the charts on it give way to each other.
//!
//! In: places on one page. Out: places that are closer together, with exactly the padding asked for. Charts made of
//! cells lie a cell or more farther apart than they must. Here they are drawn towards the page's corner in proportion,
//! then shifted as little as keeps their outlines apart: each nearest vertex and edge of two charts must keep the padding
//! along the line between them, as in the compaction of Li and Milenkovic (1995), whose linear program is replaced by
//! projecting one such constraint after the other (Müller et al. 2007).

use super::{Goal, Place};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Lengths here are in this share of the page's longer side as it comes in.
const UNITS: f64 = 1024.0;
/// Least distance of charts, where no padding is asked for.
const LEAST_GAP: f64 = 0.25;
/// The charts' distances may lack this much, and are aimed to have as much too much.
const TOLERANCE: f64 = 0.01;
/// The page shrinks by this much at a time, at most; by half as much after a failure, so many times; so often in all.
const STEP: f64 = 3.0;
const HALVINGS: usize = 2;
const TRIES: usize = 80;
/// Charts nearer than this beyond the padding are kept apart.
const REACH: f64 = 2.5;
/// Rounds of finding what is near, and passes over all constraints in each.
const ROUNDS: usize = 8;
/// From this round on, what is lacking must become less by this factor.
const PATIENCE: usize = 3;
const PROGRESS: f64 = 0.9;
const PASSES: usize = 60;
/// What may come near is found again after charts moved by half of this.
const MARGIN: f64 = 3.0;
/// More charts than this leave little to gain; more border edges take too much memory, at some fifty near ones each.
const MOST: usize = 1000;
const MOST_EDGES: usize = 100_000;

/// A chart as it was placed: its border, in units.
struct Shape {
    /// Border edges; their first ends are all border vertices.
    edges: Vec<[[f64; 2]; 2]>,
    lo: [f64; 2],
    hi: [f64; 2],
}

/// The distance of two charts at one place, and the direction from the second to the first.
#[derive(Clone, Copy)]
struct Contact {
    a: u32,
    b: u32,
    gap: f64,
    normal: [f64; 2],
}

/// A page, in units.
#[derive(Clone, Copy)]
struct Page {
    size: [f64; 2],
    gap: f64,
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Pushes the charts together; `None` where that gains nothing.
pub(super) fn tighten(
    charts: &[Chart],
    places: &[Place],
    density: f64,
    goal: &Goal,
    ctx: &Context<'_>,
) -> Result<Option<(Vec<Place>, f64)>> {
    if charts.len() > MOST || charts.iter().map(|c| c.border.len()).sum::<usize>() > MOST_EDGES {
        return Ok(None);
    }
    let longer = f64::from(goal.page[0].max(goal.page[1]));
    let unit = longer / density / UNITS;
    let shapes: Vec<Shape> =
        charts.par_iter().zip(places).map(|(c, p)| Shape::new(&c.outline(), p, unit)).collect();
    ctx.check()?;
    let shape = goal.page.map(|p| f64::from(p) / longer);
    let share = f64::from(goal.padding) / longer;
    let page = |side: f64| Page { size: shape.map(|s| s * side), gap: (share * side).max(LEAST_GAP) };
    let mut side = UNITS;
    let mut shifts = vec![[0.0; 2]; shapes.len()];
    let mut near = Near::find(&shapes, &shifts, page(side), ctx)?;
    let (mut step, mut halvings) = (STEP, 0);
    // Charts pass through each other in no step: two places come nearer by at most its share of how far apart their charts' middles are, and this by
    // less than the least distance.
    let slow = 0.7 / shape[0].hypot(shape[1]);
    let mut least = least_gap(&near.contacts(&shapes, &shifts, page(side)), page(side));
    for _ in 0..TRIES {
        step = step.min(slow * least);
        let target = side - step;
        // Towards the corner: what lies between two charts shrinks in proportion to how far apart they are.
        let pull = step / side;
        let mut next: Vec<[f64; 2]> = (shapes.iter().zip(&shifts))
            .map(|(s, d)| [0, 1].map(|k| d[k] - pull * (0.5 * (s.lo[k] + s.hi[k]) + d[k])))
            .collect();
        if let Some(gap) = separate(&shapes, &mut next, page(target), &mut near, ctx)? {
            (shifts, side, least) = (next, target, gap);
        } else if halvings == HALVINGS {
            break;
        } else {
            (step, halvings) = (0.5 * step, halvings + 1);
        }
    }
    if side == UNITS {
        return Ok(None);
    }
    let moved = (places.iter().zip(&shifts))
        .map(|(p, d)| Place { shift: [0, 1].map(|k| p.shift[k] + d[k] * unit), ..*p })
        .collect();
    Ok(Some((moved, density * UNITS / side)))
}

impl Shape {
    fn new(outline: &[[f64; 2]], place: &Place, unit: f64) -> Self {
        let [c, s] = place.rotation;
        let at = |p: &[f64; 2]| {
            let turned = [c * p[0] - s * p[1], s * p[0] + c * p[1]];
            [0, 1].map(|k| (turned[k] + place.shift[k]) / unit)
        };
        let points: Vec<[f64; 2]> = outline.iter().map(at).collect();
        let (lo, hi) = super::bounds(&points);
        Self { edges: points.chunks_exact(2).map(|e| [e[0], e[1]]).collect(), lo, hi }
    }
}

/// The least distance of two charts, as far as it is looked for.
fn least_gap(contacts: &[Contact], page: Page) -> f64 {
    contacts.iter().map(|c| c.gap).fold(page.gap + REACH, f64::min)
}

/// Shifts charts until all are apart and on the page. Gives their least distance; `None` where that was not possible.
fn separate(
    shapes: &[Shape],
    shifts: &mut [[f64; 2]],
    page: Page,
    near: &mut Near,
    ctx: &Context<'_>,
) -> Result<Option<f64>> {
    let too_large = |s: &Shape| (0..2).any(|k| s.hi[k] - s.lo[k] + 2.0 * page.gap > page.size[k]);
    if shapes.iter().any(too_large) {
        return Ok(None);
    }
    let mut last = f64::INFINITY;
    for round in 0..ROUNDS {
        ctx.check()?;
        if !near.holds(shapes, shifts, page) {
            *near = Near::find(shapes, shifts, page, ctx)?;
        }
        let contacts = near.contacts(shapes, shifts, page);
        let least = least_gap(&contacts, page);
        let outside = |(s, d): (&Shape, &[f64; 2])| {
            let beyond = |k: usize| (-s.lo[k] - d[k]).max(s.hi[k] + d[k] - page.size[k]);
            page.gap + beyond(0).max(beyond(1))
        };
        let lack = (shapes.iter().zip(shifts.iter())).map(outside).fold(page.gap - least, f64::max);
        if lack <= TOLERANCE {
            return Ok(Some(least));
        }
        // Charts that nearly touch may be on the wrong sides of each other after another step.
        if round + 1 == ROUNDS || least < 0.1 * page.gap || round >= PATIENCE && lack > PROGRESS * last {
            return Ok(None);
        }
        last = lack;

        let more = project(&contacts, shapes, shifts, page);
        let most = 0.45 * least;
        for (d, m) in shifts.iter_mut().zip(&more) {
            // As above: less than the least distance for two.
            let part = (most / dot(*m, *m).sqrt()).min(1.0);
            *d = [d[0] + part * m[0], d[1] + part * m[1]];
        }
    }
    Ok(None)
}

/// Shifts that satisfy the contacts and keep to the page, as far as some passes go.
fn project(contacts: &[Contact], shapes: &[Shape], shifts: &[[f64; 2]], page: Page) -> Vec<[f64; 2]> {
    let mut more = vec![[0.0; 2]; shapes.len()];
    for _ in 0..PASSES {
        let mut worst: f64 = 0.0;
        for c in contacts {
            let (a, b) = (c.a as usize, c.b as usize);
            let apart = dot(c.normal, [more[a][0] - more[b][0], more[a][1] - more[b][1]]);
            let lack = page.gap + TOLERANCE - c.gap - apart;
            if lack > 0.0 {
                worst = worst.max(lack);
                for k in 0..2 {
                    more[a][k] += 0.5 * lack * c.normal[k];
                    more[b][k] -= 0.5 * lack * c.normal[k];
                }
            }
        }
        for (i, s) in shapes.iter().enumerate() {
            for k in 0..2 {
                let at = shifts[i][k] + more[i][k];
                let low = page.gap - (s.lo[k] + at);
                let high = s.hi[k] + at - (page.size[k] - page.gap);
                if low > 0.0 {
                    more[i][k] += low;
                } else if high > 0.0 {
                    more[i][k] -= high;
                }
                worst = worst.max(low).max(high);
            }
        }
        if worst < 0.5 * TOLERANCE {
            break;
        }
    }
    more
}

/// Vertices and edges of different charts that are near each other, or may come near.
struct Near {
    /// For each chart: its border vertex (the first end of this edge), another chart, and that one's edge.
    pairs: Vec<Vec<[u32; 3]>>,
    /// The charts' shifts and the page's width when this was found.
    shifts: Vec<[f64; 2]>,
    width: f64,
}

impl Near {
    fn find(shapes: &[Shape], shifts: &[[f64; 2]], page: Page, ctx: &Context<'_>) -> Result<Self> {
        let reach = page.gap + REACH + MARGIN;
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
    fn holds(&self, shapes: &[Shape], shifts: &[[f64; 2]], page: Page) -> bool {
        let pull = 1.0 - page.size[0] / self.width;
        let moved = |i: usize| {
            let s = &shapes[i];
            let rest = [0, 1].map(|k| {
                let middle = 0.5 * (s.lo[k] + s.hi[k]) + self.shifts[i][k];
                shifts[i][k] - self.shifts[i][k] + pull * middle
            });
            dot(rest, rest).sqrt() + 0.5 * pull * (s.hi[0] - s.lo[0]).hypot(s.hi[1] - s.lo[1])
        };
        (0..shapes.len()).all(|i| 2.0 * moved(i) < MARGIN)
    }

    /// The nearest places of charts that are near each other, one for every direction between two of them.
    fn contacts(&self, shapes: &[Shape], shifts: &[[f64; 2]], page: Page) -> Vec<Contact> {
        let reach = page.gap + REACH;
        let of = |i: usize| {
            let mut nearest: FxHashMap<(u32, u8), Contact> = FxHashMap::default();
            for &[n, j, e] in &self.pairs[i] {
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
            found
        };
        let found: Vec<Vec<_>> = (0..shapes.len()).into_par_iter().map(of).collect();
        found.into_iter().flatten().map(|f| f.1).collect()
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use crate::unwrap::Packer;
    use crate::unwrap::pack::Packing;
    use proptest::prelude::*;

    const PADDING: u32 = 4;

    fn rectangle([w, h]: [f64; 2]) -> Chart {
        Chart {
            faces: vec![0, 1],
            tris: vec![[0, 1, 2], [0, 2, 3]],
            uv: vec![[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]],
            border: vec![(0, 0), (0, 1), (1, 1), (1, 2)],
            area: w * h,
            ..Chart::default()
        }
    }

    /// Rectangles at corners on a page of some side; the corners afterwards, and the side.
    fn tightened(boxes: &[([f64; 2], [f64; 2])], side: f64) -> Option<(Vec<[f64; 2]>, f64)> {
        let charts: Vec<Chart> = boxes.iter().map(|b| rectangle(b.1)).collect();
        let places: Vec<Place> = boxes.iter().map(|b| Place { shift: b.0, ..Place::default() }).collect();
        let goal = Goal {
            page: [1024; 2],
            padding: PADDING,
            density: None,
            pages: 1,
            packer: Packing::Own(Packer::Shapes),
            seed: 0,
        };
        let run = |ctx: &Context<'_>| tighten(&charts, &places, 1024.0 / side, &goal, ctx);
        let (places, density) = Run::default().execute(run).expect("nothing cancels")?;
        Some((places.iter().map(|p| p.shift).collect(), 1024.0 / density))
    }

    #[test]
    fn three_squares_in_a_row_end_with_the_padding_between_them() {
        let boxes = [0.05, 1.12, 2.2].map(|x| ([x, 0.1], [1.0; 2]));
        let (at, side) = tightened(&boxes, 3.3).expect("there is room");
        let least = 3.0 / (1.0 - 4.0 * f64::from(PADDING) / 1024.0);
        assert!((least - 1e-3..1.005 * least).contains(&side), "{side} for {least}");
        let gap = f64::from(PADDING) / 1024.0 * side;
        for pair in at.windows(2) {
            assert!(pair[1][0] - pair[0][0] - 1.0 > 0.98 * gap, "{at:?}");
        }
    }

    #[test]
    fn a_page_without_room_stays_as_it_is() {
        let gap = f64::from(PADDING) / 1024.0;
        assert_eq!(tightened(&[([gap; 2], [1.0 - 2.0 * gap; 2])], 1.0), None);
    }

    proptest! {
        #[test]
        fn charts_keep_their_padding_and_stay_on_the_page(
            sizes in prop::collection::vec((0.05..0.2f64, 0.05..0.2f64, 0.0..1.0f64, 0.0..1.0f64), 16)
        ) {
            let boxes: Vec<_> = (sizes.iter().enumerate())
                .map(|(i, &(w, h, x, y))| {
                    let room = |size: f64| 0.25 - 0.02 - size;
                    let at = |k: usize, part: f64, size: f64| 0.25 * k as f64 + 0.01 + part * room(size);
                    ([at(i % 4, x, w), at(i / 4, y, h)], [w, h])
                })
                .collect();
            if let Some((at, side)) = tightened(&boxes, 1.0) {
                prop_assert!(side < 1.0);
                let least = 0.98 * f64::from(PADDING) / 1024.0 * side;
                for (i, (p, b)) in at.iter().zip(&boxes).enumerate() {
                    for k in 0..2 {
                        prop_assert!(p[k] > least && p[k] + b.1[k] < side - least);
                    }
                    for (q, c) in at[..i].iter().zip(&boxes) {
                        let apart = [0, 1].map(|k| (q[k] - p[k] - b.1[k]).max(p[k] - q[k] - c.1[k]).max(0.0));
                        prop_assert!(apart[0].hypot(apart[1]) > least, "{apart:?}");
                    }
                }
            }
        }
    }
}
