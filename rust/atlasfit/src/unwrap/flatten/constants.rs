//! The numbers of flattening: one place, each with its unit and where it is from.
//!
//! "Chosen" stands where no derivation is on record; `tests/constants.py NAME` shows what halving and
//! doubling a number does.
//!
//! After "halved" and "doubled" stand ratios of figures to those of the unchanged program: number of UV
//! charts (charts), length of seams (seam), stretch at the 95th percentile (stretch), share of the pages that
//! is covered (coverage), processor time (time, where it changes by a quarter); the geometric mean of nine
//! meshes, in brackets the one that changes most. Measured by `tests/constants.py unwrap/`.

/// The numbers, see [`FLATTEN`].
pub(crate) struct FlattenConstants {
    /// Cotangent weights are kept above this, so that needles do not vanish. Source: chosen.
    pub least_cot: f64,
    /// And below this, so that they do not rule. Source: chosen.
    pub most_cot: f64,
    /// Charts with more vertices are solved iteratively: exact solves would cost n^1.5. Source: chosen, for
    /// speed.
    pub direct: usize,
    /// Conjugate gradient steps per iteration of the iterative solver. Source: chosen.
    pub gradient_steps: usize,
    /// What holds a pinned vertex where it is, as a weight on the diagonal; weights of edges are about 1.
    /// Source: chosen.
    pub pin: f64,
    /// The same for any other: just enough to fix the free translation. Source: chosen.
    pub hold: f64,
    /// Steps of least symmetric Dirichlet energy at most. Source: chosen.
    pub steps: usize,
    /// Steps end when one lowers the energy by less than this share. Source: chosen.
    pub converged: f64,
    /// Rounds in which what is beyond the stretch bound counts more. Source: chosen.
    pub reweights: usize,
    /// How many times as much it counts from round to round. Above 1. Source: chosen.
    pub more: f64,
    /// Steps in each of these rounds. Source: chosen.
    pub more_steps: usize,
    /// Weights, against those at rest, are at most this: triangles near collapse must not freeze the rest.
    /// Source: chosen.
    pub stiffest: f64,
    /// Share of the step to the first collapse that may be taken. In (0, 1). Source: chosen.
    pub short_of: f64,
    /// A step is halved at most this many times until it lowers the energy. Source: chosen.
    pub halvings: usize,
    /// What holds the border of the convex start, as a weight on the diagonal. Source: chosen.
    pub held: f64,
    /// The same for all vertices of a step, against drifting. Source: chosen.
    pub drift: f64,
    /// What positions of one ring of vertices are multiplied by for the next one inward, where vertices are
    /// only to be put in order. In (0, 1). Source: chosen, for speed.
    pub inward: f64,
    /// Sets of at most this many vertices are not dissected further. Source: chosen, for speed.
    pub leaf: usize,
    /// Neighbours beyond a cut that make a vertex a hub. Source: derived, about twice those of a vertex of an
    /// even mesh.
    pub hub: usize,
    /// Vertices of more neighbours than this are not crossed where the graph is followed from end to end:
    /// across a hub, everything is near. Source: chosen, for speed.
    pub most_crossed: usize,
    /// A separator of more than this times the square root of what it parts is one that the coordinates give
    /// badly: that of an even sheet has one to two times as many. Source: chosen, for speed.
    pub wide: f64,
    /// A separator is left as it is unless hubs make it smaller by more than this many vertices, and to less
    /// than half: the cuts of even meshes have no hubs worth it. Source: chosen, for speed.
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
    inward: 0.95,
    leaf: 24,
    hub: 12,
    most_crossed: 48,
    wide: 4.0,
    least_saved: 16,
};
