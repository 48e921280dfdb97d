//! Which of many things belong to each of some others: the triangles about each vertex, the points of each
//! triangle.
//!
//! In: for each thing its owners. Out: for each owner the list of its own, ascending.

use crate::error::Result;
use crate::run::Context;
use crate::spatial::edges::Edges;

/// Lists one after another.
#[derive(Debug, Clone)]
pub(crate) struct Lists {
    start: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// Lists the items `0..`, of which each has `N` owners below `count`.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn new<const N: usize>(count: usize, owners: &[[u32; N]], ctx: &Context<'_>) -> Result<Self> {
        let mut start = vec![0u32; count + 1];
        for (i, of) in owners.iter().enumerate() {
            ctx.check_at(i)?;
            of.iter().for_each(|&o| start[o as usize + 1] += 1);
        }
        for k in 0..count {
            start[k + 1] += start[k];
        }
        let mut next = start.clone();
        let mut items = vec![0; N * owners.len()];
        for (i, of) in owners.iter().enumerate() {
            ctx.check_at(i)?;
            for &o in of {
                items[next[o as usize] as usize] = i as u32;
                next[o as usize] += 1;
            }
        }
        Ok(Self { start, items })
    }
    /// Lists for each vertex of a mesh with these edges the vertices that it shares one with.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn of_neighbours(count: usize, edges: &Edges, ctx: &Context<'_>) -> Result<Self> {
        let ends = edges.gather(|edge, ends| ends.push(edge[0].ends()), ctx)?;
        let mut lists = Self::new(count, &ends, ctx)?;
        let Self { start, items } = &mut lists;
        for (v, own) in start.windows(2).enumerate() {
            ctx.check_at(v)?;
            for item in &mut items[own[0] as usize..own[1] as usize] {
                let [a, b] = ends[*item as usize];
                *item = if a as usize == v { b } else { a };
            }
        }
        Ok(lists)
    }
    /// For each owner where its list starts and ends among the items, and all items.
    pub(crate) fn into_spans(self) -> (Vec<[u32; 2]>, Vec<u32>) {
        (self.start.windows(2).map(|w| [w[0], w[1]]).collect(), self.items)
    }
    /// The items of an owner.
    pub(crate) fn of(&self, owner: u32) -> &[u32] {
        &self.items[self.start[owner as usize] as usize..self.start[owner as usize + 1] as usize]
    }
}
