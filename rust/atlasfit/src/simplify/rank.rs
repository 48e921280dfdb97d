//! Edges collapsed cheapest first, until so many triangles are gone.
//!
//! In: a block, what a collapse may cost. Out: the block with fewer triangles, and how many edges cost how
//! much. In one pass each vertex is an end of one collapse at the most; lists of triangles are made anew
//! between passes.

use super::block::Block;
use super::collapse::{CHECK, Scratch};
use super::constants::SIMPLIFY;
use super::data::{Level, Role};
use crate::error::Result;
use crate::run::Context;

/// An edge and the square of its cost, in shares of the error.
#[derive(Clone, Copy)]
struct Ranked {
    cost2: f64,
    triangle: u32,
    corner: u32,
}

impl Block<'_> {
    /// Collapses edges of one level, cheapest first.
    pub(super) fn cheapest(&mut self, level: &Level, surplus: &mut usize, ctx: &Context<'_>) -> Result<()> {
        self.active.copy_from_slice(&self.open);
        for pass in 0..SIMPLIFY.passes {
            let before = self.triangles.len();
            let edges = self.ranked(level, pass == 0, ctx)?;
            let gone = self.collapse_all(&edges, level, *surplus, ctx)?;
            *surplus -= gone.min(*surplus);
            if (gone as f64) < SIMPLIFY.few * before as f64 {
                break;
            }
        }
        Ok(())
    }

    /// The edges within the level, cheapest first; `all` are counted.
    fn ranked(&mut self, level: &Level, all: bool, ctx: &Context<'_>) -> Result<Vec<Ranked>> {
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
                if turn && self.free[i] && self.free[j] && (self.active[i] || self.active[j]) {
                    let cost2 = self.cost2(ends);
                    if all {
                        self.costs.count(cost2);
                    }
                    if cost2 <= most2 {
                        edges.push(Ranked { cost2, triangle: f as u32, corner: k as u32 });
                    }
                }
            }
        }
        edges.sort_unstable_by(|a, b| {
            a.cost2.total_cmp(&b.cost2).then((a.triangle, a.corner).cmp(&(b.triangle, b.corner)))
        });
        Ok(edges)
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

    /// Collapses edges in their order until `surplus` triangles are gone; returns how many are.
    fn collapse_all(
        &mut self,
        edges: &[Ranked],
        level: &Level,
        surplus: usize,
        ctx: &Context<'_>,
    ) -> Result<usize> {
        let mut around = self.around(ctx)?;
        let mut scratch = Scratch::default();
        let mut gone = 0;
        for (k, edge) in edges.iter().enumerate() {
            if gone >= surplus {
                break;
            }
            if k.is_multiple_of(CHECK) {
                ctx.check()?;
            }
            let (t, k) = (self.triangles[edge.triangle as usize], edge.corner as usize);
            // Gone already, with another edge.
            if t[0] != t[1] {
                gone += self.collapse([t[k], t[(k + 1) % 3]], level, &mut around, &mut scratch);
            }
        }
        self.renumber();
        for (v, changed) in around.changed.iter().enumerate() {
            self.active[v] = *changed;
            self.open[v] |= *changed;
        }
        ctx.check()?;
        Ok(gone)
    }
}
