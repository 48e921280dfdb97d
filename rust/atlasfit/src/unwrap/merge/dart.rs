//! A part of a border along which charts are joined: what does not close without too much stretch stays open,
//! as a dart does in a coat.
//!
//! In: two charts and a path of edges that they share. Out: the part of the path, of a given share of what it
//! costs as a seam, along which the two match best.

use super::align::Shared;
use crate::unwrap::chart::Chart;
use rustc_hash::{FxHashMap, FxHashSet};
use std::ops::Range;

/// A path of edges that two charts share, one after the other.
pub(super) struct Path {
    pub edges: Vec<Shared>,
    /// Those of the edges before each place.
    sums: Vec<Moments>,
}

impl Path {
    /// Of the edges of a path in any order.
    pub(super) fn new(a: &Chart, b: &Chart, edges: Vec<Shared>) -> Self {
        let edges = in_order(edges);
        let mut sums = vec![Moments::default()];
        if let Some(first) = edges.first() {
            let origin = [a.uv[first.a[0] as usize], b.uv[first.b[0] as usize]];
            sums.extend(edges.iter().scan(Moments::default(), |sum, e| {
                *sum = sum.with(&Moments::of(a, b, origin, e), 1.0);
                Some(*sum)
            }));
        }
        Self { edges, sums }
    }

    /// The part whose two sides match best, of those that first reach this share of what all of it costs from
    /// where they start. `None` where only all of it does.
    pub(super) fn best_part(&self, share: f64) -> Option<Range<usize>> {
        let n = self.edges.len();
        let wanted = share * self.sums[n].cost;
        let mut best = (f64::INFINITY, None);
        let mut end = 0;
        for start in 0..n {
            while end < n && self.sums[end].cost - self.sums[start].cost < wanted {
                end += 1;
            }
            let part = self.sums[end].with(&self.sums[start], -1.0);
            if part.cost < wanted {
                break;
            }
            if end - start < n && part.misfit() < best.0 {
                best = (part.misfit(), Some(start..end));
            }
        }
        best.1
    }
}

/// The edges of a path one after the other, as they run round the first chart.
fn in_order(path: Vec<Shared>) -> Vec<Shared> {
    let mut from: FxHashMap<u32, usize> = path.iter().zip(0..).map(|(e, i)| (e.a[0], i)).collect();
    let ends: FxHashSet<u32> = path.iter().map(|e| e.a[1]).collect();
    // A closed path begins anywhere.
    let start = path.iter().position(|e| !ends.contains(&e.a[0])).unwrap_or(0);
    let mut out = Vec::with_capacity(path.len());
    let mut next = path.get(start).and_then(|e| from.remove(&e.a[0]));
    while let Some(i) = next {
        out.push(path[i]);
        next = from.remove(&path[i].a[1]);
    }
    out
}

/// Sums over the end points of edges, weighted by the edges' lengths, from which follows how well the two
/// sides match.
#[derive(Clone, Copy, Default)]
struct Moments {
    weight: f64,
    /// What the edges cost as a seam.
    cost: f64,
    /// Of either side's points.
    points: [[f64; 2]; 2],
    /// Of the squares of both.
    squares: f64,
    /// Of the inner and outer products of the two sides' points.
    products: [f64; 2],
}

impl Moments {
    /// Those of an edge, with either side's points as seen from its origin.
    fn of(a: &Chart, b: &Chart, origin: [[f64; 2]; 2], e: &Shared) -> Self {
        let mut out = Self { cost: e.cost, ..Self::default() };
        let w = e.length.max(1e-12);
        for k in 0..2 {
            let (p, q) = (a.uv[e.a[k] as usize], b.uv[e.b[k] as usize]);
            let [p, q] = [(p, origin[0]), (q, origin[1])].map(|(p, o)| [p[0] - o[0], p[1] - o[1]]);
            let [inner, outer] = products(p, q);
            let point = Self {
                weight: w,
                cost: 0.0,
                points: [p, q].map(|p| p.map(|x| w * x)),
                squares: w * (products(p, p)[0] + products(q, q)[0]),
                products: [w * inner, w * outer],
            };
            out = out.with(&point, 1.0);
        }
        out
    }

    /// These and `sign` times others.
    fn with(&self, other: &Self, sign: f64) -> Self {
        let add = |x: [f64; 2], y: [f64; 2]| [x[0] + sign * y[0], x[1] + sign * y[1]];
        Self {
            weight: self.weight + sign * other.weight,
            cost: self.cost + sign * other.cost,
            points: [0, 1].map(|k| add(self.points[k], other.points[k])),
            squares: self.squares + sign * other.squares,
            products: add(self.products, other.products),
        }
    }

    /// Mean squared distance of the two sides' points after the rigid motion that `align` finds.
    fn misfit(&self) -> f64 {
        let w = self.weight;
        let [p, q] = self.points;
        let spread = self.squares - (products(p, p)[0] + products(q, q)[0]) / w;
        let of_means = products(p, q);
        let [inner, outer] = [0, 1].map(|k| self.products[k] - of_means[k] / w);
        ((spread - 2.0 * inner.hypot(outer)) / w).max(0.0)
    }
}

/// The inner and the outer product.
fn products(p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
    [p[0] * q[0] + p[1] * q[1], q[0] * p[1] - q[1] * p[0]]
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::align::align;
    use super::*;
    use proptest::prelude::*;

    /// Two strips of triangles on either side of a path of `height.len() - 1` edges that leads along -x: one
    /// below the straight path, one above the path whose vertices are so high.
    pub(in super::super) fn strips(height: &[f64]) -> (Chart, Chart, Vec<Shared>) {
        let n = height.len() as u32 - 1;
        let row = |y: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
            (0..=n as usize).map(|i| [-(i as f64), y(i)]).collect()
        };
        let mut below = Chart { uv: row(&|_| 0.0), ..Chart::default() };
        below.uv.extend(row(&|_| -1.0));
        let mut above = Chart { uv: row(&|i| height[i]), ..Chart::default() };
        above.uv.extend(row(&|i| height[i] + 1.0));
        let mut shared = Vec::new();
        for i in 0..n {
            let (j, k, l) = (i + 1, n + 1 + i, n + 2 + i);
            below.tris.extend([[i, j, l], [i, l, k]]);
            above.tris.extend([[j, i, k], [j, k, l]]);
            below.border.extend([(2 * i, 0), (2 * i + 1, 1)]);
            above.border.extend([(2 * i, 0), (2 * i + 1, 1)]);
            shared.push(Shared { a: [i, j], b: [i, j], length: 1.0, cost: 1.0 });
        }
        below.border.extend([(1, 2), (2 * n - 2, 1)]);
        above.border.extend([(0, 1), (2 * n - 1, 2)]);
        (below, above, shared)
    }

    #[test]
    fn the_part_is_the_one_where_the_sides_are_alike_in_whatever_order_edges_come() {
        let height: Vec<f64> =
            (0..=16).map(|i| if (5..=11).contains(&i) { 0.3 } else { f64::from(i % 2) }).collect();
        let (a, b, mut shared) = strips(&height);
        shared.rotate_left(7);
        shared.reverse();
        let path = Path::new(&a, &b, shared);
        assert!(path.edges.iter().zip(0..).all(|(e, i)| e.a == [i, i + 1]));
        assert_eq!(path.best_part(6.0 / 16.0), Some(5..11));
        assert_eq!(path.best_part(1.0), None);
    }

    #[test]
    fn a_closed_path_is_ordered_from_anywhere() {
        let edge = |i: u32| Shared { a: [i, (i + 1) % 5], b: [i, (i + 1) % 5], length: 1.0, cost: 1.0 };
        let ordered = in_order([3, 0, 4, 2, 1].map(edge).to_vec());
        assert_eq!(ordered.len(), 5);
        assert!(ordered.windows(2).all(|w| w[0].a[1] == w[1].a[0]));
    }

    proptest! {
        #[test]
        fn sides_match_as_well_as_the_best_rigid_motion_says(
            height in prop::collection::vec(-1.0..1.0f64, 4..12),
            (from, to) in (0..3usize, 3..20usize),
        ) {
            let (a, b, shared) = strips(&height);
            let path = Path::new(&a, &b, shared);
            let to = to.min(path.edges.len());
            let rms = align(&a, &b, &path.edges[from..to]).1;
            let misfit = path.sums[to].with(&path.sums[from], -1.0).misfit();
            prop_assert!((misfit.sqrt() - rms).abs() < 1e-6, "{} for {rms}", misfit.sqrt());
        }
    }
}
