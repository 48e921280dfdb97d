//! Faces change hands between charts that are neighbours, where that makes the seam between them shorter.
//!
//! In: merged charts. Out: as many charts, within the same bound, with shorter borders.
//!
//! `ways` finds the shortest border in the `region` of the present one. What it would move to the other chart
//! is cut off where it is and merged where it goes, under the conditions of every merge.

use super::charts::{Borders, Charts};
use super::constants::MERGE;
use super::glue::price_of_waste;
use super::join::joined;
use super::limits::MergeLimits;
use super::patch::{Pair, Worth};
use super::region::{Move, Neighbouring};
use super::rounds::merge_again;
use super::ways::sides;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::inject::border_touches;
use crate::unwrap::chart::{Chart, Seams};
use crate::unwrap::constants::UNWRAP;
use crate::unwrap::cut::cut;
use crate::unwrap::flatten::shape::{all_positive, over_area};
use crate::unwrap::surface::{NONE, Surface};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// Moves borders to where they are shorter, and merges charts that fit since.
pub(crate) fn shorten_borders(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    let count = |charts: &Charts| charts.list.iter().flatten().count();
    let mut settled = Settled::default();
    trade(s, charts, bound, MERGE.reaches, &mut settled, ctx)?;
    for _ in 0..MERGE.regrowths {
        let before = count(charts);
        merge_again(s, charts, bound, ctx)?;
        if count(charts) == before {
            break;
        }
        // Merged charts have new numbers: what is settled of the others still is.
        trade(s, charts, bound, MERGE.reaches, &mut settled, ctx)?;
    }
    Ok(())
}

/// The same for a large mesh, in less time: one reach is tried, and nothing is merged.
pub(crate) fn shorten_borders_of_large(
    s: &Surface,
    charts: &mut Charts,
    bound: f64,
    ctx: &Context<'_>,
) -> Result<()> {
    trade(s, charts, bound, MERGE.reaches_of_large, &mut Settled::default(), ctx)
}

/// Pairs of which nothing is to be had as long as nothing changes beside their border.
type Settled = FxHashSet<(u32, u32)>;

/// Moves borders until none gets shorter within so many reaches.
fn trade(
    s: &Surface,
    charts: &mut Charts,
    bound: f64,
    reaches: i32,
    settled: &mut Settled,
    ctx: &Context<'_>,
) -> Result<()> {
    let limits = MergeLimits {
        bound,
        over: MERGE.over * UNWRAP.beyond,
        mismatch: MERGE.mismatch,
        hard: false,
        whole: true,
        darts: false,
    };
    loop {
        ctx.check()?;
        let borders = Borders::find(s, charts);
        let mut busy = vec![0; charts.list.len()];
        let apart = |c: u32| charts.kept_apart[c as usize];
        let mut open: Vec<Border> = (borders.edges.chunk_by(|x, y| x.charts == y.charts))
            .map(|edges| Border {
                charts: edges[0].charts,
                length: edges.iter().map(|e| e.length).sum(),
                cost: edges.iter().map(|e| e.cost).sum(),
            })
            .filter(|b| !(settled.contains(&b.charts) || apart(b.charts.0) && apart(b.charts.1)))
            .collect();
        open.sort_by(|x, y| y.cost.total_cmp(&x.cost).then(x.charts.cmp(&y.charts)));
        open.retain(|&Border { charts: (a, b), .. }| {
            let free = busy[a as usize].max(busy[b as usize]) < MERGE.trades_at_once;
            busy[a as usize] += u32::from(free);
            busy[b as usize] += u32::from(free);
            free
        });
        if open.is_empty() {
            return Ok(());
        }
        // Charts hold the bound all together: what one stretches more is taken from all.
        let (area, over) =
            charts.list.iter().flatten().fold((0.0, 0.0), |(area, over), c| (area + c.area, over + c.over));
        let mut left = (MERGE.spent * UNWRAP.beyond * area - over).max(0.0);
        let results: Vec<Option<Traded>> = (open.par_iter())
            .map(|&Border { charts: (a, b), length, cost }| {
                let pair = Neighbouring { s, charts, ids: [a, b], length, cost };
                traded(&pair, reaches, limits, ctx)
            })
            .collect();
        ctx.check()?;
        let mut changed = vec![false; charts.list.len()];
        for (&Border { charts: (a, b), .. }, result) in open.iter().zip(results) {
            // What was found for charts as they were says nothing of them as they are.
            if changed[a as usize] || changed[b as usize] {
                continue;
            }
            let Some(Traded { charts: [of_a, of_b], faces }) = result else {
                settled.insert((a, b));
                continue;
            };
            let over = |c: u32| charts.list[c as usize].as_ref().map_or(0.0, |c| c.over);
            let more = of_a.over + of_b.over - over(a) - over(b);
            if more > left {
                settled.insert((a, b));
                continue;
            }
            left -= more;
            (changed[a as usize], changed[b as usize]) = (true, true);
            charts.put(a, of_a);
            charts.put(b, of_b);
            // The borders with others have changed where faces beside these have changed hands.
            let around = faces.iter().flat_map(|&f| s.twin[f as usize]).filter(|&h| h != NONE);
            for other in around.map(|h| charts.owner[h as usize / 3]) {
                for c in [a, b] {
                    settled.remove(&(c.min(other), c.max(other)));
                }
            }
        }
    }
}

/// The border of two charts.
struct Border {
    charts: (u32, u32),
    length: f64,
    /// What it costs as a seam.
    cost: f64,
}

/// What came of a pair.
pub(super) struct Traded {
    pub charts: [Chart; 2],
    /// Faces that have changed hands.
    pub faces: Vec<u32>,
}

/// Two charts with a shorter border between them, if there is one within one of the reaches, the farthest
/// first.
fn traded(pair: &Neighbouring<'_>, reaches: i32, limits: MergeLimits, ctx: &Context<'_>) -> Option<Traded> {
    for k in 0..reaches {
        let region = pair.region(pair.length * MERGE.trade_reach * 0.5f64.powi(k), ctx)?;
        let Some(side) = sides(pair.s, &region, pair.cost, ctx) else { continue };
        let moves = pair.changed(&region, &side);
        // No border within this reach is shorter, so none within a smaller one is.
        if moves.is_empty() {
            return None;
        }
        let traded =
            moved(pair, moves, Wanted { least: MERGE.trade_gain * pair.cost, bonus: 0.0 }, limits, ctx);
        if traded.is_some() {
            return traded;
        }
    }
    None
}

/// What faces must change hands for.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    /// Least cost of seams that must be saved ...
    pub least: f64,
    /// ... where so much of it counts as saved already, for what else is better then.
    pub bonus: f64,
}

/// Two charts of which faces have changed hands, as far as merges of them are accepted.
pub(super) fn moved(
    pair: &Neighbouring<'_>,
    moves: Vec<Move>,
    Wanted { least, bonus }: Wanted,
    limits: MergeLimits,
    ctx: &Context<'_>,
) -> Option<Traded> {
    let &Neighbouring { s, charts, ids: [a, b], .. } = pair;
    let bonus = Seams { length: 2.0 * bonus, cost: 2.0 * bonus };
    let chart = |id: u32| charts.list[id as usize].as_ref();
    let both = [chart(a)?, chart(b)?];
    let price = price_of_waste(limits.bound);
    let mut out: Option<Traded> = None;
    for Move { from_second, faces } in moves {
        ctx.check().ok()?;
        let [first, second] = out.as_ref().map_or(both, |t| t.charts.each_ref());
        let (giver, taker) = if from_second { (second, first) } else { (first, second) };
        let Some((rest, part)) = apart(s, giver, &faces, limits.bound, ctx) else {
            if std::env::var("DBG").is_ok() {
                eprintln!("   not apart");
            }
            continue;
        };
        let larger = taker.faces.len() >= part.faces.len();
        let (x, y) = if larger { (taker, &part) } else { (&part, taker) };
        let of: FxHashMap<u32, (bool, u32)> = [(x, false), (y, true)]
            .into_iter()
            .flat_map(|(c, is_y)| c.border.iter().map(move |b| (c.faces[b.0 as usize], (is_y, b.0))))
            .collect();
        let place = |f: usize| of.get(&(f as u32)).copied();
        let worth = Worth {
            seams: first.seams(s).with(second.seams(s)).without(rest.seams(s)).with(bonus),
            waste: first.waste + second.waste - rest.waste,
            price,
            least,
        };
        let merge = Pair { s, a: x, b: y, place: &place, limits, worth };
        let Some(c) = joined(&merge, ctx) else { continue };
        if !(survives_rounding(&c, ctx)? && survives_rounding(&rest, ctx)?) {
            continue;
        }
        let mut moved = out.take().map_or_else(Vec::new, |t| t.faces);
        moved.extend(faces);
        out = Some(Traded { charts: if from_second { [c, rest] } else { [rest, c] }, faces: moved });
    }
    out
}

/// Whether a chart neither flips nor overlaps in single precision, about as it leaves: a border through
/// slivers may. `None` when the run is to stop: the caller checks.
fn survives_rounding(c: &Chart, ctx: &Context<'_>) -> Option<bool> {
    let at: Vec<[f64; 2]> = c.uv.iter().map(|p| p.map(|x| f64::from(x as f32))).collect();
    Some(all_positive(&c.tris, &at) && !border_touches(&c.tris, &at, &c.border, ctx).ok()?)
}

/// A chart without some of its faces, and a chart of these, if both are in one piece. Both stay as they lie.
fn apart(s: &Surface, c: &Chart, faces: &[u32], bound: f64, ctx: &Context<'_>) -> Option<(Chart, Chart)> {
    let goes = |f: &u32| faces.binary_search(f).is_ok();
    let side: Vec<bool> = c.faces.iter().map(goes).collect();
    let mut parts = cut(s, c, &side, ctx);
    if parts.len() != 2 {
        return None;
    }
    for part in &mut parts {
        part.over = over_area(s, part, bound);
        part.waste = part.wasted(s.page);
    }
    let (part, rest) = (parts.pop()?, parts.pop()?);
    Some(if goes(&part.faces[0]) { (rest, part) } else { (part, rest) })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::Run;
    use crate::geometry::TriMesh;
    use crate::unwrap::first::first_charts;
    use crate::unwrap::options::UnwrapOptions;

    const SIDE: usize = 24;

    /// A square of `side` by `side` cells of two triangles, row by row.
    pub(in super::super) fn square(side: usize) -> TriMesh {
        let n = side + 1;
        let corner = |x: usize, y: usize| (y * n + x) as u32;
        let cells = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
        let triangles = cells
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        TriMesh::new((0..n * n).map(|i| [(i % n) as f64, (i / n) as f64, 0.0]).collect(), triangles)
    }

    /// A square of 24 by 24 cells in two charts, those where `second` is true of a cell's column and row and
    /// the others: the length of the border before and after, in cells, and the faces of each then.
    fn traded_on_square(second: impl Fn(usize, usize) -> bool) -> (f64, f64, [usize; 2]) {
        let cells = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        let label: Vec<u32> = cells.flat_map(|(x, y)| [u32::from(second(x, y)); 2]).collect();
        let mesh = square(SIDE);
        let run = |ctx: &Context<'_>| {
            let s = Surface::new(&mesh, &UnwrapOptions::default(), ctx)?;
            let mut charts = Charts::new(s.faces(), first_charts(&s, &label, 2, Some(1.1), ctx)?);
            let border = |charts: &Charts| {
                Borders::find(&s, charts).edges.iter().map(|e| e.length).sum::<f64>() * SIDE as f64
            };
            let before = border(&charts);
            trade(&s, &mut charts, 1.1, MERGE.reaches, &mut Settled::default(), ctx)?;
            let faces = [0, 1].map(|c| charts.list[c].as_ref().map_or(0, |c| c.faces.len()));
            for (id, c) in charts.list.iter().enumerate() {
                for (i, &f) in c.iter().flat_map(|c| &c.faces).enumerate() {
                    assert_eq!(
                        (charts.owner[f as usize], charts.index_of[f as usize]),
                        (id as u32, i as u32)
                    );
                }
            }
            Ok((before, border(&charts), faces))
        };
        Run::default().execute(run).unwrap()
    }

    #[test]
    fn a_border_in_steps_becomes_straight() {
        let (before, after, faces) = traded_on_square(|x, y| x > 10 + y % 4);
        assert!(before > 50.0 && (after - SIDE as f64).abs() < 1e-4, "{before} to {after}");
        assert_eq!(faces[0] + faces[1], 2 * SIDE * SIDE);
    }

    #[test]
    fn a_closed_border_becomes_shorter_and_stays_closed() {
        let (before, after, faces) =
            traded_on_square(|x, y| (8..16).contains(&x) && (8..16).contains(&y) && !(x == 11 && y < 11));
        assert!(after < before - 4.0, "{before} to {after}");
        assert!(faces[1] > 0 && faces[0] + faces[1] == 2 * SIDE * SIDE, "{faces:?}");
    }

    #[test]
    fn a_straight_border_stays() {
        let (before, after, faces) = traded_on_square(|x, _| x >= 8);
        assert_eq!((before, faces), (after, [2 * 8 * SIDE, 2 * 16 * SIDE]));
    }
}
