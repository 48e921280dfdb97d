//! The triangles about each vertex, kept while edges are collapsed.
//!
//! In: triangles. Out: for each vertex the list of its own, which may be replaced by another one.

use crate::error::Result;
use crate::run::Context;
use crate::spatial::lists::Lists;

/// Lists in one array; one that is replaced leaves its old place unused.
pub(super) struct Stars {
    /// Where each vertex's list starts and ends.
    span: Vec<[u32; 2]>,
    items: Vec<u32>,
}

impl Stars {
    /// Lists the triangles about each of so many vertices.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn new(vertices: usize, triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Self> {
        let (span, items) = Lists::new(vertices, triangles, ctx)?.into_spans();
        Ok(Self { span, items })
    }

    /// The triangles of a vertex.
    #[inline]
    pub(super) fn of(&self, v: u32) -> &[u32] {
        let [start, end] = self.span[v as usize];
        &self.items[start as usize..end as usize]
    }

    /// Gives a vertex other triangles.
    pub(super) fn put(&mut self, v: u32, triangles: impl Iterator<Item = u32>) {
        let start = self.items.len() as u32;
        self.items.extend(triangles);
        self.span[v as usize] = [start, self.items.len() as u32];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn a_vertex_that_gets_other_triangles_has_these_and_the_others_keep_theirs() {
        let triangles = [[0, 1, 2], [1, 3, 2], [3, 4, 2]];
        let mut stars = Run::default().execute(|ctx| Stars::new(6, &triangles, ctx)).unwrap();
        let all = |stars: &Stars| (0..6).map(|v| stars.of(v).to_vec()).collect::<Vec<_>>();
        let mut expected = vec![vec![0], vec![0, 1], vec![0, 1, 2], vec![1, 2], vec![2], vec![]];
        assert_eq!(all(&stars), expected);
        stars.put(3, [0, 2].into_iter());
        stars.put(2, std::iter::empty());
        (expected[3], expected[2]) = (vec![0, 2], Vec::new());
        assert_eq!(all(&stars), expected);
    }
}
