//! Shortest ways along edges (Dijkstra 1959).
//!
//! In: which vertices are beside each, and how far. Out: distances, and what each vertex was reached by.

use crate::error::Result;
use crate::run::Context;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A way from one vertex to the next.
pub(crate) struct Step {
    /// The next vertex.
    pub to: u32,
    /// Not negative.
    pub length: f64,
    /// What the next one is then reached by: an edge, or a vertex.
    pub by: u32,
}

/// Where ways lead.
pub(crate) struct Reached {
    /// Distance of each vertex, as far as was looked; infinite for those that were not reached.
    pub distance: Vec<f64>,
    /// What each was reached by; `u32::MAX` for the first ones and those that were not reached.
    pub by: Vec<u32>,
    /// The nearest of the ends.
    pub end: Option<u32>,
}

/// Distance of each vertex that was seen, and what it was reached by; `u32::MAX` for the first ones.
pub(crate) type Seen = FxHashMap<u32, (f64, u32)>;

/// Follows ways over `count` vertices from some of them, to the nearest that is an end.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn shortest<I: IntoIterator<Item = Step>>(
    count: usize,
    from: impl Iterator<Item = u32>,
    steps: impl Fn(u32) -> I,
    is_end: impl Fn(u32) -> bool,
    ctx: &Context<'_>,
) -> Result<Reached> {
    let mut out = Reached { distance: vec![f64::INFINITY; count], by: vec![u32::MAX; count], end: None };
    out.end = follow(&mut out, from, steps, f64::INFINITY, is_end, ctx)?;
    Ok(out)
}

/// Follows ways over `count` vertices from some of them, no farther than `within`: distances beyond it are
/// upper bounds.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn shortest_within<I: IntoIterator<Item = Step>>(
    within: f64,
    count: usize,
    from: impl Iterator<Item = u32>,
    steps: impl Fn(u32) -> I,
    ctx: &Context<'_>,
) -> Result<Reached> {
    let mut out = Reached { distance: vec![f64::INFINITY; count], by: vec![u32::MAX; count], end: None };
    follow(&mut out, from, steps, within, |_| false, ctx)?;
    Ok(out)
}

/// Follows ways from some vertices, to the nearest that is an end. Takes no memory for vertices that it does
/// not see.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn shortest_seen<I: IntoIterator<Item = Step>>(
    from: impl Iterator<Item = u32>,
    steps: impl Fn(u32) -> I,
    is_end: impl Fn(u32) -> bool,
    ctx: &Context<'_>,
) -> Result<Seen> {
    let mut seen = Seen::default();
    follow(&mut seen, from, steps, f64::INFINITY, is_end, ctx)?;
    Ok(seen)
}

/// What is known of the vertices on the way.
trait Known {
    /// Distance of a vertex; infinite where none is known.
    fn distance(&self, v: u32) -> f64;
    fn set(&mut self, v: u32, distance: f64, by: u32);
}

impl Known for Reached {
    fn distance(&self, v: u32) -> f64 {
        self.distance[v as usize]
    }
    fn set(&mut self, v: u32, distance: f64, by: u32) {
        (self.distance[v as usize], self.by[v as usize]) = (distance, by);
    }
}

impl Known for Seen {
    fn distance(&self, v: u32) -> f64 {
        self.get(&v).map_or(f64::INFINITY, |known| known.0)
    }
    fn set(&mut self, v: u32, distance: f64, by: u32) {
        self.insert(v, (distance, by));
    }
}

/// Follows ways, and returns the nearest end.
fn follow<I: IntoIterator<Item = Step>>(
    known: &mut impl Known,
    from: impl Iterator<Item = u32>,
    steps: impl Fn(u32) -> I,
    within: f64,
    is_end: impl Fn(u32) -> bool,
    ctx: &Context<'_>,
) -> Result<Option<u32>> {
    let mut heap = BinaryHeap::new();
    for v in from {
        known.set(v, 0.0, u32::MAX);
        heap.push(Reverse((0u64, v)));
    }
    let mut looks = 0;
    // As numbers that are not negative, distances are ordered as their bits.
    while let Some(Reverse((key, v))) = heap.pop() {
        looks += 1;
        ctx.check_at(looks)?;
        let far = f64::from_bits(key);
        if far > within {
            break;
        }
        if far > known.distance(v) {
            continue;
        }
        if is_end(v) {
            return Ok(Some(v));
        }
        for Step { to, length, by } in steps(v) {
            let far = far + length;
            if far < known.distance(to) {
                known.set(to, far, by);
                heap.push(Reverse((far.to_bits(), to)));
            }
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn the_shorter_way_round_is_found_and_the_nearest_end() {
        // A ring of six vertices, each a step of 1 from the next, but the one from 0 to 1 of 9.
        let steps = |v: u32| {
            [(v + 1) % 6, (v + 5) % 6].map(|to| {
                let length = if v + to == 1 { 9.0 } else { 1.0 };
                Step { to, length, by: v }
            })
        };
        let go = |is_end: fn(u32) -> bool| {
            Run::default().execute(|ctx| shortest(6, [0].into_iter(), steps, is_end, ctx)).unwrap()
        };
        let all = go(|_| false);
        assert_eq!(all.distance, [0.0, 5.0, 4.0, 3.0, 2.0, 1.0]);
        assert_eq!((all.by[1], all.by[0], all.end), (2, u32::MAX, None));
        assert_eq!(go(|v| v == 2 || v == 3).end, Some(3));
    }

    #[test]
    fn no_more_is_seen_than_what_is_beside_vertices_within() {
        let steps = |v: u32| [v - 1, v + 1].map(|to| Step { to, length: 1.0, by: v });
        let all = [(98, 2.0), (99, 1.0), (100, 0.0), (101, 1.0), (102, 2.0)];
        let reached = Run::default().execute(|ctx| shortest_within(1.5, 200, [100].into_iter(), steps, ctx));
        let distance = reached.unwrap().distance;
        let far: Vec<(u32, f64)> = (0..).zip(distance).filter(|d| d.1.is_finite()).collect();
        assert_eq!(far, all);
        let seen = Run::default().execute(|ctx| shortest_seen([100].into_iter(), steps, |v| v == 101, ctx));
        let mut far: Vec<(u32, f64)> = seen.unwrap().into_iter().map(|(v, known)| (v, known.0)).collect();
        far.sort_by_key(|s| s.0);
        assert_eq!(far, all[..4], "an end stops the search");
    }
}
