//! Edges collapsed cheapest first, until so many triangles are gone.
//!
//! In: a block, what a collapse may cost. Out: the block with fewer triangles, and how many edges cost how
//! much before. A collapse ranks the edges about its vertex anew.

use super::block::{Around, Block};
use super::collapse::{CHECK, Scratch};
use super::data::{Level, Role};
use crate::error::Result;
use crate::run::Context;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// An edge in the order of its cost, the square of it as the bits of a number that is not negative.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Ranked {
    cost2: u32,
    ends: [u32; 2],
    /// How often its ends had changed.
    age: u32,
}

/// Edges, the cheapest first.
#[derive(Default)]
struct Queue {
    edges: BinaryHeap<Reverse<Ranked>>,
    /// How often each vertex has changed.
    age: Vec<u32>,
}

impl Queue {
    fn age(&self, [a, b]: [u32; 2]) -> u32 {
        // Ages only grow: the sum stays the same only if both do.
        self.age[a as usize].wrapping_add(self.age[b as usize])
    }

    fn entry(&self, ends: [u32; 2], cost2: f64) -> Reverse<Ranked> {
        Reverse(Ranked { cost2: (cost2 as f32).to_bits(), ends, age: self.age(ends) })
    }

    /// The next edge that is as it was when it was ranked.
    fn next(&mut self) -> Option<[u32; 2]> {
        loop {
            let Reverse(edge) = self.edges.pop()?;
            if edge.age == self.age(edge.ends) {
                return Some(edge.ends);
            }
        }
    }
}

impl Block<'_> {
    /// Collapses edges of one level, cheapest first, until `surplus` triangles are gone.
    pub(super) fn cheapest(&mut self, level: &Level, surplus: &mut usize, ctx: &Context<'_>) -> Result<()> {
        let mut around = self.around(ctx)?;
        let mut scratch = Scratch::default();
        let mut queue = self.rank_all(level, ctx)?;
        for k in 0.. {
            if k % CHECK == 0 {
                ctx.check()?;
            }
            if *surplus == 0 {
                break;
            }
            let Some(ends) = queue.next() else { break };
            let gone = self.collapse(ends, level, &mut around, &mut scratch);
            *surplus -= gone.min(*surplus);
            if gone > 0 {
                self.rank_again(level, &mut queue, &around, &mut scratch);
            }
        }
        self.renumber();
        self.open.iter_mut().zip(&around.changed).for_each(|(open, changed)| *open |= changed);
        ctx.check()
    }

    /// The edges within the level; all are counted.
    fn rank_all(&mut self, level: &Level, ctx: &Context<'_>) -> Result<Queue> {
        let mut queue = Queue { age: vec![0; self.positions.len()], ..Queue::default() };
        let mut edges = Vec::new();
        let most2 = level.error * level.error;
        for f in 0..self.triangles.len() {
            if f.is_multiple_of(CHECK) {
                ctx.check()?;
            }
            let t = self.triangles[f];
            for k in 0..3 {
                let ends = [t[k], t[(k + 1) % 3]];
                let [i, j] = [ends[0] as usize, ends[1] as usize];
                // Both triangles of an inner edge come by.
                let turn = ends[0] < ends[1] || (self.rim[i] && self.rim[j]);
                if turn && self.free[i] && self.free[j] {
                    let cost2 = self.cost2(ends);
                    self.costs.count(cost2);
                    if cost2 <= most2 {
                        edges.push(queue.entry(ends, cost2));
                    }
                }
            }
        }
        queue.edges = BinaryHeap::from(edges);
        Ok(queue)
    }

    /// Ranks the edges about the vertices of a collapse.
    fn rank_again(&self, level: &Level, queue: &mut Queue, around: &Around, scratch: &mut Scratch) {
        let Scratch { moved, ring, .. } = scratch;
        moved.iter().for_each(|&v| queue.age[v as usize] += 1);
        let most2 = level.error * level.error;
        for &v in moved.iter() {
            ring.clear();
            for w in self.star(v, around).flat_map(|f| self.triangles[f as usize]) {
                if w != v && self.free[w as usize] && !ring.contains(&w) {
                    ring.push(w);
                    let ends = [v.min(w), v.max(w)];
                    let cost2 = self.cost2(ends);
                    if cost2 <= most2 {
                        queue.edges.push(queue.entry(ends, cost2));
                    }
                }
            }
        }
    }

    /// The square of what an edge costs, in shares of the error.
    fn cost2(&self, ends: [u32; 2]) -> f64 {
        let [i, j] = [ends[0] as usize, ends[1] as usize];
        let quadric = self.quadrics[i] + self.quadrics[j];
        let most = self.error(ends[0]).min(self.error(ends[1]));
        let mean2 = match [self.role[i] != Role::Free, self.role[j] != Role::Free] {
            // An edge of a seam: either end may go.
            [true, true] => quadric.mean(self.positions[i]).min(quadric.mean(self.positions[j])),
            [false, true] => quadric.mean(self.positions[j]),
            [stays, false] => quadric.mean(self.place_of(ends, stays, &quadric)),
        };
        mean2 / (most * most)
    }
}
