//! The edges of a triangle mesh with the faces at each.

use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use rayon::prelude::*;

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
        let half_edges = |f: usize| {
            let t = triangles[f];
            (0..3).map(move |k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                HalfEdge((u64::from(a.min(b)) << 32) | u64::from(a.max(b)), (3 * f + k) as u32)
            })
        };
        let mut most = 0;
        for (f, t) in triangles.iter().enumerate() {
            ctx.check_at(f)?;
            most = t.iter().fold(most, |most, &v| most.max(v));
        }
        // Half-edges are dealt out to runs by their smaller vertex: a vertex has few, so that a run is short.
        // Vertices share a run where they are many more than the half-edges.
        let shift = (most as usize / (3 * triangles.len()).max(1)).checked_ilog2().map_or(0, |k| k + 1);
        let run = |h: &HalfEdge| (h.low() >> shift) as usize;
        let mut next = vec![0u32; (most >> shift) as usize + 2];
        for f in 0..triangles.len() {
            ctx.check_at(f)?;
            half_edges(f).for_each(|h| next[run(&h) + 1] += 1);
        }
        (1..next.len()).for_each(|k| next[k] += next[k - 1]);
        let mut half = ctx.filled(HalfEdge(0, 0), 3 * triangles.len())?;
        for f in 0..triangles.len() {
            ctx.check_at(f)?;
            for h in half_edges(f) {
                let at = &mut next[run(&h)];
                half[*at as usize] = h;
                *at += 1;
            }
        }
        // What was the start of each run is its end now.
        sort_runs(&mut half, 0, &next[..next.len() - 1], ctx)?;
        Ok(Self(half))
    }
    /// The half-edges of each edge in turn, by ascending face.
    pub fn iter(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.0.chunk_by(|a, b| a.0 == b.0)
    }
    /// What all threads find at the edges, in the order of the edges: `look` adds what it finds at the
    /// half-edges of one.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn gather<T: Copy + Send>(
        &self,
        look: impl Fn(&[HalfEdge], &mut Vec<T>) + Sync,
        ctx: &Context<'_>,
    ) -> Result<Vec<T>> {
        let mut shares = Vec::new();
        let mut rest = &self.0[..];
        while !rest.is_empty() {
            let mut end = SHARE.min(rest.len());
            while end < rest.len() && rest[end].0 == rest[end - 1].0 {
                end += 1;
            }
            let (share, more) = rest.split_at(end);
            shares.push(share);
            rest = more;
        }
        let found = shares.into_par_iter().map(|share| {
            ctx.check()?;
            let mut found = Vec::new();
            share.chunk_by(|a, b| a.0 == b.0).for_each(|edge| look(edge, &mut found));
            Ok(found)
        });
        Ok(found.collect::<Result<Vec<_>>>()?.concat())
    }
}

/// Half-edges that one thread sorts.
const SHARE: usize = 1 << 14;

/// Sorts each of some runs of half-edges, which end at `ends` less `start`.
fn sort_runs(half: &mut [HalfEdge], start: u32, ends: &[u32], ctx: &Context<'_>) -> Result<()> {
    if half.len() > SHARE && ends.len() > 1 {
        let (ends, more) = ends.split_at(ends.len() / 2);
        let middle = ends[ends.len() - 1];
        let (first, rest) = half.split_at_mut((middle - start) as usize);
        let (a, b) =
            rayon::join(|| sort_runs(first, start, ends, ctx), || sort_runs(rest, middle, more, ctx));
        return a.and(b);
    }
    let mut from = start;
    for &to in ends {
        let run = &mut half[(from - start) as usize..(to - start) as usize];
        if run.len() > SHARE {
            sort(run, ctx)?
        } else {
            run.sort_unstable()
        }
        from = to;
    }
    ctx.check()
}
