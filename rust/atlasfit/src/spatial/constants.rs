//! The numbers of nearest neighbours, boxes and the point spacing: one place, each with its unit and where it
//! is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`SPATIAL`].
pub(crate) struct SpatialConstants {
    /// Primitives per leaf of a tree of boxes: few enough that a leaf is cheap, many enough that boxes do not
    /// dominate the memory. Changes no result. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub leaf: usize,
    /// Subtrees of fewer primitives are built on one thread: starting a task costs more. Changes no result.
    /// Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub parallel: usize,
    /// Points of one search tree: built in a few milliseconds, so that a cancel need not wait, and on all
    /// threads. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub block: usize,
    /// Points that a split is chosen from. Source: derived, the rank of their median has a standard deviation
    /// of 0.5 / sqrt(511) = 2 %.
    /// Halved or doubled: same bytes.
    pub sample: usize,
    /// Points lonelier than so many times the spacing where a scan is sparse are strays, unless they lie on a
    /// plane with those about them. The points of a tile
    /// carry the surface no farther than if their spacing were this many times the median: they must agree
    /// with those of the tiles about it, and the voxels needed to bridge gaps grow with the square where all
    /// are of one size. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub widest: f64,
    /// Scanners sample in lines: within a line the nearest points are close, the next line is far. So many
    /// neighbours see both. Source: chosen.
    /// Halved: points 0.99 (plate 0.91), com 1.20 (spiral 3.23); doubled: points 1.02 (spiral 1.15), acc 1.09
    /// (spiral 1.90), com 0.98 (plate 0.92).
    pub wide_k: usize,
    /// Share of their estimate that is taken: on an even sampling it is the smaller one then. In (0, 1).
    /// Source: chosen.
    /// Halved: com 1.21 (spiral 3.23); doubled: points 0.95 (plate 0.52), acc 1.41 (spiral 2.47), com 1.98
    /// (spiral 13.57).
    pub wide_share: f64,
    /// Points nearer to each other than this share of the distance to the next one are copies of one place: a
    /// scan that was stored twice, corners of triangles that were rounded apart. Source: derived, a fiftieth
    /// of the least noise that charts are fitted with, so what their joining moves is not known anyway. On a
    /// surface sampled at random, of successive distances d, D from a point (d/D)^2 is uniform for the
    /// nearest two: one point in a million has such a neighbour by chance.
    pub copy: f64,
    /// Where many points have others so much nearer than the next, those are copies up to this share. Source:
    /// derived, joined points lie a tenth of the spacing apart at most; apart farther, patches are grown to
    /// check the noise (`noise/check.rs`), which copies hide.
    pub apart: f64,
    /// Share of them that may be near by chance. In (0, 1). Source: chosen, a point in a hundred that is
    /// joined in error is not missed.
    pub chance: f64,
}

/// Their values.
pub(crate) const SPATIAL: SpatialConstants = SpatialConstants {
    leaf: 4,
    parallel: 4096,
    block: 1 << 15,
    sample: 511,
    widest: 6.0,
    wide_k: 32,
    wide_share: 0.85,
    copy: 1e-3,
    apart: 0.1,
    chance: 0.01,
};
