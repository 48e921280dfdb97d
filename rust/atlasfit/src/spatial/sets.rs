//! Disjoint sets, plain and signed. The same for any order of unions.

use crate::error::Result;
use crate::run::Context;

/// Disjoint sets. The root of a set is its smallest member, so that results do not depend on the order of
/// unions.
///
/// ```
/// use atlasfit::spatial::sets::Sets;
/// let mut sets = Sets::new(4);
/// sets.join(3, 1);
/// assert_eq!((sets.find(3), sets.find(2), sets.count(0..4)), (1, 2, 3));
/// sets.reset(2);
/// assert_eq!(sets.count(0..2), 2);
/// ```
#[derive(Debug, Clone)]
pub struct Sets(Vec<u32>);

impl Sets {
    /// n sets of one member each.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }
    /// The vertices of each connected part of a mesh of `n` vertices in one set.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn of_triangles(n: usize, triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Self> {
        let mut sets = Self::new(n);
        for (i, &[a, b, c]) in triangles.iter().enumerate() {
            ctx.check_at(i)?;
            sets.join(a, b);
            sets.join(b, c);
        }
        Ok(sets)
    }
    /// Begins anew with n sets of one member each; keeps the memory.
    pub fn reset(&mut self, n: usize) {
        self.0.clear();
        self.0.extend(0..n as u32);
    }
    /// The root of a member's set.
    pub fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let up = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = up;
            i = up;
        }
        i
    }
    /// Makes one set of two members' sets.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
    /// Number of sets among the members that `of` names.
    pub fn count(&mut self, of: impl Iterator<Item = u32>) -> usize {
        let mut roots: Vec<u32> = of.map(|i| self.find(i)).collect();
        roots.sort_unstable();
        roots.dedup();
        roots.len()
    }
}

/// Disjoint sets whose members are alike or opposite: each knows how it stands to its set's root, the
/// smallest member.
///
/// ```
/// use atlasfit::spatial::sets::SignedSets;
/// let mut sets = SignedSets::new(3);
/// sets.join(0, 1, true);
/// sets.join(1, 2, true);
/// assert_eq!((sets.find(1), sets.find(2)), ((0, true), (0, false)));
/// ```
#[derive(Debug, Clone)]
pub struct SignedSets(Vec<(u32, bool)>);

impl SignedSets {
    /// n sets of one member each.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).map(|i| (i, false)).collect())
    }
    /// The root of a member's set, and whether the member is its opposite.
    pub fn find(&mut self, i: u32) -> (u32, bool) {
        let (mut root, mut opposite) = (i, false);
        while self.0[root as usize].0 != root {
            opposite ^= self.0[root as usize].1;
            root = self.0[root as usize].0;
        }
        // The way is shortened for the next search.
        let (mut at, mut rest) = (i, opposite);
        while at != root {
            let (up, step) = std::mem::replace(&mut self.0[at as usize], (root, rest));
            rest ^= step;
            at = up;
        }
        (root, opposite)
    }
    /// Makes one set of two members' sets, in which the two are opposite or alike; nothing where they are in
    /// one already.
    pub fn join(&mut self, a: u32, b: u32, opposite: bool) {
        let ((ra, oa), (rb, ob)) = (self.find(a), self.find(b));
        if ra != rb {
            self.0[ra.max(rb) as usize] = (ra.min(rb), oa ^ ob ^ opposite);
        }
    }
}
