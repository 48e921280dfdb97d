//! Nearest-neighbour search over a fixed set of points.
//!
//! In: finite points. Out: the k nearest, or all within a radius, as indices with squared distances, in an
//! order that does not depend on the tree (distance, then index), so that results are reproducible.

use crate::error::{Error, Result};
use crate::numeric::sort::partition;
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

/// Points of one tree: built in a few milliseconds, so that a cancel need not wait, and on all threads. A
/// search looks into the few trees whose boxes it touches.
const BLOCK: usize = 1 << 15;
/// Points that a split is chosen from.
const SAMPLE: usize = 511;

/// A forest of k-d trees (kiddo) over points.
pub struct Neighbours {
    blocks: Vec<Block>,
    len: usize,
}

/// A tree over some of the points.
struct Block {
    tree: ImmutableKdTree<f64, 3>,
    /// Indices of its points.
    of: Vec<u32>,
    low: Vec3,
    high: Vec3,
}

impl Block {
    /// Squared distance of `q` to the box about the points.
    #[inline]
    fn away(&self, q: Vec3) -> f64 {
        let d = [0, 1, 2].map(|k| (self.low[k] - q[k]).max(q[k] - self.high[k]).max(0.0));
        d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    }
    fn neighbour(&self, item: u32, dist2: f64) -> Neighbour {
        Neighbour { dist2, index: self.of[item as usize] }
    }
}

/// A neighbour: squared distance and index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Squared distance to the query.
    pub dist2: f64,
    /// Index of the point.
    pub index: u32,
}

impl Neighbours {
    /// Builds the trees. All coordinates must be finite.
    ///
    /// # Errors
    /// [`Error::EmptyInput`] without points; [`Error::InvalidArgument`] above 2^32 - 2 points; cancelled or
    /// out of time.
    pub fn build(points: &[Vec3], ctx: &Context<'_>) -> Result<Self> {
        if points.is_empty() {
            return Err(Error::empty("no point to search among", "Give at least one point"));
        }
        if points.len() >= u32::MAX as usize {
            return Err(Error::invalid(format!("{} points", points.len()), "Give fewer points"));
        }
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        Ok(Self { blocks: blocks(points, &mut order, ctx)?, len: points.len() })
    }

    /// The `k` nearest points to `query` (fewer if there are fewer), nearest first, written to `out`.
    pub fn nearest(&self, query: Vec3, k: usize, out: &mut Vec<Neighbour>) {
        out.clear();
        let Some(n) = NonZero::new(k.min(self.len)) else { return };
        let home = self.home(query);
        let b = &self.blocks[home];
        out.extend(
            b.tree
                .query(&query)
                .nearest_n::<SquaredEuclidean<f64>>(n)
                .execute()
                .into_iter()
                .map(|r| b.neighbour(r.item, r.distance)),
        );
        sort(out);
        for (_, b) in self.blocks.iter().enumerate().filter(|(i, _)| *i != home) {
            let reach = match out.last() {
                Some(last) if out.len() == n.get() => last.dist2,
                _ => f64::INFINITY,
            };
            if b.away(query) > reach {
                continue;
            }
            let search = b.tree.query(&query).nearest_n::<SquaredEuclidean<f64>>(n);
            out.extend(
                search
                    .within::<SquaredEuclidean<f64>>(reach)
                    .execute()
                    .into_iter()
                    .map(|r| b.neighbour(r.item, r.distance)),
            );
            sort(out);
            out.truncate(n.get());
        }
    }

    /// The nearest point to `query`.
    #[must_use]
    pub fn nearest_one(&self, query: Vec3) -> Neighbour {
        let one = |b: &Block| {
            let r = b.tree.query(&query).nearest_one::<SquaredEuclidean<f64>>().execute();
            b.neighbour(r.item, r.distance)
        };
        let home = self.home(query);
        let mut best = one(&self.blocks[home]);
        for (_, b) in self.blocks.iter().enumerate().filter(|(i, _)| *i != home) {
            if b.away(query) < best.dist2 {
                let other = one(b);
                if other.dist2 < best.dist2 {
                    best = other;
                }
            }
        }
        best
    }

    /// All points within `radius` of `query`, nearest first, written to `out`.
    pub fn within(&self, query: Vec3, radius: f64, out: &mut Vec<Neighbour>) {
        out.clear();
        for b in self.blocks.iter().filter(|b| b.away(query) <= radius * radius) {
            out.extend(
                b.tree
                    .query(&query)
                    .within::<SquaredEuclidean<f64>>(radius * radius)
                    .unsorted()
                    .execute()
                    .into_iter()
                    .map(|r| b.neighbour(r.item, r.distance)),
            );
        }
        sort(out);
    }

    /// The tree whose box is nearest.
    fn home(&self, q: Vec3) -> usize {
        let mut best = (f64::INFINITY, 0);
        for (i, b) in self.blocks.iter().enumerate() {
            let away = b.away(q);
            if away < best.0 {
                best = (away, i);
            }
        }
        best.1
    }
}

/// Cuts the points at the median of the longest side, again and again, down to what one tree takes.
fn blocks(points: &[Vec3], order: &mut [u32], ctx: &Context<'_>) -> Result<Vec<Block>> {
    ctx.check()?;
    if order.len() > BLOCK {
        let sample: Vec<Vec3> =
            (0..SAMPLE).map(|k| points[order[k * (order.len() - 1) / (SAMPLE - 1)] as usize]).collect();
        let [low, high] = bounds(&sample);
        let axis = (0..3).fold(0, |a, k| if high[k] - low[k] > high[a] - low[a] { k } else { a });
        let mut along: Vec<f64> = sample.iter().map(|p| p[axis]).collect();
        let pivot = *along.select_nth_unstable_by(SAMPLE / 2, f64::total_cmp).1;
        let mut cut = partition(order, |&i| points[i as usize][axis] < pivot, ctx)?;
        if cut == 0 {
            cut = partition(order, |&i| points[i as usize][axis] <= pivot, ctx)?;
        }
        // Points that are all but equal cannot be cut.
        if cut > 0 && cut < order.len() {
            let (a, b) = order.split_at_mut(cut);
            let (a, b) = rayon::join(|| blocks(points, a, ctx), || blocks(points, b, ctx));
            let mut all = a?;
            all.extend(b?);
            return Ok(all);
        }
    }
    let own: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
    let tree = ImmutableKdTree::new_from_slice(vec3::plain_slice(&own))
        .map_err(|e| Error::invalid(format!("{} points: {e:?}", own.len()), "Give fewer points"))?;
    let [low, high] = bounds(&own);
    Ok(vec![Block { tree, of: order.to_vec(), low, high }])
}

fn bounds(points: &[Vec3]) -> [Vec3; 2] {
    points.iter().fold([Vec3([f64::INFINITY; 3]), Vec3([f64::NEG_INFINITY; 3])], |[lo, hi], p| {
        [Vec3::from_fn(|k| lo[k].min(p[k])), Vec3::from_fn(|k| hi[k].max(p[k]))]
    })
}

fn sort(found: &mut [Neighbour]) {
    found.sort_unstable_by(|a, b| a.dist2.total_cmp(&b.dist2).then(a.index.cmp(&b.index)));
}
