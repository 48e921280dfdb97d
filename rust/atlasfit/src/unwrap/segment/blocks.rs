//! Blocks of quads: flat rectangles of rows and columns, as someone who marks seams along edge loops has them
//! in mind.
//!
//! In: a surface with polygons. Out: the block of each polygon, if it lies in one. A block grows by whole
//! rows as long as it is flat. The next one begins with the row beyond one of its sides, so that borders run
//! straight on from block to block.

use super::cluster::{Cluster, cost};
use super::constants::SEGMENT;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::surface::{NONE, Surface};
use std::collections::VecDeque;

/// A rectangle of quads.
struct Block {
    quads: Vec<u32>,
    /// The edges of its quads on each side. Sides 0 and 2 run from side 3 to side 1, sides 1 and 3 from side
    /// 0 to side 2.
    sides: [Vec<u32>; 4],
    /// Whether sides 0 and 1 run as the quads' own edges do, and 2 and 3 against them; or the other way
    /// round.
    along: bool,
    cluster: Cluster,
}

/// The block of each polygon; [`NONE`] for those in none. `alone` is each polygon as a cluster, `flatness`
/// bounds 1 - |mean normal| of a block.
pub(super) fn blocks(s: &Surface, alone: &[Cluster], flatness: f64, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let mut out = Blocks { s, alone, flatness, block_of: vec![NONE; alone.len()], count: 0 };
    let mut open: VecDeque<Vec<u32>> = VecDeque::new();
    for first in 0..alone.len() as u32 {
        ctx.check_at(first as usize)?;
        if out.is_free(first)
            && let Some(quad) = s.quad(first)
        {
            open.push_back(vec![quad[0]]);
        }
        while let Some(edges) = open.pop_front() {
            ctx.check()?;
            for row in out.rows(&edges) {
                let block = out.grown(&row);
                if block.quads.len() < SEGMENT.least_block {
                    block.quads.iter().for_each(|&c| out.block_of[c as usize] = NONE);
                    continue;
                }
                out.count += 1;
                let beyond =
                    |side: &Vec<u32>| side.iter().map(|&h| s.beyond(h)).filter(|&h| h != NONE).collect();
                open.extend(block.sides.iter().map(beyond));
            }
        }
    }
    Ok(out.block_of)
}

/// The blocks so far.
struct Blocks<'a> {
    s: &'a Surface,
    alone: &'a [Cluster],
    flatness: f64,
    block_of: Vec<u32>,
    count: u32,
}

impl Blocks<'_> {
    fn cell(&self, h: u32) -> u32 {
        self.s.cell(h / 3)
    }

    /// Whether a polygon is in no block yet.
    fn is_free(&self, cell: u32) -> bool {
        self.block_of[cell as usize] == NONE
    }

    /// Whether the quad at the edge `b` lies beside that at `a`, at the end of that edge rather than its
    /// beginning; `None` if on neither side.
    fn beside(&self, a: u32, b: u32) -> Option<bool> {
        let (s, cell) = (self.s, self.cell(b));
        let leads = |h: u32| s.beyond(h) != NONE && self.cell(s.beyond(h)) == cell;
        let next = s.next_edge(a);
        if leads(next) { Some(true) } else { leads(s.next_edge(s.next_edge(next))).then_some(false) }
    }

    /// The edges of free quads among these, in rows of quads side by side.
    fn rows(&self, edges: &[u32]) -> Vec<Vec<u32>> {
        let is_open = |h: u32| self.is_free(self.cell(h)) && self.s.quad(self.cell(h)).is_some();
        let goes_on = |a: &u32, b: &u32| is_open(*a) && is_open(*b) && self.beside(*a, *b).is_some();
        edges.chunk_by(goes_on).filter(|row| is_open(row[0])).map(<[u32]>::to_vec).collect()
    }

    /// A block that begins with a row, as far as that is flat. Its quads are marked as its own.
    fn grown(&mut self, row: &[u32]) -> Block {
        let s = self.s;
        let mut quads = vec![self.cell(row[0])];
        let mut cluster = self.alone[quads[0] as usize].bare();
        self.block_of[quads[0] as usize] = self.count;
        for &h in &row[1..] {
            let c = self.cell(h);
            let next = &self.alone[c as usize];
            if !self.is_free(c) || cost(&cluster, next, s.cost_of(h), self.flatness).is_none() {
                break;
            }
            self.block_of[c as usize] = self.count;
            quads.push(c);
            cluster = cluster.with(next);
        }
        let row = &row[..quads.len()];
        let along = row.len() < 2 || self.beside(row[0], row[1]) == Some(true);
        let sides = self.sides_of(row, along);
        let mut block = Block { quads, sides, along, cluster };
        loop {
            let best = (0..4)
                .filter_map(|k| self.widened(&block, k).map(|w| (w, k)))
                .min_by(|(x, _), (y, _)| x.cost.total_cmp(&y.cost));
            let Some((Wider { row, cluster, .. }, k)) = best else { return block };
            // The far sides of the new row, and its ends, which lengthen the sides beside it.
            let [_, at_end, far, at_start] = self.sides_of(&row, (k < 2) != block.along);
            block.sides[k] = far;
            let beside = if k % 2 == 0 { [(3, at_start), (1, at_end)] } else { [(0, at_start), (2, at_end)] };
            for (side, end) in beside {
                let place = if k == 0 || k == 3 { 0 } else { block.sides[side].len() };
                block.sides[side].insert(place, end[0]);
            }
            for c in row.iter().map(|&h| s.cell(h / 3)) {
                self.block_of[c as usize] = self.count;
                block.quads.push(c);
            }
            block.cluster = cluster;
        }
    }

    /// The four sides of a row of quads, of which these edges are the first; the row leads to the ends of
    /// these edges, or to their beginnings.
    fn sides_of(&self, row: &[u32], along: bool) -> [Vec<u32>; 4] {
        let s = self.s;
        let far = |h: u32| s.next_edge(s.next_edge(h));
        let (before, after) = (|h: u32| s.next_edge(far(h)), |h: u32| s.next_edge(h));
        let (first, last) = (row[0], row[row.len() - 1]);
        let (start, end) = if along { (before(first), after(last)) } else { (after(first), before(last)) };
        [row.to_vec(), vec![end], row.iter().map(|&h| far(h)).collect(), vec![start]]
    }

    /// The block with the row beyond one of its sides; `None` if there is none, or it would not be flat.
    fn widened(&self, block: &Block, k: usize) -> Option<Wider> {
        let s = self.s;
        let row: Vec<u32> = block.sides[k].iter().map(|&h| s.beyond(h)).collect();
        if row.contains(&NONE) || self.rows(&row).first().is_none_or(|r| r.len() != row.len()) {
            return None;
        }
        // A row that meets itself would be counted twice.
        let mut cells: Vec<u32> = row.iter().map(|&h| self.cell(h)).collect();
        cells.sort_unstable();
        if cells.windows(2).any(|w| w[0] == w[1]) {
            return None;
        }
        let mut more = self.alone[cells[0] as usize].bare();
        cells[1..].iter().for_each(|&c| more = more.with(&self.alone[c as usize]));
        let length: f64 = row.iter().map(|&h| s.cost_of(h)).sum();
        let cost = cost(&block.cluster, &more, length, self.flatness)?;
        Some(Wider { row, cluster: block.cluster.with(&more), cost })
    }
}

/// A block with one row more.
struct Wider {
    /// The edges of the new row on the block's side.
    row: Vec<u32>,
    cluster: Cluster,
    cost: f64,
}

#[cfg(test)]
mod tests {
    use super::super::seeds::cells_alone;
    use super::*;
    use crate::Run;
    use crate::geometry::TriMesh;
    use crate::unwrap::options::UnwrapOptions;
    use proptest::prelude::*;

    proptest! {
        /// A strip of paper that is bent along both directions, `n` by `m` quads of which some are missing.
        #[test]
        fn blocks_are_rectangles_and_what_is_flat_is_one(
            (n, m) in (2..14usize, 2..14usize),
            bend in 0.0..3.0f64,
            gaps in prop::collection::vec(0..196usize, 0..4),
        ) {
            let point = |k: usize| {
                let (x, y) = ((k / (m + 1)) as f64, (k % (m + 1)) as f64);
                let r = 8.0 / bend.max(1e-3);
                [x, r * (y / r).sin(), r * (1.0 - (y / r).cos())]
            };
            let cells: Vec<usize> = (0..n * m).filter(|c| !gaps.contains(c)).collect();
            let quad = |&c: &usize| {
                let a = (c / m * (m + 1) + c % m) as u32;
                let [b, d] = [a + m as u32 + 1, a + 1];
                [[a, b, b + 1], [a, b + 1, d]]
            };
            let mesh = TriMesh::new(
                (0..(n + 1) * (m + 1)).map(point).collect(),
                cells.iter().flat_map(quad).collect(),
            );
            let polygon = (0..2 * cells.len()).map(|f| f as u32 / 2).collect();
            let options = UnwrapOptions { face_polygon: Some(polygon), ..UnwrapOptions::default() };
            let found = Run::default().execute(|ctx| {
                let s = Surface::new(&mesh, &options, ctx)?;
                let alone = cells_alone(&s, ctx)?.clusters;
                blocks(&s, &alone, 0.06, ctx)
            });
            let found = found.unwrap();
            for id in 0..=found.iter().filter(|b| **b != NONE).max().map_or(0, |&b| b) {
                let own: Vec<usize> =
                    (cells.iter().zip(&found)).filter(|c| *c.1 == id).map(|c| *c.0).collect();
                let side = |at: &dyn Fn(usize) -> usize| {
                    let along = || own.iter().map(|&c| at(c));
                    along().max().zip(along().min()).map_or(0, |(hi, lo)| hi - lo + 1)
                };
                prop_assert_eq!(own.len(), side(&|c| c / m) * side(&|c| c % m));
            }
            if bend < 0.1 && cells.len() == n * m {
                prop_assert!(found.iter().all(|&b| b == 0));
            }
        }
    }
}
