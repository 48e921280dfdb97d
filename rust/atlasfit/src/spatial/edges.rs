//! The edges of a triangle mesh with the faces at each.

use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use rayon::prelude::*;

/// Half-edges by edge. The half-edge from corner `k` of a face to its next corner is `3 * face + k`; the key
/// of an edge is its smaller vertex, shifted by 32 bits, and its larger.
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
