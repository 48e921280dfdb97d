//! Borders of charts of quads run straight on: steps that nobody would have drawn are taken out.
//!
//! In: charts of a mesh with polygons. Out: as many charts, within the same bound, whose borders follow edge
//! loops with fewer turns.
//!
//! Where a border turns at a crossing of four polygons, it could have gone straight on to where it meets a
//! seam again. What lies between the two ways goes over to the other chart where that saves seam and turns,
//! under the conditions of every merge.

use super::charts::Charts;
use super::constants::MERGE;
use super::limits::MergeLimits;
use super::region::{Move, Neighbouring};
use super::trade::{Traded, Wanted, moved};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::constants::UNWRAP;
use crate::unwrap::surface::{NONE, Surface};
use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// Straightens the borders between charts of a mesh with polygons; those of triangles stay.
pub(crate) fn run_straight(s: &Surface, charts: &mut Charts, bound: f64, ctx: &Context<'_>) -> Result<()> {
    if s.cells.is_none() {
        return Ok(());
    }
    // The gap says little of thin strips: it is not asked for.
    let limits = MergeLimits {
        bound,
        over: MERGE.over * UNWRAP.beyond,
        mismatch: f64::INFINITY,
        hard: false,
        whole: true,
        darts: false,
    };
    let mut tried: FxHashSet<Vec<u32>> = FxHashSet::default();
    let mut known: Vec<Shortcut> = Vec::new();
    let mut changed = vec![true; charts.list.len()];
    loop {
        known.retain(|c| !(changed[c.from as usize] || changed[c.to as usize]));
        known.extend(shortcuts(s, charts, &changed, ctx)?);
        known.retain(|c| !tried.contains(&c.faces));
        known.sort_by(|x, y| y.gain.total_cmp(&x.gain).then(x.faces.cmp(&y.faces)));
        known.dedup_by(|x, y| x.faces == y.faces);
        changed.fill(false);
        let mut busy = changed.clone();
        let now: Vec<&Shortcut> = (known.iter())
            .filter(|c| {
                let [from, to] = [c.from, c.to].map(|id| std::mem::replace(&mut busy[id as usize], true));
                !from && !to
            })
            .collect();
        if now.is_empty() {
            return Ok(());
        }
        let results: Vec<Option<Traded>> = (now.par_iter())
            .map(|c| {
                let pair = Neighbouring { s, charts, ids: [c.to, c.from], length: 0.0, cost: 0.0 };
                let moves = vec![Move { from_second: true, faces: c.faces.clone() }];
                moved(&pair, moves, Wanted { least: 0.0, bonus: c.bonus }, limits, ctx)
            })
            .collect();
        ctx.check()?;
        let (area, over) =
            charts.list.iter().flatten().fold((0.0, 0.0), |(area, over), c| (area + c.area, over + c.over));
        let mut left = (MERGE.spent * UNWRAP.beyond * area - over).max(0.0);
        for (c, result) in now.into_iter().zip(results) {
            tried.insert(c.faces.clone());
            let Some(Traded { charts: [to, from], .. }) = result else { continue };
            let over = |id: u32| charts.list[id as usize].as_ref().map_or(0.0, |c| c.over);
            let more = to.over + from.over - over(c.to) - over(c.from);
            if more <= left {
                left -= more;
                charts.put(c.to, to);
                charts.put(c.from, from);
                (changed[c.to as usize], changed[c.from as usize]) = (true, true);
            }
        }
    }
}

/// What the turns of all seams at crossings of four polygons count, as a length of seam; 0 for triangles.
pub(crate) fn turns(s: &Surface, charts: &Charts) -> f64 {
    if s.cells.is_none() {
        return 0.0;
    }
    let net = Net { s, charts };
    let of_chart = |c: &Chart| {
        let ends = c.border.iter().filter_map(|&(i, k)| s.crossing(3 * c.faces[i as usize] + u32::from(k)));
        ends.map(|edges| net.turn(edges, |h| net.is_seam(h))).sum::<f64>()
    };
    // Each is at the ends of two edges.
    0.5 * MERGE.turn * charts.list.iter().flatten().map(of_chart).sum::<f64>()
}

/// Faces that would change hands for a straighter border.
struct Shortcut {
    from: u32,
    to: u32,
    /// Sorted.
    faces: Vec<u32>,
    /// What it saves of turns, as a length of seam, ...
    bonus: f64,
    /// ... and with that of seams.
    gain: f64,
}

/// The shortcuts at the borders of charts that have changed.
fn shortcuts(s: &Surface, charts: &Charts, changed: &[bool], ctx: &Context<'_>) -> Result<Vec<Shortcut>> {
    let net = Net { s, charts };
    let mut starts = Vec::new();
    for c in charts.list.iter().zip(changed).filter(|c| *c.1).filter_map(|c| c.0.as_ref()) {
        for &(i, k) in &c.border {
            let h = 3 * c.faces[i as usize] + u32::from(k);
            starts.extend([h, s.beyond(h)].into_iter().filter(|&h| h != NONE));
        }
    }
    starts.sort_unstable();
    starts.dedup();
    let found: Vec<Option<Shortcut>> =
        (starts.par_iter()).map(|&h| if ctx.check().is_ok() { net.shortcut(h) } else { None }).collect();
    ctx.check()?;
    Ok(found.into_iter().flatten().collect())
}

/// The polygons' edges, and where the seams are.
struct Net<'a> {
    s: &'a Surface,
    charts: &'a Charts,
}

impl Net<'_> {
    fn owner(&self, h: u32) -> u32 {
        self.charts.owner[h as usize / 3]
    }

    /// Whether an edge is one of the seams.
    fn is_seam(&self, h: u32) -> bool {
        let t = self.s.beyond(h);
        if t == NONE || self.owner(t) != self.owner(h) {
            return true;
        }
        let Some(Some(c)) = self.charts.list.get(self.owner(h) as usize) else { return true };
        let ends = |h: u32| {
            let t = c.tris[self.charts.index_of[h as usize / 3] as usize];
            [t[h as usize % 3], t[(h as usize + 1) % 3]]
        };
        let [a, b] = ends(t);
        ends(h) != [b, a]
    }

    /// Where the border along an edge turns at its end: what lies between the border and the way straight on,
    /// if that is worth while.
    fn shortcut(&self, h: u32) -> Option<Shortcut> {
        let s = self.s;
        let back = s.beyond(h);
        if back == NONE
            || [h, back].iter().any(|&h| self.owner(h) == NONE)
            || self.owner(back) == self.owner(h)
        {
            return None;
        }
        let [left, on, right, _] = s.crossing(h)?;
        let to_left = self.is_seam(left);
        if self.is_seam(on) || to_left == self.is_seam(right) {
            return None;
        }
        // The part between the two ways lies on the side to which the border turns.
        let (giver, taker) = if to_left { (back, h) } else { (h, back) };
        let (from, to) = (self.owner(giver), self.owner(taker));
        let way = self.way_on(on)?;
        let inner = |h: u32| if to_left { h } else { s.beyond(h) };
        let faces = self.enclosed(&way, inner)?;
        let mut saved = -way.iter().map(|&h| s.cost_of(h)).sum::<f64>();
        let mut around = way;
        for h in faces.iter().flat_map(|&f| 3 * f..3 * f + 3).filter(|&h| self.is_seam(h)) {
            let t = s.beyond(h);
            if t != NONE && self.owner(t) == to {
                saved += s.cost_of(h);
            }
            around.push(h);
        }
        let bonus = MERGE.turn * self.turns_saved(&around, &faces, to);
        let gain = saved + bonus;
        (bonus > 0.0 && gain > MERGE.straighter * bonus).then_some(Shortcut { from, to, faces, bonus, gain })
    }

    /// The edges straight on from an edge to where they meet a seam; `None` where they do not soon.
    fn way_on(&self, on: u32) -> Option<Vec<u32>> {
        let mut way = vec![on];
        while way.len() <= MERGE.longest_way {
            let h = way[way.len() - 1];
            if self.meets_seam(h) {
                return Some(way);
            }
            let [_, on, ..] = self.s.crossing(h)?;
            way.push(on);
        }
        None
    }

    /// Whether a seam passes the end of an edge, or ends there.
    fn meets_seam(&self, h: u32) -> bool {
        let mut at = h;
        for _ in 0..MERGE.longest_way {
            let next = self.s.next_edge(at);
            if self.is_seam(next) {
                return true;
            }
            at = self.s.beyond(next);
            if at == h {
                break;
            }
        }
        false
    }

    /// The faces of the chart on the inner side of a way, sorted; `None` where it does not part the chart, or
    /// more than half of the chart lies there.
    fn enclosed(&self, way: &[u32], inner: impl Fn(u32) -> u32) -> Option<Vec<u32>> {
        let chart = self.charts.list[self.owner(way[0]) as usize].as_ref()?;
        let walls: FxHashSet<u32> = way.iter().flat_map(|&h| [h, self.s.beyond(h)]).collect();
        let outside: FxHashSet<u32> = way.iter().map(|&h| self.s.beyond(inner(h)) / 3).collect();
        let mut faces = vec![inner(way[0]) / 3];
        let mut seen: FxHashSet<u32> = faces.iter().copied().collect();
        let mut next = 0;
        while let Some(&f) = faces.get(next) {
            next += 1;
            if outside.contains(&f) || 2 * faces.len() > chart.faces.len() {
                return None;
            }
            for h in (3 * f..3 * f + 3).filter(|h| !(walls.contains(h) || self.is_seam(*h))) {
                let g = self.s.beyond(h) / 3;
                if seen.insert(g) {
                    faces.push(g);
                }
            }
        }
        faces.sort_unstable();
        Some(faces)
    }

    /// What the turns at the ends of edges get less if faces go to a chart, in lengths of the edges that turn
    /// there.
    fn turns_saved(&self, around: &[u32], faces: &[u32], to: u32) -> f64 {
        let goes = |h: u32| faces.binary_search(&(h / 3)).is_ok();
        let now = |h: u32| self.is_seam(h);
        let then = |h: u32| {
            let t = self.s.beyond(h);
            match (goes(h), t != NONE && goes(t)) {
                (true, false) => t == NONE || self.owner(t) != to,
                (false, true) => self.owner(h) != to,
                _ => self.is_seam(h),
            }
        };
        let mut seen: FxHashSet<u32> = FxHashSet::default();
        let mut saved = 0.0;
        for h in around.iter().flat_map(|&h| [h, self.s.beyond(h)]).filter(|&h| h != NONE) {
            let end = self.s.tri[h as usize / 3][(h as usize + 1) % 3];
            if seen.insert(end)
                && let Some(edges) = self.s.crossing(h)
            {
                saved += self.turn(edges, now) - self.turn(edges, then);
            }
        }
        saved
    }

    /// The mean length of two seams that meet at a crossing and turn there; 0 for others.
    fn turn(&self, edges: [u32; 4], is_seam: impl Fn(u32) -> bool) -> f64 {
        let on = edges.map(is_seam);
        if on.iter().filter(|s| **s).count() != 2 || on[0] == on[2] {
            return 0.0;
        }
        edges.iter().zip(on).filter(|e| e.1).map(|e| 0.5 * self.s.cost_of(*e.0)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::trade::tests::square;
    use super::*;
    use crate::Run;
    use crate::unwrap::first::first_charts;
    use crate::unwrap::options::UnwrapOptions;
    use proptest::prelude::*;

    const SIDE: usize = 16;

    /// How long the seams of a square of 16 by 16 quads are, in quads, and how many turns they have, before
    /// and after, where column `x` belongs to the first of two charts up to row `up_to[x]`.
    fn straightened(up_to: &[usize]) -> [(f64, usize); 2] {
        let mesh = square(SIDE);
        let polygon = (0..2 * SIDE * SIDE).map(|f| f as u32 / 2).collect();
        let options = UnwrapOptions { face_polygon: Some(polygon), ..UnwrapOptions::default() };
        let cells = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        let label: Vec<u32> = cells.flat_map(|(x, y)| [u32::from(y >= up_to[x]); 2]).collect();
        let run = |ctx: &Context<'_>| {
            let s = Surface::new(&mesh, &options, ctx)?;
            let mut charts = Charts::new(s.faces(), first_charts(&s, &label, 2, Some(1.1), ctx)?);
            let look = |charts: &Charts| {
                let net = Net { s: &s, charts };
                let seams = || (0..3 * s.faces() as u32).filter(|&h| s.beyond(h) != NONE && net.is_seam(h));
                // Each seam is seen from both sides, each turn at the ends of two seams.
                let length: f64 = seams().map(|h| s.cost_of(h)).sum::<f64>() * SIDE as f64 / 2.0;
                let turns =
                    seams().filter_map(|h| s.crossing(h)).filter(|&e| net.turn(e, |h| net.is_seam(h)) > 0.0);
                (length, turns.count() / 2)
            };
            let before = look(&charts);
            run_straight(&s, &mut charts, 1.1, ctx)?;
            Ok([before, look(&charts)])
        };
        Run::default().execute(run).unwrap()
    }

    #[test]
    fn a_border_with_a_step_becomes_straight() {
        let [before, after] = straightened(&[8, 8, 8, 8, 8, 8, 8, 8, 8, 9, 9, 9, 9, 9, 9, 9]);
        assert_eq!(before.1, 2);
        assert_eq!(after.1, 0);
        assert!((after.0 - SIDE as f64).abs() < 1e-4, "{before:?} to {after:?}");
    }

    proptest! {
        #[test]
        fn steps_go_and_the_border_gets_no_longer(up_to in prop::collection::vec(6..11usize, SIDE)) {
            let [before, after] = straightened(&up_to);
            prop_assert!(after.0 <= before.0 + 1e-4 && after.1 <= before.1, "{:?} to {:?}", before, after);
            prop_assert!(after.1 * 2 <= before.1, "{:?} to {:?}", before, after);
        }
    }
}
