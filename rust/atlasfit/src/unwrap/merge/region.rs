//! The surface beside the border of two charts, and what would change hands there.
//!
//! In: two charts that are neighbours. Out: the faces near their border; and, once each of these has a side,
//! those that go over to the other chart.

use super::charts::Charts;
use super::constants::MERGE;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::paths::{Step, shortest_within};
use crate::unwrap::chart::Chart;
use crate::unwrap::surface::{NONE, Surface};

/// Beyond an edge: a face of the pair that is too deep to be looked at.
pub(super) const DEEP: u32 = NONE - 1;

/// Faces that go over to the other chart.
pub(super) struct Move {
    /// Whether the second of the two charts gives them.
    pub from_second: bool,
    /// Sorted.
    pub faces: Vec<u32>,
}

/// Two charts that share a border.
pub(super) struct Neighbouring<'a> {
    pub s: &'a Surface,
    pub charts: &'a Charts,
    pub ids: [u32; 2],
    /// Length of their border.
    pub length: f64,
    /// What it costs as a seam.
    pub cost: f64,
}

/// The faces near a border.
pub(super) struct Region {
    /// The faces, sorted.
    pub faces: Vec<u32>,
    /// Whether each belongs to the second chart.
    pub second: Vec<bool>,
    /// Whether each may change hands.
    pub open: Vec<bool>,
    /// For each edge the place here of the face beyond it; [`DEEP`], or [`NONE`] where the pair ends.
    pub beyond: Vec<[u32; 3]>,
}

impl Region {
    /// Whether what lies beyond an edge keeps its chart.
    pub(super) fn keeps(&self, beyond: u32) -> bool {
        beyond == DEEP || beyond != NONE && !self.open[beyond as usize]
    }
}

impl Neighbouring<'_> {
    /// The face beyond an edge of a face of the pair, and whether it belongs to the same chart. `None` where
    /// the pair ends, or the two do not hang together. Faces are named by their places in the charts, those
    /// of the second after those of the first.
    fn beyond(&self, both: [&Chart; 2], at: u32, k: usize) -> Option<(u32, bool)> {
        let firsts = both[0].faces.len() as u32;
        let (c, i) = named(both, at);
        let h = self.s.twin[c.faces[i] as usize][k];
        if h == NONE {
            return None;
        }
        let (second, j) = self.charts.place_in(self.ids, h as usize / 3)?;
        let there = if second { firsts + j } else { j };
        if second != (at >= firsts) {
            return Some((there, false));
        }
        let (t, u, l) = (c.tris[i], c.tris[j as usize], h as usize % 3);
        (t[k] == u[(l + 1) % 3] && t[(k + 1) % 3] == u[l]).then_some((there, true))
    }

    /// The faces up to somewhat deeper than `reach`. `None` when the run is to stop: the caller checks.
    pub(super) fn region(&self, reach: f64, ctx: &Context<'_>) -> Option<Region> {
        let Self { s, charts, ids, .. } = *self;
        let chart = |id: u32| charts.list[id as usize].as_ref();
        let both = [chart(ids[0])?, chart(ids[1])?];
        let firsts = both[0].faces.len() as u32;
        let at_border = both[0].border.iter().filter_map(|&(i, k)| {
            let h = s.twin[both[0].faces[i as usize] as usize][k as usize];
            let shared = h != NONE && charts.owner[h as usize / 3] == ids[1];
            shared.then(|| [i, firsts + charts.index_of[h as usize / 3]])
        });
        let face = |at: u32| {
            let (c, i) = named(both, at);
            c.faces[i]
        };
        let centre = |at: u32| {
            let sum = s.tri[face(at) as usize].iter().fold(Vec3::ZERO, |a, &v| a + s.pos[v as usize]);
            sum * (1.0 / 3.0)
        };
        let steps = |at: u32| {
            let here = centre(at);
            let inside = (0..3).filter_map(move |k| self.beyond(both, at, k).filter(|g| g.1));
            inside.map(move |(g, _)| Step { to: g, length: (here - centre(g)).norm(), by: at })
        };
        // Deeper than this it makes no difference how deep the deepest face is.
        let enough = reach / MERGE.core;
        let count = both[0].faces.len() + both[1].faces.len();
        let reached = shortest_within(enough, count, at_border.flatten(), steps, ctx).ok()?;
        let mut deep: Vec<(u32, u32, f64)> = (reached.distance.iter().zip(0..))
            .filter(|(far, _)| far.is_finite())
            .map(|(&far, at)| (face(at), at, far))
            .collect();
        deep.sort_unstable_by_key(|d| d.0);
        let mut deepest = [0.0f64; 2];
        for &(_, at, far) in &deep {
            let deepest = &mut deepest[usize::from(at >= firsts)];
            *deepest = deepest.max(far);
        }
        let free = deepest.map(|d| reach.min(MERGE.core * d));
        let mut place = vec![DEEP; count];
        deep.iter().zip(0..).for_each(|(d, i)| place[d.1 as usize] = i);
        let beyond = |at: u32, k: usize| self.beyond(both, at, k).map_or(NONE, |(g, _)| place[g as usize]);
        Some(Region {
            faces: deep.iter().map(|d| d.0).collect(),
            second: deep.iter().map(|d| d.1 >= firsts).collect(),
            open: deep.iter().map(|&(_, at, far)| far <= free[usize::from(at >= firsts)]).collect(),
            beyond: deep.iter().map(|d| [beyond(d.1, 0), beyond(d.1, 1), beyond(d.1, 2)]).collect(),
        })
    }

    /// The connected faces that are to lie on the other side, what saves most first.
    pub(super) fn changed(&self, region: &Region, side: &[bool]) -> Vec<Move> {
        let Region { faces, second, open, beyond } = region;
        let changes = |i: usize| open[i] && side[i] != second[i];
        let mut seen = vec![false; faces.len()];
        let mut out: Vec<(f64, Move)> = Vec::new();
        for first in 0..faces.len() {
            if seen[first] || !changes(first) {
                continue;
            }
            seen[first] = true;
            let (mut members, mut next, mut saved) = (vec![first], 0, 0.0);
            while let Some(&i) = members.get(next) {
                next += 1;
                for (k, &j) in beyond[i].iter().enumerate() {
                    let cost = self.s.cost(faces[i] as usize, k);
                    match j {
                        NONE => {}
                        DEEP => saved -= cost,
                        j if second[j as usize] != second[i] => saved += cost,
                        j if !changes(j as usize) => saved -= cost,
                        j => {
                            if !std::mem::replace(&mut seen[j as usize], true) {
                                members.push(j as usize);
                            }
                        }
                    }
                }
            }
            if saved > MERGE.trade_gain * self.cost {
                let mut moved: Vec<u32> = members.iter().map(|&i| faces[i]).collect();
                moved.sort_unstable();
                out.push((saved, Move { from_second: second[first], faces: moved }));
            }
        }
        out.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.faces.cmp(&y.1.faces)));
        out.into_iter().map(|m| m.1).collect()
    }
}

/// The chart of a face that is named as in `Neighbouring::beyond`, and its place there.
fn named(both: [&Chart; 2], at: u32) -> (&Chart, usize) {
    let firsts = both[0].faces.len();
    let at = at as usize;
    if at < firsts { (both[0], at) } else { (both[1], at - firsts) }
}
