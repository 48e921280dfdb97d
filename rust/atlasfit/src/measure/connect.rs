//! Connectivity that measures and pictures share: welding, disjoint sets, edges with their faces.
//!
//! In: positions, triangles. Out: plain indices, the same for any thread count.

use crate::error::Result;
use crate::geometry::sort::sort;
use crate::geometry::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Disjoint sets. The root of a set is its smallest member, so that results do not depend on the order of unions.
#[derive(Debug, Clone)]
pub struct Sets(Vec<u32>);

impl Sets {
    /// n sets of one member each.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
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

/// Disjoint sets whose members are alike or opposite: each knows how it stands to its set's root, the smallest member.
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
    /// Makes one set of two members' sets, in which the two are opposite or alike; nothing where they are in one already.
    pub fn join(&mut self, a: u32, b: u32, opposite: bool) {
        let ((ra, oa), (rb, ob)) = (self.find(a), self.find(b));
        if ra != rb {
            self.0[ra.max(rb) as usize] = (ra.min(rb), oa ^ ob ^ opposite);
        }
    }
}

/// For each position the smallest index of those at the same place: equal after rounding to multiples of
/// `tolerance`, or exactly equal where that is 0. Positions that are not finite stay alone.
///
/// # Errors
/// Cancelled or out of time.
pub fn weld(positions: &[Vec3], tolerance: f64, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let key = |p: &Vec3| {
        // Adding 0 makes one zero of the two that f64 has.
        p.0.map(|x| if tolerance > 0.0 { (x / tolerance).round() + 0.0 } else { x + 0.0 }.to_bits())
    };
    ctx.check()?;
    let mut order: Vec<([u64; 3], u32)> = positions
        .iter()
        .enumerate()
        .filter(|(_, p)| p.iter().all(|x| x.is_finite()))
        .map(|(i, p)| (key(p), i as u32))
        .collect();
    sort(&mut order, ctx)?;
    let mut to: Vec<u32> = (0..positions.len() as u32).collect();
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        for (_, i) in same {
            to[*i as usize] = same[0].1;
        }
    }
    ctx.check()?;
    Ok(to)
}

/// Half-edges by edge. The half-edge from corner `k` of a face to its next corner is `3 * face + k`; the key of an edge
/// is its smaller vertex, shifted by 32 bits, and its larger.
#[derive(Debug, Clone)]
pub struct Edges(Vec<(u64, u32)>);

impl Edges {
    /// Sorts the half-edges of triangles by edge, then by face.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn new(triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Self> {
        let mut half: Vec<(u64, u32)> = triangles
            .par_iter()
            .enumerate()
            .flat_map_iter(|(f, t)| {
                (0..3).map(move |k| {
                    let (a, b) = (t[k], t[(k + 1) % 3]);
                    ((u64::from(a.min(b)) << 32) | u64::from(a.max(b)), (3 * f + k) as u32)
                })
            })
            .collect();
        sort(&mut half, ctx)?;
        Ok(Self(half))
    }
    /// The half-edges of each edge in turn, by ascending face.
    pub fn iter(&self) -> impl Iterator<Item = &[(u64, u32)]> {
        self.0.chunk_by(|a, b| a.0 == b.0)
    }
}
