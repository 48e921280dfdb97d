//! Nearest-neighbour search over a fixed set of points.
//!
//! In: finite points. Out: the k nearest, or all within a radius, as indices with squared distances, in an
//! order that does not depend on the tree (distance, then index), so that results are reproducible.

use super::vec3::Vec3;
use crate::error::{Error, Result};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

/// A k-d tree over points (kiddo).
pub struct Neighbours {
    tree: ImmutableKdTree<f64, 3>,
    len: usize,
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
    /// Builds the tree. All coordinates must be finite.
    ///
    /// # Errors
    /// [`Error::EmptyInput`] without points; [`Error::InvalidArgument`] above 2^32 - 1 points.
    pub fn build(points: &[Vec3]) -> Result<Self> {
        if points.is_empty() {
            return Err(Error::empty("no point to search among", "Give at least one point"));
        }
        let tree = ImmutableKdTree::new_from_slice(points)
            .map_err(|e| Error::invalid(format!("{} points: {e:?}", points.len()), "Give fewer points"))?;
        Ok(Self { tree, len: points.len() })
    }

    /// The `k` nearest points to `query` (fewer if there are fewer), nearest first, written to `out`.
    pub fn nearest(&self, query: Vec3, k: usize, out: &mut Vec<Neighbour>) {
        out.clear();
        let Some(k) = NonZero::new(k.min(self.len)) else { return };
        out.extend(
            self.tree
                .query(&query)
                .nearest_n::<SquaredEuclidean<f64>>(k)
                .execute()
                .into_iter()
                .map(|r| Neighbour { dist2: r.distance, index: r.item }),
        );
        sort(out);
    }

    /// The nearest point to `query`.
    #[must_use]
    pub fn nearest_one(&self, query: Vec3) -> Neighbour {
        let r = self.tree.query(&query).nearest_one::<SquaredEuclidean<f64>>().execute();
        Neighbour { dist2: r.distance, index: r.item }
    }

    /// All points within `radius` of `query`, nearest first, written to `out`.
    pub fn within(&self, query: Vec3, radius: f64, out: &mut Vec<Neighbour>) {
        out.clear();
        out.extend(
            self.tree
                .query(&query)
                .within::<SquaredEuclidean<f64>>(radius * radius)
                .unsorted()
                .execute()
                .into_iter()
                .map(|r| Neighbour { dist2: r.distance, index: r.item }),
        );
        sort(out);
    }
}

fn sort(found: &mut [Neighbour]) {
    found.sort_unstable_by(|a, b| a.dist2.total_cmp(&b.dist2).then(a.index.cmp(&b.index)));
}
