//! Face adjacency: the neighbours of each triangle across its edges.
//!
//! In: triangles. Out: for each up to three neighbours, and whether they face the other way. Only edges of
//! two triangles join; a missing neighbour is a boundary.

use crate::error::Result;
use crate::run::Context;
use crate::spatial::edges::Edges;

/// The neighbours of a triangle across its edges.
#[derive(Clone, Copy, Default)]
pub(super) struct FaceAdjacency {
    count: u8,
    triangle: [u32; 3],
    opposed: [bool; 3],
    /// Whether the edge from each corner to the next has a second triangle.
    joined: [bool; 3],
}

impl FaceAdjacency {
    /// Each neighbour, and whether it faces the other way.
    pub(super) fn neighbours(&self) -> impl Iterator<Item = (u32, bool)> {
        self.triangle.into_iter().zip(self.opposed).take(usize::from(self.count))
    }
    /// Whether some edge of the triangle has no second triangle.
    pub(super) fn at_boundary(&self) -> bool {
        self.count < 3
    }
    /// The corners from which an edge without a second triangle runs to the next.
    pub(super) fn boundary(&self) -> impl Iterator<Item = usize> {
        (0..3).filter(|&k| !self.joined[k])
    }
}

/// Which way a triangle must be turned so that its part is consistent.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Turn {
    Unknown,
    AsIs,
    Flipped,
}

impl Turn {
    pub(super) fn opposite(self) -> Self {
        match self {
            Self::Unknown => Self::Unknown,
            Self::AsIs => Self::Flipped,
            Self::Flipped => Self::AsIs,
        }
    }
    /// -1 where the triangle must be turned.
    pub(super) fn sign(self) -> f64 {
        if self == Self::Flipped { -1.0 } else { 1.0 }
    }
}

/// The neighbours of every triangle.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn of(triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Vec<FaceAdjacency>> {
    let mut out = vec![FaceAdjacency::default(); triangles.len()];
    for (i, edge) in Edges::new(triangles, ctx)?.iter().enumerate() {
        ctx.check_at(i)?;
        if let &[x, y] = edge {
            let opposite = x.runs_as(y, triangles);
            for (a, b) in [(x, y), (y, x)] {
                let FaceAdjacency { count, triangle, opposed, joined } = &mut out[a.face()];
                triangle[usize::from(*count)] = b.face() as u32;
                opposed[usize::from(*count)] = opposite;
                joined[a.side()] = true;
                *count += 1;
            }
        }
    }
    Ok(out)
}
