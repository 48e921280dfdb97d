//! A sparse LDLᵀ factorisation for the planar graphs of charts, ordered by geometric nested dissection.
//!
//! In: a symmetric positive definite matrix on the edges of a chart's triangulation and the vertices' planar
//! coordinates. Out: solutions for two right-hand sides at once (u and v). Up-looking factorisation after
//! Davis 2005 ("Algorithm 849: a concise sparse Cholesky factorization package"); the coordinates make the
//! ordering of George 1973 a few lines, with O(n log n) fill.

use super::graph::Graph;
use crate::run::Context;
use crate::unwrap::surface::NONE;

/// Sets of at most this many vertices are not dissected further.
const LEAF: usize = 24;

/// A factorised matrix.
#[derive(Default)]
pub(crate) struct Factor {
    /// Position in the elimination order of each vertex.
    place: Vec<u32>,
    start: Vec<u32>,
    row: Vec<u32>,
    value: Vec<f64>,
    diagonal: Vec<f64>,
}

/// The elimination tree, and how many entries each column of the factor has below its diagonal.
struct Tree {
    parent: Vec<u32>,
    count: Vec<u32>,
}

impl Tree {
    /// Finds them, for vertices eliminated in some order; `place` is its inverse.
    fn new(graph: &Graph, order: &[u32], place: &[u32]) -> Self {
        let n = order.len();
        let mut parent = vec![NONE; n];
        let mut flag = vec![NONE; n];
        let mut count = vec![0u32; n];
        for k in 0..n {
            flag[k] = k as u32;
            for e in graph.row(order[k]) {
                let mut i = place[graph.to[e] as usize] as usize;
                if i < k {
                    while flag[i] != k as u32 {
                        if parent[i] == NONE {
                            parent[i] = k as u32;
                        }
                        count[i] += 1;
                        flag[i] = k as u32;
                        i = parent[i] as usize;
                    }
                }
            }
        }
        Self { parent, count }
    }
}

impl Factor {
    /// Factorises the weighted Laplacian of `graph` plus `shift` per vertex on the diagonal.
    /// Unfinished when the run is to stop: the caller checks.
    pub(crate) fn laplacian(
        graph: &Graph,
        coordinates: &[[f64; 2]],
        shift: impl Fn(usize) -> f64,
        ctx: &Context<'_>,
    ) -> Self {
        let n = coordinates.len();
        let mut order: Vec<u32> = (0..n as u32).collect();
        let mut side = vec![0u32; n];
        let mut stamp = 0;
        let mut scratch = Vec::new();
        dissect(graph, coordinates, &mut order, &mut side, &mut stamp, &mut scratch);
        if ctx.check().is_err() {
            return Self::default();
        }
        let mut place = vec![0u32; n];
        for (p, &v) in order.iter().enumerate() {
            place[v as usize] = p as u32;
        }
        let Tree { parent, count } = Tree::new(graph, &order, &place);
        let mut start = vec![0u32; n + 1];
        for k in 0..n {
            start[k + 1] = start[k] + count[k];
        }
        let nnz = start[n] as usize;
        let mut row = vec![0u32; nnz];
        let mut value = vec![0f64; nnz];
        let mut diagonal = vec![0f64; n];
        // Numeric: row k of L by a sparse triangular solve.
        let mut y = vec![0f64; n];
        let mut pattern = vec![0u32; n];
        let mut length = vec![0u32; n];
        let mut flag = vec![NONE; n];
        for k in 0..n {
            if k % 4 == 0 && ctx.check().is_err() {
                break;
            }
            let mut top = n;
            flag[k] = k as u32;
            let mut d = shift(order[k] as usize);
            for e in graph.row(order[k]) {
                d += graph.weight[e];
                let mut i = place[graph.to[e] as usize] as usize;
                if i < k {
                    y[i] -= graph.weight[e];
                    let mut len = 0;
                    while flag[i] != k as u32 {
                        pattern[len] = i as u32;
                        len += 1;
                        flag[i] = k as u32;
                        i = parent[i] as usize;
                    }
                    while len > 0 {
                        len -= 1;
                        top -= 1;
                        pattern[top] = pattern[len];
                    }
                }
            }
            for &i in &pattern[top..n] {
                let i = i as usize;
                let yi = std::mem::take(&mut y[i]);
                let (s, e) = (start[i] as usize, (start[i] + length[i]) as usize);
                for (r, v) in row[s..e].iter().zip(&value[s..e]) {
                    y[*r as usize] -= v * yi;
                }
                let l = yi / diagonal[i];
                d -= l * yi;
                row[e] = k as u32;
                value[e] = l;
                length[i] += 1;
            }
            diagonal[k] = d.max(1e-300);
        }
        Self { place, start, row, value, diagonal }
    }

    /// Solves in place for both coordinates.
    /// Unfinished when the run is to stop: the caller checks.
    pub(crate) fn solve(&self, b: &mut [[f64; 2]], work: &mut Vec<[f64; 2]>, ctx: &Context<'_>) {
        let n = self.place.len();
        work.clear();
        work.resize(n, [0.0; 2]);
        for (i, &p) in self.place.iter().enumerate() {
            work[p as usize] = b[i];
        }
        for j in 0..n {
            if j % 1024 == 0 && ctx.check().is_err() {
                return;
            }
            let x = work[j];
            for e in self.start[j] as usize..self.start[j + 1] as usize {
                let w = &mut work[self.row[e] as usize];
                w[0] -= self.value[e] * x[0];
                w[1] -= self.value[e] * x[1];
            }
        }
        for j in (0..n).rev() {
            if j % 1024 == 0 && ctx.check().is_err() {
                return;
            }
            let mut x = [work[j][0] / self.diagonal[j], work[j][1] / self.diagonal[j]];
            for e in self.start[j] as usize..self.start[j + 1] as usize {
                let w = work[self.row[e] as usize];
                x[0] -= self.value[e] * w[0];
                x[1] -= self.value[e] * w[1];
            }
            work[j] = x;
        }
        for (i, &p) in self.place.iter().enumerate() {
            b[i] = work[p as usize];
        }
    }
}

/// Reorders `set` so that the two halves come before their separator, recursively.
fn dissect(
    graph: &Graph,
    xy: &[[f64; 2]],
    set: &mut [u32],
    side: &mut [u32],
    stamp: &mut u32,
    scratch: &mut Vec<u32>,
) {
    if set.len() <= LEAF {
        return;
    }
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &v in set.iter() {
        for k in 0..2 {
            lo[k] = lo[k].min(xy[v as usize][k]);
            hi[k] = hi[k].max(xy[v as usize][k]);
        }
    }
    let axis = usize::from(hi[1] - lo[1] > hi[0] - lo[0]);
    let half = set.len() / 2;
    set.select_nth_unstable_by(half, |a, b| {
        xy[*a as usize][axis].total_cmp(&xy[*b as usize][axis]).then(a.cmp(b))
    });
    *stamp += 1;
    let right_mark = *stamp;
    for &v in &set[half..] {
        side[v as usize] = right_mark;
    }
    // Left vertices that touch the right half are the separator; they go last.
    scratch.clear();
    let mut keep = 0;
    for i in 0..half {
        let v = set[i];
        if graph.row(v).any(|e| side[graph.to[e] as usize] == right_mark) {
            scratch.push(v);
        } else {
            set[keep] = v;
            keep += 1;
        }
    }
    let right_len = set.len() - half;
    set.copy_within(half.., keep);
    set[keep + right_len..].copy_from_slice(scratch);
    let (left, rest) = set.split_at_mut(keep);
    dissect(graph, xy, left, side, stamp, scratch);
    dissect(graph, xy, &mut rest[..right_len], side, stamp, scratch);
}
