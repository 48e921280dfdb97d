//! The edges of a triangle mesh with the faces at each.

use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;

/// A half-edge by its edge: the edge's smaller vertex, shifted by 32 bits, and its larger; then `3 * face +
/// k` for the half-edge from corner `k` of a face to its next corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct HalfEdge(pub u64, pub u32);

impl HalfEdge {
    /// The smaller vertex of the edge.
    #[inline]
    #[must_use]
    pub fn low(self) -> u32 {
        (self.0 >> 32) as u32
    }
    /// The larger vertex of the edge.
    #[inline]
    #[must_use]
    pub fn high(self) -> u32 {
        self.0 as u32
    }
    /// The two vertices of the edge, the smaller first.
    #[inline]
    #[must_use]
    pub fn ends(self) -> [u32; 2] {
        [self.low(), self.high()]
    }
    /// The face that the half-edge belongs to.
    #[inline]
    #[must_use]
    pub fn face(self) -> usize {
        self.1 as usize / 3
    }
    /// Which of the face's corners it starts at.
    #[inline]
    #[must_use]
    pub fn side(self) -> usize {
        self.1 as usize % 3
    }
    /// The vertex that the half-edge starts at.
    #[inline]
    #[must_use]
    pub fn start(self, triangles: &[[u32; 3]]) -> u32 {
        triangles[self.face()][self.side()]
    }
    /// Whether two half-edges of one edge run along it in the same direction: their faces then face opposite
    /// ways.
    #[inline]
    #[must_use]
    pub fn runs_as(self, other: Self, triangles: &[[u32; 3]]) -> bool {
        self.start(triangles) == other.start(triangles)
    }
}

/// All half-edges of a mesh, by edge, then by face.
///
/// ```
/// use atlasfit::{Run, spatial::edges::Edges};
/// let triangles = [[0, 1, 2], [0, 2, 3]];
/// let edges = Run::default().execute(|ctx| Edges::new(&triangles, ctx))?;
/// assert_eq!(edges.iter().count(), 5);
/// let inner = edges.iter().find(|e| e.len() == 2).unwrap();
/// assert_eq!((inner[0].ends(), inner[0].face(), inner[1].face()), ([0, 2], 0, 1));
/// assert!((inner[0].start(&triangles), inner[1].start(&triangles)) == (2, 0));
/// assert!(!inner[0].runs_as(inner[1], &triangles));
/// # Ok::<(), atlasfit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Edges(Vec<HalfEdge>);

impl Edges {
    /// Sorts the half-edges of triangles by edge, then by face.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn new(triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Self> {
        let mut half = Vec::with_capacity(3 * triangles.len());
        for (f, t) in triangles.iter().enumerate() {
            ctx.check_at(f)?;
            half.extend((0..3).map(|k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                HalfEdge((u64::from(a.min(b)) << 32) | u64::from(a.max(b)), (3 * f + k) as u32)
            }));
        }
        sort(&mut half, ctx)?;
        Ok(Self(half))
    }
    /// The half-edges of each edge in turn, by ascending face.
    pub fn iter(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.0.chunk_by(|a, b| a.0 == b.0)
    }
}
