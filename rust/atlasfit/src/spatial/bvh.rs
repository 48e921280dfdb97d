//! A bounding volume hierarchy over any primitives that have a box: nearest primitive, and boxes that meet.
//!
//! In: one box per primitive. Out: a balanced binary tree over them. Splits are medians of the box centres
//! along the longest side, so the shape of the tree depends on the count alone: nodes lie in preorder, need
//! no links, and subtrees are built in parallel into disjoint slices.

use super::constants::SPATIAL;
use crate::error::Result;
use crate::numeric::sort::select_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use std::ops::ControlFlow;

/// An axis-aligned box.
///
/// ```
/// use atlasfit::{Vec3, spatial::bvh::Aabb};
/// let b = Aabb::of(&[Vec3([0.0; 3]), Vec3([1.0, 2.0, 0.0])]);
/// assert_eq!((b.longest_side(), b.distance2(Vec3([0.0, 0.0, 3.0]))), (2.0, 9.0));
/// assert_eq!(b.join(&Aabb::EMPTY), b);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box of nothing.
    pub const EMPTY: Self = Self { min: Vec3([f64::INFINITY; 3]), max: Vec3([f64::NEG_INFINITY; 3]) };

    /// The smallest box around points.
    #[must_use]
    pub fn of(points: &[Vec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| b.join(&Self { min: *p, max: *p }))
    }
    /// The smallest box around two boxes.
    #[inline]
    #[must_use]
    pub fn join(&self, o: &Self) -> Self {
        Self {
            min: Vec3::from_fn(|k| self.min[k].min(o.min[k])),
            max: Vec3::from_fn(|k| self.max[k].max(o.max[k])),
        }
    }
    /// Squared distance from a point; 0 inside.
    #[inline]
    #[must_use]
    pub fn distance2(&self, p: Vec3) -> f64 {
        let d: Vec3 = Vec3::from_fn(|k| (self.min[k] - p[k]).max(p[k] - self.max[k]).max(0.0));
        d.norm2()
    }
    /// The longest side of the box; 0 for the box of nothing.
    #[must_use]
    pub fn longest_side(&self) -> f64 {
        (0..3).map(|k| self.max[k] - self.min[k]).fold(0.0, f64::max)
    }
    /// Whether two boxes share a point.
    #[must_use]
    pub(crate) fn meets(&self, o: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= o.max[k] && o.min[k] <= self.max[k])
    }
    /// Whether a ray meets it (slabs, Kay and Kajiya 1986); `inverse` has the inverses of the direction's
    /// components, which may be infinite.
    fn is_met(&self, from: Vec3, inverse: Vec3) -> bool {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let a = (self.min[k] - from[k]) * inverse[k];
            let b = (self.max[k] - from[k]) * inverse[k];
            // A ray within a side has no number here, which the minimum and the maximum pass over.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

/// The tree.
///
/// ```
/// use atlasfit::{Run, Vec3, spatial::bvh::{Aabb, Bvh}};
/// use std::ops::ControlFlow;
/// let points = [0.0, 1.0, 5.0].map(|x| Vec3([x, 0.0, 0.0]));
/// let tree = Run::default().execute(|ctx| Bvh::build(&points.map(|p| Aabb::of(&[p])), ctx))?;
/// let query = Vec3([3.5, 0.0, 0.0]);
/// let nearest = tree.nearest(query, f64::INFINITY, |i| points[i as usize].dist2(query));
/// assert_eq!(nearest, Some((2, 2.25)));
/// let region = Aabb::of(&[Vec3([4.0, 0.0, 0.0]), Vec3([6.0, 0.0, 0.0])]);
/// let found = tree.meeting(&region, |i| match i {
///     2 => ControlFlow::Break(i),
///     _ => ControlFlow::Continue(()),
/// });
/// assert_eq!(found, ControlFlow::Break(2));
/// # Ok::<(), atlasfit::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    pub(super) nodes: Vec<Aabb>,
    pub(super) order: Vec<u32>,
    pub(super) height: u32,
}

/// Nodes of a full binary tree of the given height (a leaf has height 0).
pub(super) const fn tree_size(height: u32) -> usize {
    (2usize << height) - 1
}

impl Bvh {
    /// Builds the tree. Boxes must be finite. O(n log n), in parallel inside a rayon pool.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled), [`Error::TimedOut`](crate::Error::TimedOut).
    pub fn build(boxes: &[Aabb], ctx: &Context<'_>) -> Result<Self> {
        if boxes.is_empty() {
            return Ok(Self::default());
        }
        let height = boxes.len().div_ceil(SPATIAL.leaf).next_power_of_two().trailing_zeros();
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = vec![Aabb::EMPTY; tree_size(height)];
        build_node(boxes, &mut order, &mut nodes, height, ctx)?;
        Ok(Self { nodes, order, height })
    }

    /// The primitive nearest to `query`, with its squared distance, among those nearer than `limit2`.
    /// `distance2` gives a primitive's squared distance to the query.
    pub fn nearest(
        &self,
        query: Vec3,
        limit2: f64,
        mut distance2: impl FnMut(u32) -> f64,
    ) -> Option<(u32, f64)> {
        let (mut best, mut best2) = (None, limit2);
        if self.nodes.is_empty() {
            return None;
        }
        // (squared distance of the box, node, height, range of `order`)
        let mut stack: Vec<(f64, usize, u32, usize, usize)> = Vec::with_capacity(64);
        stack.push((self.nodes[0].distance2(query), 0, self.height, 0, self.order.len()));
        while let Some((box2, node, height, lo, hi)) = stack.pop() {
            if box2 >= best2 {
                continue;
            }
            if height == 0 {
                for &i in &self.order[lo..hi] {
                    let d = distance2(i);
                    if d < best2 {
                        best2 = d;
                        best = Some(i);
                    }
                }
                continue;
            }
            let mid = lo.midpoint(hi);
            let (l, r) = (node + 1, node + 1 + tree_size(height - 1));
            let near = (self.nodes[l].distance2(query), l, height - 1, lo, mid);
            let far = (self.nodes[r].distance2(query), r, height - 1, mid, hi);
            let (near, far) = if near.0 <= far.0 { (near, far) } else { (far, near) };
            if far.0 < best2 {
                stack.push(far);
            }
            if near.0 < best2 {
                stack.push(near);
            }
        }
        best.map(|i| (i, best2))
    }

    /// Visits every primitive whose leaf box meets `region`, until the visitor breaks. Primitives whose own
    /// box misses the region may be among them.
    pub fn meeting<B>(&self, region: &Aabb, visit: impl FnMut(u32) -> ControlFlow<B>) -> ControlFlow<B> {
        self.visit(|node| node.meets(region), visit)
    }

    /// Visits every primitive whose leaf box a ray meets, until the visitor breaks. The direction has any
    /// length. Primitives whose own box the ray misses may be among them.
    pub(crate) fn along<B>(
        &self,
        from: Vec3,
        direction: Vec3,
        visit: impl FnMut(u32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let inverse = Vec3::from_fn(|k| 1.0 / direction[k]);
        self.visit(|node| node.is_met(from, inverse), visit)
    }

    /// Visits every primitive of the leaves whose box, and every box about it, is `wanted`.
    #[inline]
    fn visit<B>(
        &self,
        wanted: impl Fn(&Aabb) -> bool,
        mut visit: impl FnMut(u32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if self.nodes.is_empty() {
            return ControlFlow::Continue(());
        }
        let mut stack = vec![(0usize, self.height, 0usize, self.order.len())];
        while let Some((node, height, lo, hi)) = stack.pop() {
            if !wanted(&self.nodes[node]) {
                continue;
            }
            if height == 0 {
                for &i in &self.order[lo..hi] {
                    visit(i)?;
                }
            } else {
                let mid = lo.midpoint(hi);
                stack.push((node + 1 + tree_size(height - 1), height - 1, mid, hi));
                stack.push((node + 1, height - 1, lo, mid));
            }
        }
        ControlFlow::Continue(())
    }
}

fn build_node(
    boxes: &[Aabb],
    order: &mut [u32],
    nodes: &mut [Aabb],
    height: u32,
    ctx: &Context<'_>,
) -> Result<()> {
    if height == 0 {
        nodes[0] = order.iter().fold(Aabb::EMPTY, |b, &i| b.join(&boxes[i as usize]));
        return Ok(());
    }
    let centres = order.iter().fold(Aabb::EMPTY, |b, &i| {
        let c = centre(&boxes[i as usize]);
        b.join(&Aabb { min: c, max: c })
    });
    let axis =
        (1..3).fold(
            0,
            |a, k| {
                if centres.max[k] - centres.min[k] > centres.max[a] - centres.min[a] { k } else { a }
            },
        );
    let mid = order.len() / 2;
    if mid > 0 {
        // The index breaks ties, so that the tree does not depend on how the selection shuffles.
        let by_centre = |a: &u32, b: &u32| {
            let (x, y) = (centre(&boxes[*a as usize])[axis], centre(&boxes[*b as usize])[axis]);
            x.total_cmp(&y).then(a.cmp(b))
        };
        select_by(order, mid, by_centre, ctx)?;
    }
    let count = order.len();
    let (left, right) = order.split_at_mut(mid);
    let (node, below) = nodes.split_at_mut(1);
    let (nl, nr) = below.split_at_mut(tree_size(height - 1));
    if count > SPATIAL.parallel {
        ctx.check()?;
        let (l, r) = rayon::join(
            || build_node(boxes, left, nl, height - 1, ctx),
            || build_node(boxes, right, nr, height - 1, ctx),
        );
        l.and(r)?;
    } else {
        build_node(boxes, left, nl, height - 1, ctx)?;
        build_node(boxes, right, nr, height - 1, ctx)?;
    }
    node[0] = nl[0].join(&nr[0]);
    Ok(())
}

fn centre(b: &Aabb) -> Vec3 {
    Vec3::from_fn(|k| 0.5 * b.min[k] + 0.5 * b.max[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::run::Run;

    fn build(boxes: &[Aabb]) -> Bvh {
        Run::default().execute(|ctx| Bvh::build(boxes, ctx)).unwrap()
    }

    #[test]
    fn nearest_equals_brute_force_for_any_count() {
        let mut rng = Rng::new(3);
        for n in [0usize, 1, 2, 3, 4, 5, 7, 8, 9, 31, 64, 100, 5000] {
            let points: Vec<Vec3> = (0..n)
                .map(|i| if i % 5 == 0 { Vec3([0.5; 3]) } else { Vec3::from_fn(|_| rng.uniform()) })
                .collect();
            let boxes: Vec<Aabb> = points.iter().map(|p| Aabb::of(&[*p])).collect();
            let tree = build(&boxes);
            for _ in 0..50 {
                let q: Vec3 = Vec3::from_fn(|_| 2.0 * rng.uniform() - 0.5);
                let found = tree.nearest(q, f64::INFINITY, |i| q.dist2(points[i as usize]));
                let brute = points.iter().map(|p| q.dist2(*p)).fold(f64::INFINITY, f64::min);
                assert_eq!(found.map_or(f64::INFINITY, |f| f.1), brute, "{n}");
            }
        }
    }

    #[test]
    fn a_ray_finds_every_box_that_it_meets_and_not_those_behind_it() {
        let mut rng = Rng::new(6);
        let centres: Vec<Vec3> = (0..300).map(|_| Vec3::from_fn(|_| rng.uniform())).collect();
        let boxes: Vec<Aabb> =
            centres.iter().map(|&c| Aabb { min: c, max: c + Vec3::from_fn(|_| 0.05) }).collect();
        let tree = build(&boxes);
        for axis in 0..40 {
            let from = Vec3::from_fn(|_| rng.uniform());
            let toward = match axis {
                0..3 => Vec3::from_fn(|k| f64::from(u8::from(k == axis))),
                _ => Vec3::from_fn(|_| rng.uniform() - 0.5),
            };
            let mut seen = Vec::new();
            let _ = tree.along(from, toward, |i| {
                seen.push(i);
                ControlFlow::<()>::Continue(())
            });
            // Many places along the ray, of which some lie in each box that it meets.
            for place in (0..4000).map(|i| from + toward * (f64::from(i) * 0.002)) {
                for (j, b) in boxes.iter().enumerate() {
                    assert!(b.distance2(place) > 0.0 || seen.contains(&(j as u32)));
                }
            }
            assert!(seen.len() < 150, "leaves that are far off are left out");
        }
    }

    #[test]
    fn meeting_finds_every_box_that_meets() {
        let mut rng = Rng::new(5);
        let boxes: Vec<Aabb> = (0..300)
            .map(|_| {
                let c: Vec3 = Vec3::from_fn(|_| rng.uniform());
                Aabb { min: c, max: Vec3::from_fn(|k| c[k] + 0.1 * rng.uniform()) }
            })
            .collect();
        let tree = build(&boxes);
        for b in &boxes {
            let mut seen = Vec::new();
            let _ = tree.meeting(b, |i| {
                seen.push(i);
                ControlFlow::<()>::Continue(())
            });
            for (j, o) in boxes.iter().enumerate() {
                assert!(!b.meets(o) || seen.contains(&(j as u32)));
            }
        }
    }
}
