//! The numbers of simplifying a mesh: one place, each with its unit and where it is from.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide.

/// The numbers, see [`SIMPLIFY`].
pub(crate) struct SimplifyConstants {
    /// Side of the blocks, in mean lengths of an edge. Source: chosen; a block's arrays fit a core's cache,
    /// and one vertex in ten is on a seam.
    /// Halved or doubled: no figure changes by 1 %.
    pub block: f64,
    /// The least that the first edges may cost, as a share of the greatest error. Source: chosen: some twenty
    /// doublings then reach that.
    /// Halved or doubled: same bytes.
    pub least: f64,
    /// A cost is done with when a sweep takes less than this share of the triangles. In (0, 1). Source:
    /// chosen, a sweep that takes less costs more time than it saves.
    /// Halved or doubled: no figure changes by 1 %.
    pub few: f64,
    /// Sweeps at one cost, at the most. Source: chosen.
    /// Halved: acc 0.97 (ring 0.90), com 0.98 (ring 0.91); doubled: no figure changes by 1 %.
    pub sweeps: usize,
    /// So many edges, counted by one for each triangle, are cheap enough for each one that is to go in the
    /// first round where a number of triangles is asked for. Source: chosen, it decides on the first round
    /// only: the dragon of tests/peers/simplify got 126,000 of 200,000 triangles where 100,000 were wanted.
    pub edges: f64,
    /// How many times fewer triangles a round leaves there, at the most, and edges cost as many times more.
    /// Above 1. Source: chosen, for meshes of which one triangle in 16 or fewer is to stay. Below, a round
    /// does the root of what is left: measured (tests/peers/simplify, six meshes), 0.94 times the error of 14
    /// even rounds, where its power of 0.65 has 1.00 times.
    pub step: f64,
    /// The same at the least, unless fewer are left. Source: chosen, some rounds then end it.
    pub last_step: f64,
    /// A round has taken too few where it takes less than this share of the triangles that are to go. In
    /// (0, 1). Source: measured, tori with UVs of 7,200 to 20,000 squares to a tenth of their triangles: a
    /// twentieth of all triangles instead gave 1.02 times the error, 1.14 on one, since shaping may spend
    /// what a round may; 0.05 gives the same.
    pub stuck: f64,
    /// How much more edges may cost when too few of them went. Above 1. Source: chosen.
    pub growth: f64,
    /// Blocks are worked on a third time where this share of the triangles went the second time, if edges
    /// have a greatest length. In (0, 1). Source: chosen, the seams are done then.
    /// Halved or doubled: no figure changes by 1 %.
    pub again: f64,
    /// Shares of the greatest length up to which edges are collapsed, in turn. The last: an edge that is
    /// longer is near enough to its length (Botsch and Kobbelt 2004).
    /// Halved: acc 0.98 (ring 0.95), com 0.98 (ring 0.95); doubled: no figure changes by 1 %.
    pub lengths: [f64; 3],
    /// Shares of the greatest error that edges may cost, in turn. Source: chosen.
    /// Halved or doubled: same bytes.
    pub errors: [f64; 6],
    /// How strongly a vertex is drawn to the middle of its edge, as a share of the planes' pull. In (0, 1).
    /// Source: chosen, small: it decides where the planes do not.
    /// Halved or doubled: no figure changes by 1 %.
    pub middle: f64,
    /// Weight of the planes that stand on the boundary, as a share of those of the surface. Source: chosen:
    /// a boundary may move as far as the surface.
    /// Halved or doubled: no figure changes by 1 %.
    pub rim: f64,
    /// Cosine between the normals of a triangle before and after a collapse, at the least. Source: chosen, 60
    /// degrees: two triangles that turn so far in turn do not fold.
    /// Halved: no figure changes by 1 %; doubled: acc 0.96 (ring 0.85), com 0.97 (ring 0.87).
    pub turn: f64,
    /// Least shape of a triangle that a collapse makes (1 for equal sides, 0 without area: Bhatia and
    /// Lawrence 1990), unless there was a worse one. Source: derived, between an isosceles triangle with 20
    /// degrees at its apex, 0.56, and one with two such angles, 0.40.
    /// Halved or doubled: no figure changes by 1 %.
    pub shape: f64,
    /// Where a triangle was worse, or nearly so, a collapse may make the worst one worse by this factor,
    /// which flips then mend. In (0, 1). Source: derived, on a grid of oblongs any collapse turns the
    /// diagonals.
    /// Halved or doubled: no figure changes by 1 %.
    pub worse: f64,
    /// Triangles about a vertex, at the most. Source: chosen, twice the regular six.
    /// Halved: acc 0.96 (ring 0.86), com 0.97 (ring 0.87); doubled: no figure changes by 1 %.
    pub valence: usize,
    /// A vertex of the first mesh that is nearer than this share of its error needs no nearer triangle. In
    /// (0, 1). Source: chosen: only time depends on it.
    /// Halved or doubled: no figure changes by 1 %.
    pub near: f64,
    /// Cosine between the normals of triangles that are smooth together: only there edges are flipped and
    /// vertices moved. Source: chosen, 25 degrees.
    /// Halved or doubled: no figure changes by 1 %.
    pub smooth: f64,
    /// The same for vertices of a triangle that is worse than `shape`. Source: chosen, 60 degrees as in
    /// `turn`; the distance to the first mesh holds creases.
    pub bent: f64,
    /// Middles of triangles that a mended needle leaves may be this share of the error from those that were
    /// there, where no point of the first mesh vouches for them. In (0, 1). Source: chosen; the way back to
    /// the first mesh stays within 1.5 errors in a test, with a half it does not.
    pub aside: f64,
    /// A place whose squared distance to a vertex is below this share of an edge's is at the vertex, which
    /// alone decides on the normal. Source: chosen.
    /// Halved or doubled: same bytes.
    pub at_vertex: f64,
    /// The worst triangle gets better at least this many times, or nothing is changed. Above 1. Source:
    /// chosen: what changes less is not worth its time.
    /// Halved or doubled: no figure changes by 1 %.
    pub better: f64,
    /// Times that triangles are shaped. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub shapings: usize,
    /// Vertices move where their worst triangle is below this shape. Source: derived, an isosceles triangle
    /// with 30 degrees at its apex has 0.75.
    /// Halved or doubled: no figure changes by 1 %.
    pub well: f64,
}

/// Their values.
pub(crate) const SIMPLIFY: SimplifyConstants = SimplifyConstants {
    block: 40.0,
    least: 1e-6,
    few: 0.05,
    sweeps: 3,
    edges: 4.0 / 3.0,
    step: 4.0,
    last_step: 1.1,
    stuck: 0.25,
    growth: 1.4,
    again: 0.5,
    lengths: [0.35, 0.55, 0.8],
    errors: [0.03, 0.06, 0.12, 0.25, 0.5, 1.0],
    middle: 1e-3,
    rim: 1.0,
    turn: 0.5,
    shape: 0.5,
    worse: 0.8,
    valence: 12,
    near: 0.3,
    smooth: 0.9,
    bent: 0.5,
    aside: 0.25,
    at_vertex: 1e-6,
    better: 1.02,
    shapings: 2,
    well: 0.75,
};
