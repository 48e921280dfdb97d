//! The numbers of contouring the distance and cleaning the surface: one place, each with its unit and where
//! it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: root mean square
//! distances of points to truth (points), surface to truth (acc), truth to surface (com); the geometric mean
//! of its scans (six, and later four facades), in brackets the scan that changes most. Measured by
//! `tests/constants.py --count 3000 --no-uv`. The two sides of its plate are hard to tell apart at this size:
//! small changes decide. "box at 0.001" is one more scan: `--shapes box:0.001`.

/// The numbers, see [`CONTOUR`].
pub(crate) struct ContourConstants {
    /// An edge whose ends differ by more than this many voxels joins two different sheets: no surface passes
    /// between. At least 1. Source: derived, a distance changes by at most one along an edge; the rest is
    /// room for noise and the disagreement of charts.
    /// Halved: acc 1.26 (box 1.80), com 8.70 (box 152.80); doubled: acc 1.01 (plate 1.05).
    pub max_jump: f64,
    /// A crossing keeps this share of an edge away from its ends: where the surface passes through a corner
    /// of the grid the vertices of the voxels about it would meet there. In (0, 0.5). Source: chosen, small.
    /// Halved or doubled: no figure changes by 1 %.
    pub end_margin: f64,
    /// Squared voxels, added to a chart's squared distance where normals are blended: a tenth of a voxel, so
    /// that a chart that passes through the vertex has a finite weight. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub near2: f64,
    /// Share of an edge that a vertex at the boundary moves along it at the most: at its end it would meet
    /// its neighbour. In (0, 1). Source: chosen.
    /// Halved: acc 1.02 (mobius 1.10); doubled: no figure changes by 1 %.
    pub farthest: f64,
    /// Share of the way to its fan's centroid that a split vertex moves: visible to no one, but not equal. In
    /// (0, 1). Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub step_apart: f64,
    /// Places of a part that its winding is summed over, at the most. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub winding_places: usize,
    /// Standard deviation of how often an open part winds about itself. Source: derived, a hemisphere and a
    /// bowl do it a quarter of a time, outward and inward, and open parts are as often the one as the other.
    /// Halved or doubled: same bytes.
    pub winding_spread: f64,
    /// Triangles that viewers look at, at the most. Source: chosen, 60 MB.
    /// Halved or doubled: same bytes.
    pub seen_triangles: usize,
    /// Parts that are turned as viewers see them, each by itself, at the most; the others turn with all.
    /// Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub seen_parts: usize,
    /// Rounds of that, at the most. Source: chosen; it ends before.
    /// Halved or doubled: same bytes.
    pub seen_rounds: usize,
    /// Places along a part's boundary, at the most. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub rim_places: usize,
    /// Of those, so many are looked at first for one of another part. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub rim_near: usize,
    /// Nats for two parts to face alike where the boundary of one runs along the other all the way, or away
    /// from each other where all of one lies before the other. Source: chosen, as many as for a closed body
    /// to face outward.
    /// Halved or doubled: same bytes.
    pub goes_on: f64,
    /// Nats for a flat open part to face upward. Source: chosen, as many as a hemisphere says by its winding.
    /// Halved or doubled: same bytes.
    pub upward: f64,
    /// Nats for a part to face as the scan says. Source: chosen, beyond all else.
    /// Halved or doubled: same bytes.
    pub scan_knows: f64,
    /// A cut is at most this many times as long as the widest slit. Source: chosen.
    /// Halved or doubled: same bytes.
    pub cut: f64,
    /// A slit is nowhere wider than this many times the widest mean. Source: chosen.
    /// Halved or doubled: same bytes.
    pub across: f64,
    /// A slit's filling may have at most this share of the area of the surface around it: else the surface is
    /// a ribbon, and the filling its back. Source: chosen.
    /// Halved or doubled: same bytes.
    pub ribbon: f64,
    /// Blocks that one worker handles between two checks. Changes no result. Source: chosen.
    /// Halved or doubled: same bytes.
    pub chunk: usize,
    /// Rings of more edges are cut, or left open: a triangulation costs the cube of it. Source: chosen, for
    /// speed.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub max_edges: usize,
    /// Steps by which the vertices of triangles that meet are moved, at the most. Source: chosen.
    /// Halved: com 1.00 (spiral 0.96); doubled: same bytes.
    pub untangle: usize,
    /// After so many of them a ring of vertices more moves along. Source: chosen.
    /// Halved: com 1.00 (spiral 0.99); doubled: no figure changes by 1 %.
    pub widen: usize,
    /// Edges of a filling are halved where they are longer than this many of its boundary's. Source: derived:
    /// halves of longer ones are still not much shorter than those.
    /// Halved or doubled: same bytes.
    pub refined: f64,
    /// Rounds of halving, at the most: each halves the longest edge. Source: derived, the longest ring has
    /// `max_edges`.
    /// Halved or doubled: same bytes.
    pub refinements: usize,
    /// Passes of flipping after each. Source: chosen, for speed; flips are few after the first.
    /// Halved or doubled: same bytes.
    pub flips: usize,
    /// Fillings are smooth once what pulls at their vertices, squared, has fallen to this share. Source:
    /// chosen, far below any noise.
    /// Halved or doubled: same bytes.
    pub relaxed: f64,
    /// Or after so many steps. Source: derived, several times the diameter of the largest filling, in edges.
    /// Halved or doubled: same bytes.
    pub relaxations: usize,
    /// A cut leaves at least this many times its greatest length of boundary on either side: else it would
    /// cut a corner of the outline, not across a slit. At least 1. Source: chosen.
    /// Halved or doubled: same bytes.
    pub behind: f64,
    /// Double sweeps of the smoothing. Source: chosen.
    /// Halved: acc 1.01 (plate 1.05), com 0.98 (box 0.94); doubled: acc 0.98 (box 0.95), com 1.03 (plate
    /// 1.09).
    pub sweeps: usize,
    /// Steps of a double sweep, as shares of the way to the mean of a vertex's neighbours: in, and out again
    /// by most of it, so that tips keep most of their length. Source: after Taubin 1995; the values are
    /// chosen.
    /// Halved: acc 1.02 (plate 1.08), com 0.97 (box 0.92); doubled: acc 599.76 (mobius 20747.02), com 0.47
    /// (spiral 0.15).
    pub taubin: [f64; 2],
    /// A normal that is off its triangles by a smaller cosine (more than 60 degrees) is not the surface's.
    /// Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub astray: f64,
    /// Rings about free vertices that are smoothed too. Source: chosen.
    /// Doubled: com 1.01 (box 1.07).
    pub spread: usize,
    /// A vertex lies at most so many voxels beyond its own. Source: chosen: none beyond rounds the edges, all
    /// that planes ask for folds.
    /// Halved: no figure changes by 1 %; doubled: acc 1.00 (facade2 1.02).
    pub beyond: f64,
    /// How alike the normals of two charts of one side of a crease are: the cosine at which a chart of the
    /// other side loses all weight. Source: chosen, 37 degrees.
    /// Halved: acc 0.99 (box at 0.001 0.94), com 0.99 (box at 0.001 0.92); doubled: acc 1.02 (box at 0.001
    /// 1.18), com 1.03 (box at 0.001 1.28).
    pub one_side: f64,
    /// How strongly a vertex is drawn to the middle of where the surface crosses its voxel, as a share of the
    /// planes' pull: along the surface they do not decide. In (0, 1). Source: derived, as strongly as planes
    /// that are 28 degrees apart pull it to their line; in the middle it would be an eighth of a voxel off.
    /// Halved: acc 1.00 (spiral 1.02), facing 0.98 (plate 0.77); doubled: acc 1.00 (box at 0.001 1.03), com
    /// 1.01 (box at 0.001 1.05).
    pub undecided: f64,
    /// Neighbouring triangles whose normals' cosine is below this (65 degrees) make a spike at the scale of a
    /// voxel: no data carries it. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: acc 1.11 (spiral 1.39), com 1.09 (box 1.24).
    pub spike: f64,
    /// Triangles handled between two checks. Changes no result. Source: chosen.
    /// Halved or doubled: same bytes.
    pub check: usize,
    /// Blended mask, in [0, 1], at the end of the data: the surface stops there. Source: derived, the middle
    /// of the mask's slope.
    /// Halved: acc 1.18 (mobius 1.90), com 0.97 (mobius 0.88); doubled: acc 0.95 (spiral 0.87), com 2.39
    /// (spiral 13.73); mobius, box, plate fail.
    pub end_of_data: f32,
    /// Stands for the blended mask of a vertex whose voxel has data at a corner that is too far from the
    /// charts to be believed. What is filled in there says nothing, so it counts as beyond the end of the
    /// data. Below 0, where no mask is. Source: a mark, not a measure.
    /// Halved or doubled: same bytes.
    pub off_band: f32,
    /// A part that lies within so many spacings of a larger one all over may be a fragment of a sweep that
    /// does not fit. Source: derived, random points leave gaps about four spacings wide: sheets nearer than
    /// that are hard to tell.
    pub afloat: f64,
    /// And is one where it does not clearly carry more than this share of the points that the surface below
    /// it does, in proportion. In (0, 1). Source: derived, one of three sweeps to the other two.
    pub sparser: f64,
    /// Clearly is by so many standard deviations. Source: derived, by chance once in forty.
    pub chance: f64,
}

/// Their values.
pub(crate) const CONTOUR: ContourConstants = ContourConstants {
    max_jump: 1.9,
    end_margin: 0.01,
    near2: 0.01,
    farthest: 0.9,
    step_apart: 0.05,
    winding_places: 1024,
    winding_spread: 0.25,
    seen_triangles: 1 << 20,
    seen_parts: 32,
    seen_rounds: 4,
    rim_places: 256,
    rim_near: 16,
    goes_on: 8.0,
    upward: 4.0,
    scan_knows: 1e3,
    cut: 1.5,
    across: 4.0,
    ribbon: 0.2,
    chunk: 64,
    max_edges: 400,
    untangle: 24,
    widen: 8,
    refined: 1.5,
    refinements: 16,
    flips: 8,
    relaxed: 1e-12,
    relaxations: 1000,
    behind: 2.0,
    sweeps: 6,
    taubin: [0.5, -0.43],
    astray: 0.5,
    spread: 1,
    beyond: 0.5,
    one_side: 0.8,
    undecided: 0.06,
    spike: 0.42,
    check: 1 << 15,
    end_of_data: 0.5,
    off_band: -1.0,
    afloat: 4.0,
    sparser: 0.5,
    chance: 2.0,
};
