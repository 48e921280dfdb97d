//! Shortest ways along edges (Dijkstra 1959).
//!
//! In: which vertices are beside each, and how far. Out: distances, and what each vertex was reached by.

use crate::error::Result;
use crate::run::Context;
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
    let mut heap = BinaryHeap::new();
    for v in from {
        out.distance[v as usize] = 0.0;
        heap.push(Reverse((0u64, v)));
    }
    let mut looks = 0;
    // As numbers that are not negative, distances are ordered as their bits.
    while let Some(Reverse((key, v))) = heap.pop() {
        looks += 1;
        ctx.check_at(looks)?;
        let far = f64::from_bits(key);
        if far > out.distance[v as usize] {
            continue;
        }
        if is_end(v) {
            out.end = Some(v);
            break;
        }
        for Step { to, length, by } in steps(v) {
            let far = far + length;
            if far < out.distance[to as usize] {
                (out.distance[to as usize], out.by[to as usize]) = (far, by);
                heap.push(Reverse((far.to_bits(), to)));
            }
        }
    }
    Ok(out)
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
}
