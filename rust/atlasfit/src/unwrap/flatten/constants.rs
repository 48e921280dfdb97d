//! The numbers of flattening: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`. The mesh homer
//! may have 30 charts at most: its stretch bound rises in steps until it has, and its figures jump with it.

/// The numbers, see [`FLATTEN`].
pub(crate) struct FlattenConstants {
    /// Cotangent weights are kept above this, so that needles do not vanish. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: charts 1.06 (homer 1.76), seam 1.04 (homer 1.30), stretch
    /// 0.99 (homer 0.95), coverage 1.01 (homer 1.05).
    pub least_cot: f64,
    /// And below this, so that they do not rule. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub most_cot: f64,
    /// Charts with more vertices are solved iteratively: exact solves would cost n^1.5. Source: chosen, for
    /// speed.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub direct: usize,
    /// Conjugate gradient steps per iteration of the iterative solver. Source: chosen.
    /// Halved or doubled: same bytes.
    pub gradient_steps: usize,
    /// What holds a pinned vertex where it is, as a weight on the diagonal; weights of edges are about 1.
    /// Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub pin: f64,
    /// The same for any other: just enough to fix the free translation. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub hold: f64,
    /// Share of the stretch that a bound allows which costs nothing in as-rigid-as-possible steps that know
    /// it. In (0, 1). Source: measured, `unwrap --json` of 16 meshes, without momentum: 0.4, 0.5, 0.7, 1 give
    /// 0.98, 0.96, 0.98, 1.03 of the seam that 0 gives.
    pub free: f64,
    /// Steps of least symmetric Dirichlet energy at most. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub steps: usize,
    /// Steps end when one lowers the energy by less than this share. Source: chosen.
    /// Halved: coverage 0.98 (elephant 0.84); doubled: charts 0.98 (elephant 0.86), seam 0.99 (elephant
    /// 0.93), coverage 0.99 (elephant 0.90).
    pub converged: f64,
    /// Rounds in which what is beyond the stretch bound counts more. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: same bytes.
    pub reweights: usize,
    /// How many times as much it counts from round to round. Above 1. Source: chosen.
    /// Halved: no figure changes by 1 %; doubled: seam 0.99 (elephant 0.94).
    pub more: f64,
    /// Steps in each of these rounds. Source: chosen.
    /// Halved or doubled: same bytes.
    pub more_steps: usize,
    /// Weights, against those at rest, are at most this: triangles near collapse must not freeze the rest.
    /// Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub stiffest: f64,
    /// Share of the step to the first collapse that may be taken. In (0, 1). Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub short_of: f64,
    /// A step is halved at most this many times until it lowers the energy. Source: chosen.
    /// Halved or doubled: same bytes.
    pub halvings: usize,
    /// What holds the border of the convex start, as a weight on the diagonal. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub held: f64,
    /// The same for all vertices of a step, against drifting. Source: chosen.
    /// Halved or doubled: no figure changes by 1 %.
    pub drift: f64,
    /// Border vertices and edges nearer to each other than this are pushed apart; the surface has area 1.
    /// Source: chosen, about ten texels of a page of 1024.
    pub reach: f64,
    /// How much that counts, in mean energy. Source: derived: against a stress of a tenth, two sides stay a
    /// tenth of the reach apart.
    pub barrier: f64,
    /// Share of a distance that must be left after a step. In (0, 1). Source: chosen.
    pub nearer: f64,
    /// What holds all vertices in a Newton step, in mean energy per squared length: against drifting, where
    /// contacts are a million times as stiff. Source: chosen.
    pub steady: f64,
    /// What holds a vertex that must not move in such a step, in the same unit. Source: derived, a thousand
    /// times as stiff as the stiffest contact.
    pub fixed: f64,
    /// Share of a block's diagonal that is added before it is inverted. Source: derived, far above what
    /// rounding leaves of a block that others are subtracted from, far below what matters to a step.
    pub pivot: f64,
    /// How many times more where no step lowers the energy ...
    pub stiffer: f64,
    /// ... until it is this share. Source of both: chosen.
    pub most_pivot: f64,
    /// What positions of one ring of vertices are multiplied by for the next one inward, where vertices are
    /// only to be put in order. In (0, 1). Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub inward: f64,
    /// Sets of at most this many vertices are not dissected further. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub leaf: usize,
    /// Neighbours beyond a cut that make a vertex a hub. Source: derived, about twice those of a vertex of an
    /// even mesh.
    pub hub: usize,
    /// Vertices of more neighbours than this are not crossed where the graph is followed from end to end:
    /// across a hub, everything is near. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub most_crossed: usize,
    /// A separator of more than this times the square root of what it parts is one that the coordinates give
    /// badly: that of an even sheet has one to two times as many. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub wide: f64,
    /// A separator is left as it is unless hubs make it smaller by more than this many vertices, and to less
    /// than half: the cuts of even meshes have no hubs worth it. Source: chosen, for speed.
    /// Halved or doubled: same bytes.
    pub least_saved: usize,
}

/// Their values.
pub(crate) const FLATTEN: FlattenConstants = FlattenConstants {
    least_cot: 0.02,
    most_cot: 20.0,
    direct: 12_000,
    gradient_steps: 12,
    pin: 1e6,
    hold: 1e-9,
    free: 0.5,
    steps: 40,
    converged: 1e-3,
    reweights: 3,
    more: 2.0,
    more_steps: 10,
    stiffest: 1e4,
    short_of: 0.8,
    halvings: 12,
    held: 1e8,
    drift: 1e-9,
    reach: 1e-2,
    barrier: 2e-5,
    nearer: 0.2,
    steady: 1e-6,
    fixed: 1e9,
    pivot: 1e-12,
    stiffer: 1e4,
    most_pivot: 1e-4,
    inward: 0.95,
    leaf: 24,
    hub: 12,
    most_crossed: 48,
    wide: 4.0,
    least_saved: 16,
};
