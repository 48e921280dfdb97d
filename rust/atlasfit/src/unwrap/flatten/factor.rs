//! A sparse LDLᵀ factorisation for the planar graphs of charts, ordered by geometric nested dissection.
//!
//! In: a symmetric positive definite matrix on the edges of a chart's triangulation and the vertices' planar
//! coordinates. Out: solutions for two right-hand sides at once (u and v). Up-looking factorisation after
//! Davis 2005 ("Algorithm 849: a concise sparse Cholesky factorization package"); the coordinates make the
//! ordering of George 1973 a few lines, with O(n log n) fill. Hubs (the middle of a disc that is one fan)
//! belong to the separators: their rows are dense anyway.

use super::constants::FLATTEN;
use super::graph::Graph;
use crate::run::Context;
use crate::unwrap::surface::NONE;

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
pub(super) struct Tree {
    pub(super) parent: Vec<u32>,
    pub(super) count: Vec<u32>,
}

impl Tree {
    /// Finds them, for vertices eliminated in some order; `place` is its inverse.
    pub(super) fn new(graph: &Graph, order: &[u32], place: &[u32]) -> Self {
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
        let order = dissected(graph, coordinates);
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

/// The vertices in an order of elimination.
pub(super) fn dissected(graph: &Graph, coordinates: &[[f64; 2]]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..coordinates.len() as u32).collect();
    Dissection::new(graph, coordinates).dissect(&mut order);
    order
}

/// What nested dissection works on, and with.
struct Dissection<'a> {
    graph: &'a Graph,
    xy: &'a [[f64; 2]],
    /// The last mark of each vertex; every half of a set gets a mark of its own. 0 = in no half.
    mark: Vec<u32>,
    last_mark: u32,
    /// The separator that is being looked for.
    separator: Vec<u32>,
}

impl<'a> Dissection<'a> {
    fn new(graph: &'a Graph, xy: &'a [[f64; 2]]) -> Self {
        Self { graph, xy, mark: vec![0; xy.len()], last_mark: 0, separator: Vec::new() }
    }

    /// Reorders `set` so that the two halves come before their separator, recursively.
    fn dissect(&mut self, set: &mut [u32]) {
        if set.len() <= FLATTEN.leaf {
            return;
        }
        let xy = self.xy;
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
        // Left vertices that touch the right half are the separator, and hubs of the right half that many of
        // them touch; they go last.
        let size = self.split(set, half);
        if size as f64 > FLATTEN.wide * (set.len() as f64).sqrt() {
            // Needles: their ends lie in two rows, and the cut between them is through all. Cuts along the
            // rows are found by the graph.
            let near_first = self.breadth_first(set);
            if 2 * self.split(&near_first, half) < size {
                set.copy_from_slice(&near_first);
            } else {
                self.split(set, half);
            }
        }
        let (left, right) = (self.last_mark - 1, self.last_mark);
        let (mut keep, mut left_len) = (0, 0);
        for i in 0..set.len() {
            let v = set[i];
            let of = self.mark[v as usize];
            if of == left && self.touches(v, right) {
                self.separator.push(v);
            } else if of != 0 {
                set[keep] = v;
                keep += 1;
                left_len += usize::from(of == left);
            }
        }
        set[keep..].copy_from_slice(&self.separator);
        let (left, right) = set[..keep].split_at_mut(left_len);
        self.dissect(left);
        self.dissect(right);
    }

    /// Marks the halves of a set, and takes hubs into the separator. Gives the separator's size.
    fn split(&mut self, set: &[u32], half: usize) -> usize {
        self.last_mark += 2;
        let (left, right) = (self.last_mark - 1, self.last_mark);
        for (i, &v) in set.iter().enumerate() {
            self.mark[v as usize] = if i < half { left } else { right };
        }
        self.take_hubs(set, half);
        self.separator.len() + self.touching(&set[..half], right)
    }

    /// The vertices of a set from one end to the other: those nearer to a far vertex first, in steps along
    /// edges, but not across hubs.
    fn breadth_first(&mut self, set: &[u32]) -> Vec<u32> {
        let mut order: Vec<u32> = Vec::with_capacity(set.len());
        let mut from = set[0];
        // The last one from anywhere is far away.
        for _ in 0..2 {
            self.last_mark += 2;
            let (open, seen) = (self.last_mark - 1, self.last_mark);
            set.iter().for_each(|&v| self.mark[v as usize] = open);
            order.clear();
            for v in std::iter::once(from).chain(set.iter().copied()) {
                let mut next = order.len();
                if std::mem::replace(&mut self.mark[v as usize], seen) == open {
                    order.push(v);
                }
                while let Some(&v) = order.get(next) {
                    next += 1;
                    let row = self.graph.row(v);
                    if row.len() > FLATTEN.most_crossed {
                        continue;
                    }
                    for e in row {
                        let to = self.graph.to[e];
                        if self.mark[to as usize] == open {
                            self.mark[to as usize] = seen;
                            order.push(to);
                        }
                    }
                }
            }
            from = order[order.len() - 1];
        }
        order
    }

    /// Puts the hubs of the right half, `set[half..]`, into the separator where that makes it much smaller,
    /// and takes their marks off: a hub on the wrong side makes a separator of all its neighbours.
    fn take_hubs(&mut self, set: &[u32], half: usize) {
        self.separator.clear();
        let (left, right) = (self.last_mark - 1, self.last_mark);
        let without = self.touching(&set[..half], right);
        if without <= FLATTEN.least_saved {
            return;
        }
        for &v in &set[half..] {
            if self.graph.row(v).filter(|&e| self.mark[self.graph.to[e] as usize] == left).count()
                >= FLATTEN.hub
            {
                self.separator.push(v);
            }
        }
        self.separator.iter().for_each(|&v| self.mark[v as usize] = 0);
        let with = self.separator.len() + self.touching(&set[..half], right);
        if 2 * with >= without || without - with <= FLATTEN.least_saved {
            self.separator.drain(..).for_each(|v| self.mark[v as usize] = right);
        }
    }

    /// Whether a neighbour of a vertex has this mark.
    fn touches(&self, v: u32, mark: u32) -> bool {
        self.graph.row(v).any(|e| self.mark[self.graph.to[e] as usize] == mark)
    }

    /// How many of some vertices have a neighbour with this mark.
    fn touching(&self, set: &[u32], mark: u32) -> usize {
        set.iter().filter(|&&v| self.touches(v, mark)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use std::f64::consts::TAU;

    /// A disc: triangles about a hub, which is vertex 0 and in the middle or on the rim.
    fn fan(n: u32, central: bool) -> (Vec<[u32; 3]>, Vec<[f64; 2]>) {
        let rim = |i: u32| (TAU * f64::from(i) / f64::from(n)).sin_cos();
        let at = |i: u32| <[f64; 2]>::from(rim(i));
        if central {
            let tris = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
            return (tris, std::iter::once([0.0; 2]).chain((0..n).map(at)).collect());
        }
        ((1..n - 1).map(|i| [0, i, i + 1]).collect(), (0..n).map(at).collect())
    }

    /// A band of `wide` by `n` quads.
    fn band(n: u32, wide: u32) -> (Vec<[u32; 3]>, Vec<[f64; 2]>) {
        let at = |i: u32, j: u32| i * (wide + 1) + j;
        let quad = |k: u32| {
            let (i, j) = (k / wide, k % wide);
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        };
        let points = (0..(n + 1) * (wide + 1)).map(|k| [k / (wide + 1), k % (wide + 1)].map(f64::from));
        ((0..n * wide).flat_map(quad).collect(), points.collect())
    }

    /// A strip far wider than it is long, turned by an angle.
    fn needles(n: u32, angle: f64) -> (Vec<[u32; 3]>, Vec<[f64; 2]>) {
        let (tris, mut at) = band(n, 1);
        let (s, c) = angle.sin_cos();
        at.iter_mut().for_each(|p| {
            let [x, y] = [p[0] / f64::from(n), 10.0 * p[1]];
            *p = [c * x - s * y, s * x + c * y];
        });
        (tris, at)
    }

    /// Two fans whose rims are glued to a band: a closed can, cut open along its side and flattened somehow.
    fn can(n: u32) -> (Vec<[u32; 3]>, Vec<[f64; 2]>) {
        let (mut tris, mut at) = band(n, 1);
        let hub = at.len() as u32;
        tris.extend((0..n).flat_map(|i| [[2 * i, hub, 2 * i + 2], [2 * i + 1, 2 * i + 3, hub + 1]]));
        at.extend([[0.9 * f64::from(n), -0.5], [0.1 * f64::from(n), 1.5]]);
        (tris, at)
    }

    #[test]
    fn the_factor_of_fans_cans_and_strips_has_n_log_n_entries() {
        for n in [100, 1000, 10_000] {
            for (name, (tris, at)) in [
                ("fan", fan(n, true)),
                ("fan from the rim", fan(n, false)),
                ("strip", band(n / 2, 1)),
                ("needles", needles(n / 2, 0.0)),
                ("slanting needles", needles(n / 2, 0.7)),
                ("can", can(n / 2)),
                ("sheet", band(f64::from(n).sqrt() as u32, f64::from(n).sqrt() as u32)),
            ] {
                let entries = Run::default()
                    .execute(|ctx| {
                        let graph = Graph::from_triangles(at.len(), &tris, &vec![[1.0; 3]; tris.len()], ctx);
                        let factor = Factor::laplacian(&graph, &at, |_| 1e-9, ctx);
                        // What it solves is right, whatever the order.
                        let sample = |i: usize| [(i as f64).sin(), (i as f64).cos()];
                        let x: Vec<[f64; 2]> = (0..at.len()).map(sample).collect();
                        let mut b: Vec<[f64; 2]> = (0..at.len())
                            .map(|i| {
                                [0, 1].map(|k| {
                                    (graph.row(i as u32))
                                        .map(|e| graph.weight[e] * (x[i][k] - x[graph.to[e] as usize][k]))
                                        .sum::<f64>()
                                        + 1e-9 * x[i][k]
                                })
                            })
                            .collect();
                        factor.solve(&mut b, &mut Vec::new(), ctx);
                        let shift = [0, 1].map(|k| b[0][k] - x[0][k]);
                        let off = (b.iter().zip(&x))
                            .flat_map(|(b, x)| [0, 1].map(|k| (b[k] - x[k] - shift[k]).abs()))
                            .fold(0.0, f64::max);
                        assert!(off < 1e-6, "{name} of {n}: {off}");
                        Ok(factor.value.len())
                    })
                    .expect("nothing cancels");
                let per = entries as f64 / (at.len() as f64 * (at.len() as f64).log2());
                assert!(per < 3.0, "{name} of {n}: {entries} entries, {per} n log n");
            }
        }
    }
}
