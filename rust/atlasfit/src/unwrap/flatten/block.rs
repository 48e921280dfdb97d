//! A sparse LDLᵀ factorisation of matrices with a 2 by 2 block for each pair of neighbours of a chart: what
//! Newton steps solve.
//!
//! In: a chart's triangles and planar coordinates, then a block per vertex and per pair. Out: solutions. As
//! in `factor`, whose order and elimination tree it takes.

use super::factor::{Tree, dissected};
use super::graph::Graph;
use crate::run::Context;

/// A 2 by 2 matrix, row by row.
pub(super) type Block = [f64; 4];

/// Where a matrix has entries, and in which order it is eliminated.
pub(super) struct Pattern {
    place: Vec<u32>,
    order: Vec<u32>,
    parent: Vec<u32>,
    /// First entry of each column of the factor.
    start: Vec<u32>,
    /// For each place the earlier neighbours: `lower[row[k]..row[k + 1]]`, ascending. An entry's index is
    /// that of its block.
    row: Vec<u32>,
    lower: Vec<u32>,
    /// Per triangle, see [`slots_of`](Self::slots_of).
    pub(super) slots: Vec<[u32; 3]>,
}

#[inline]
fn minus(a: Block, b: Block) -> Block {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
}

/// The product of the transposed first block and the second.
#[inline]
fn transposed_times(a: Block, b: Block) -> Block {
    [
        a[0] * b[0] + a[2] * b[2],
        a[0] * b[1] + a[2] * b[3],
        a[1] * b[0] + a[3] * b[2],
        a[1] * b[1] + a[3] * b[3],
    ]
}

#[inline]
fn times(a: Block, b: Block) -> Block {
    [
        a[0] * b[0] + a[1] * b[2],
        a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2],
        a[2] * b[1] + a[3] * b[3],
    ]
}

/// The inverse of a symmetric positive definite block.
#[inline]
fn inverse(a: Block) -> Block {
    let det = (a[0] * a[3] - a[1] * a[2]).max(1e-300);
    [a[3] / det, -a[1] / det, -a[2] / det, a[0] / det]
}

impl Pattern {
    /// The pattern of the pairs of vertices that share a triangle or are among three that are near each
    /// other. `None` when the run is to stop: the caller checks.
    pub(super) fn new(
        tris: &[[u32; 3]],
        near: &[[u32; 3]],
        coordinates: &[[f64; 2]],
        ctx: &Context<'_>,
    ) -> Option<Self> {
        let n = coordinates.len();
        let all: Vec<[u32; 3]> = tris.iter().chain(near).copied().collect();
        let graph = Graph::from_triangles(n, &all, &vec![[1.0; 3]; all.len()], ctx);
        ctx.check().ok()?;
        let order = dissected(&graph, coordinates);
        ctx.check().ok()?;
        let mut place = vec![0u32; n];
        for (p, &v) in order.iter().enumerate() {
            place[v as usize] = p as u32;
        }
        let Tree { parent, count } = Tree::new(&graph, &order, &place);
        let mut start = vec![0u32; n + 1];
        for k in 0..n {
            start[k + 1] = start[k] + count[k];
        }
        let (mut row, mut lower) = (vec![0u32], Vec::new());
        for k in 0..n {
            let from = lower.len();
            let near = graph.row(order[k]).map(|e| place[graph.to[e] as usize]);
            lower.extend(near.filter(|&p| p < k as u32));
            lower[from..].sort_unstable();
            row.push(lower.len() as u32);
        }
        let mut out = Self { place, order, parent, start, row, lower, slots: Vec::new() };
        out.slots = tris.iter().map(|&t| out.slots_of(t)).collect();
        Some(out)
    }

    /// Number of pairs.
    pub(super) fn pairs(&self) -> usize {
        self.lower.len()
    }

    /// The slots of the pairs (1, 0), (2, 0), (2, 1) of three vertices.
    pub(super) fn slots_of(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        [self.slot(b, a), self.slot(c, a), self.slot(c, b)]
    }

    /// Twice the index of a pair of vertices, and one more if the first is the earlier one: the block's rows
    /// are the earlier one's.
    fn slot(&self, v: u32, w: u32) -> u32 {
        let (p, q) = (self.place[v as usize], self.place[w as usize]);
        let (low, high) = (p.min(q), p.max(q) as usize);
        let own = self.row[high] as usize..self.row[high + 1] as usize;
        let at = self.lower[own.clone()].partition_point(|&x| x < low);
        2 * (own.start + at) as u32 + u32::from(p < q)
    }

    /// Solves in place the system with these blocks, `pivot` times each one's diagonal added. Unfinished when
    /// the run is to stop: the caller checks.
    pub(super) fn solve(
        &self,
        diagonal: &[Block],
        pairs: &[Block],
        b: &mut [[f64; 2]],
        pivot: f64,
        ctx: &Context<'_>,
    ) {
        let n = self.order.len();
        let nnz = self.start[n] as usize;
        let (mut index, mut value) = (vec![0u32; nnz], vec![[0.0; 4]; nnz]);
        let mut inverted = vec![[0.0; 4]; n];
        let mut y = vec![[0.0; 4]; n];
        let (mut pattern, mut length, mut flag) = (vec![0u32; n], vec![0u32; n], vec![u32::MAX; n]);
        for k in 0..n {
            if k % 4 == 0 && ctx.check().is_err() {
                return;
            }
            let mut top = n;
            flag[k] = k as u32;
            let mut d = diagonal[self.order[k] as usize];
            for e in self.row[k] as usize..self.row[k + 1] as usize {
                let mut i = self.lower[e] as usize;
                y[i] = pairs[e];
                let mut len = 0;
                while flag[i] != k as u32 {
                    pattern[len] = i as u32;
                    len += 1;
                    flag[i] = k as u32;
                    i = self.parent[i] as usize;
                }
                while len > 0 {
                    len -= 1;
                    top -= 1;
                    pattern[top] = pattern[len];
                }
            }
            for &i in &pattern[top..n] {
                let i = i as usize;
                let yi = std::mem::take(&mut y[i]);
                let (s, e) = (self.start[i] as usize, (self.start[i] + length[i]) as usize);
                for (r, v) in index[s..e].iter().zip(&value[s..e]) {
                    let y = &mut y[*r as usize];
                    *y = minus(*y, times(*v, yi));
                }
                let l = transposed_times(yi, inverted[i]);
                d = minus(d, times(l, yi));
                (index[e], value[e]) = (k as u32, l);
                length[i] += 1;
            }
            // What is left of a stiff block after large parts were taken off may be rounding alone.
            let whole = diagonal[self.order[k] as usize];
            let least = pivot * (whole[0] + whole[3]);
            inverted[k] = inverse([d[0] + least, d[1], d[2], d[3] + least]);
        }
        let mut work: Vec<[f64; 2]> = self.order.iter().map(|&v| b[v as usize]).collect();
        for j in 0..n {
            let x = work[j];
            for e in self.start[j] as usize..self.start[j + 1] as usize {
                let (w, v) = (&mut work[index[e] as usize], value[e]);
                *w = [w[0] - v[0] * x[0] - v[1] * x[1], w[1] - v[2] * x[0] - v[3] * x[1]];
            }
        }
        for j in (0..n).rev() {
            let (i, w) = (inverted[j], work[j]);
            let mut x = [i[0] * w[0] + i[1] * w[1], i[2] * w[0] + i[3] * w[1]];
            for e in self.start[j] as usize..self.start[j + 1] as usize {
                let (w, v) = (work[index[e] as usize], value[e]);
                x = [x[0] - v[0] * w[0] - v[2] * w[1], x[1] - v[1] * w[0] - v[3] * w[1]];
            }
            work[j] = x;
        }
        for (x, &v) in work.iter().zip(&self.order) {
            b[v as usize] = *x;
        }
    }
}
