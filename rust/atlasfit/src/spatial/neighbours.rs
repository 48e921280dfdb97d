//! Nearest-neighbour search over a fixed set of points.
//!
//! In: finite points. Out: the k nearest, or all within a radius, as indices with squared distances, in an
//! order that does not depend on the tree (distance, then index), so that results are reproducible.

use super::constants::SPATIAL;
use crate::error::{Error, Result};
use crate::numeric::sort::partition;
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;

/// Stands for no block.
const NONE: u32 = u32::MAX;

/// A forest of k-d trees (kiddo) over points, below a tree of boxes: a search looks only into the trees whose
/// boxes it touches, and finds these in time that grows with the logarithm of their number.
///
/// ```
/// use atlasfit::{Run, Vec3, spatial::Neighbours};
/// let points: Vec<Vec3> = (0..9).map(|i| Vec3([f64::from(i), 0.0, 0.0])).collect();
/// let tree = Run::default().execute(|ctx| Neighbours::build(&points, ctx))?;
/// let (query, mut found) = (Vec3([2.25, 0.0, 0.0]), Vec::new());
/// tree.nearest(query, 2, &mut found);
/// assert_eq!((found[0].index, found[1].index), (2, 3));
/// tree.within(query, 1.5, &mut found);
/// assert_eq!(found.len(), 3);
/// assert_eq!(tree.nearest_one(query).dist2, 0.0625);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub struct Neighbours {
    /// The boxes in preorder: a node, its first child with all below it, its second child.
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    len: usize,
}

/// The box about the points of a block, or of all blocks below.
struct Node {
    low: Vec3,
    high: Vec3,
    /// The block; [`NONE`] where there are nodes below.
    block: u32,
    /// The node that follows those below.
    next: u32,
}

impl Node {
    /// Squared distance of `q` to the box.
    #[inline]
    fn away(&self, q: Vec3) -> f64 {
        let d = [0, 1, 2].map(|k| (self.low[k] - q[k]).max(q[k] - self.high[k]).max(0.0));
        d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    }
}

/// A tree over some of the points.
struct Block {
    tree: ImmutableKdTree<f64, 3>,
    /// Indices of its points.
    of: Vec<u32>,
}

impl Block {
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
        Self::with_blocks(points, SPATIAL.block, ctx)
    }

    /// [`Neighbours::build`] with trees of at most `block` points.
    fn with_blocks(points: &[Vec3], block: usize, ctx: &Context<'_>) -> Result<Self> {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let Forest { nodes, blocks } = forest(points, &mut order, block, ctx)?;
        Ok(Self { nodes, blocks, len: points.len() })
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
        let reach = |out: &[Neighbour]| match out.last() {
            Some(last) if out.len() == n.get() => last.dist2,
            _ => f64::INFINITY,
        };
        self.touched(query, reach(out), |i, b| {
            if i != home {
                let search = b.tree.query(&query).nearest_n::<SquaredEuclidean<f64>>(n);
                out.extend(
                    search
                        .within::<SquaredEuclidean<f64>>(reach(out))
                        .execute()
                        .into_iter()
                        .map(|r| b.neighbour(r.item, r.distance)),
                );
                sort(out);
                out.truncate(n.get());
            }
            reach(out)
        });
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
        self.touched(query, best.dist2, |i, b| {
            if i != home {
                let other = one(b);
                if other.dist2 < best.dist2 {
                    best = other;
                }
            }
            best.dist2
        });
        best
    }

    /// The nearest point to each of the places.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn nearest_of(&self, places: &[Vec3], ctx: &Context<'_>) -> Result<Vec<u32>> {
        let of = |chunk: &[Vec3]| {
            ctx.check()?;
            Ok(chunk.iter().map(|&p| self.nearest_one(p).index).collect::<Vec<_>>())
        };
        Ok(places.par_chunks(1024).map(of).collect::<Result<Vec<_>>>()?.concat())
    }

    /// All points within `radius` of `query`, nearest first, written to `out`.
    pub fn within(&self, query: Vec3, radius: f64, out: &mut Vec<Neighbour>) {
        out.clear();
        let reach = radius * radius;
        self.touched(query, reach, |_, b| {
            out.extend(
                b.tree
                    .query(&query)
                    .within::<SquaredEuclidean<f64>>(reach)
                    .unsorted()
                    .execute()
                    .into_iter()
                    .map(|r| b.neighbour(r.item, r.distance)),
            );
            reach
        });
        sort(out);
    }

    /// Visits the blocks whose boxes are no farther from `q` than the root of `reach`, in their order. Each
    /// visit gives the reach from there on.
    fn touched(&self, q: Vec3, mut reach: f64, mut visit: impl FnMut(usize, &Block) -> f64) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if node.away(q) > reach {
                at = node.next as usize;
                continue;
            }
            if node.block != NONE {
                reach = visit(node.block as usize, &self.blocks[node.block as usize]);
            }
            at += 1;
        }
    }

    /// The block whose box is nearest; of several, the first.
    fn home(&self, q: Vec3) -> usize {
        let mut best = (f64::INFINITY, NONE);
        self.home_below(0, self.nodes[0].away(q), q, &mut best);
        best.1 as usize
    }

    /// The same among the blocks below a node that is `away` from `q`, if one is nearer than the best so far.
    fn home_below(&self, at: usize, away: f64, q: Vec3, best: &mut (f64, u32)) {
        if away > best.0 {
            return;
        }
        let node = &self.nodes[at];
        if node.block != NONE {
            if (away, node.block) < *best {
                *best = (away, node.block);
            }
            return;
        }
        let (a, b) = (at + 1, self.nodes[at + 1].next as usize);
        let (a, b) = ((self.nodes[a].away(q), a), (self.nodes[b].away(q), b));
        // The nearer is looked at first.
        let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
        self.home_below(near.1, near.0, q, best);
        self.home_below(far.1, far.0, q, best);
    }
}

/// Nodes in preorder and the blocks that they name.
struct Forest {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

/// Cuts the points at the median of the longest side, again and again, down to what one tree takes.
fn forest(points: &[Vec3], order: &mut [u32], block: usize, ctx: &Context<'_>) -> Result<Forest> {
    ctx.check()?;
    if order.len() > block {
        let sample: Vec<Vec3> = (0..SPATIAL.sample)
            .map(|k| points[order[k * (order.len() - 1) / (SPATIAL.sample - 1)] as usize])
            .collect();
        let [low, high] = bounds(&sample);
        let axis = (0..3).fold(0, |a, k| if high[k] - low[k] > high[a] - low[a] { k } else { a });
        let mut along: Vec<f64> = sample.iter().map(|p| p[axis]).collect();
        let pivot = *along.select_nth_unstable_by(SPATIAL.sample / 2, f64::total_cmp).1;
        let mut cut = partition(order, |&i| points[i as usize][axis] < pivot, ctx)?;
        if cut == 0 {
            cut = partition(order, |&i| points[i as usize][axis] <= pivot, ctx)?;
        }
        // Points that are all but equal cannot be cut.
        if cut > 0 && cut < order.len() {
            let (a, b) = order.split_at_mut(cut);
            let (a, b) = rayon::join(|| forest(points, a, block, ctx), || forest(points, b, block, ctx));
            return Ok(joined(a?, b?));
        }
    }
    let own: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
    let tree = ImmutableKdTree::new_from_slice(vec3::plain_slice(&own))
        .map_err(|e| Error::invalid(format!("{} points: {e:?}", own.len()), "Give fewer points"))?;
    let [low, high] = bounds(&own);
    let node = Node { low, high, block: 0, next: 1 };
    Ok(Forest { nodes: vec![node], blocks: vec![Block { tree, of: order.to_vec() }] })
}

/// Two forests below one node.
fn joined(a: Forest, b: Forest) -> Forest {
    let low = Vec3::from_fn(|k| a.nodes[0].low[k].min(b.nodes[0].low[k]));
    let high = Vec3::from_fn(|k| a.nodes[0].high[k].max(b.nodes[0].high[k]));
    let (before, blocks) = (a.nodes.len() as u32 + 1, a.blocks.len() as u32);
    let next = before + b.nodes.len() as u32;
    let mut nodes = vec![Node { low, high, block: NONE, next }];
    nodes.extend(a.nodes.into_iter().map(|n| Node { next: n.next + 1, ..n }));
    nodes.extend(b.nodes.into_iter().map(|n| Node {
        next: n.next + before,
        block: if n.block == NONE { NONE } else { n.block + blocks },
        ..n
    }));
    Forest { nodes, blocks: a.blocks.into_iter().chain(b.blocks).collect() }
}

fn bounds(points: &[Vec3]) -> [Vec3; 2] {
    points.iter().fold([Vec3([f64::INFINITY; 3]), Vec3([f64::NEG_INFINITY; 3])], |[lo, hi], p| {
        [Vec3::from_fn(|k| lo[k].min(p[k])), Vec3::from_fn(|k| hi[k].max(p[k]))]
    })
}

fn sort(found: &mut [Neighbour]) {
    found.sort_unstable_by(|a, b| a.dist2.total_cmp(&b.dist2).then(a.index.cmp(&b.index)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::numeric::Rng;

    #[test]
    fn many_small_trees_find_what_a_look_at_every_point_finds() {
        let mut rng = Rng::new(11);
        // Even coordinates: many distances are equal.
        let point = |rng: &mut Rng| Vec3::from_fn(|_| (8.0 * rng.uniform()).round());
        for n in [1, 17, 300, 2000] {
            let points: Vec<Vec3> = (0..n).map(|_| point(&mut rng)).collect();
            let tree = Run::default().execute(|ctx| Neighbours::with_blocks(&points, 16, ctx)).unwrap();
            assert!(n < 300 || tree.blocks.len() > 15);
            let mut found = Vec::new();
            for _ in 0..40 {
                let q = point(&mut rng) + Vec3([0.25, 0.0, -2.0]);
                let mut all: Vec<f64> = points.iter().map(|p| p.dist2(q)).collect();
                let within = all.iter().filter(|d| **d <= 9.0).count();
                all.sort_by(f64::total_cmp);
                tree.nearest(q, 7, &mut found);
                assert!(found.iter().map(|f| f.dist2).eq(all.iter().copied().take(7)));
                assert_eq!(tree.nearest_one(q).dist2, all[0]);
                tree.within(q, 3.0, &mut found);
                assert_eq!(found.len(), within);
            }
        }
    }
}
