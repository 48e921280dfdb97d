//! The numbers of cutting surfaces open: one place, each with its unit and where it is from.
//!
//! Source of all: chosen on eleven of the meshes of OptCuts, by hand, those of stand-ins on eight; what
//! halving and doubling does is not measured yet.

/// Mean symmetric Dirichlet energy of an isometry.
pub(super) const LEAST_ENERGY: f64 = 4.0;

/// Where cuts grow to.
#[derive(Clone, Copy)]
pub(super) struct Plan {
    /// Shortest length of a new cut; the surface has area 1.
    pub least: f64,
}

/// The numbers, see [`SEAMS`].
pub(super) struct SeamsConstants {
    /// Edges of the stand-in on which seams are looked for first are about as long as if it had so many faces
    /// of one size: it has a third of that.
    pub coarse: usize,
    /// Surfaces of more faces than this have one.
    pub much: usize,
    /// The stand-in is rougher than the full surface: so many times the energy above an isometry's there
    /// means the same here.
    pub slack: f64,
    /// Layouts that searches find, the shortest first, of which more is made: they are shortened, and those
    /// of a stand-in are taken to the full surface. All of them shortened give 0.995 of the seams in 1.3 of
    /// the time (`unwrap --max-energy 4.1` of 27 meshes of OptCuts).
    pub kept: usize,
    /// Times that more of the stand-in's cuts are closed after it was seen how much energy the full surface
    /// has with them.
    pub loosened: usize,
    /// Cuts whose energy above an isometry's is at least this share of what may be are not closed further on
    /// the stand-in. Below 1.
    pub used_up: f64,
    /// The energy that they may have on the stand-in grows by this factor at a time at most.
    pub most_looser: f64,
    /// How many times its length a cut through a polygon costs.
    pub within_polygon: f64,
    /// Cuts to far ends at most, before a first layout is good enough.
    pub first_cuts: usize,
    /// Mean energies of ones that are: searches start from both.
    pub first_energy: [f64; 2],
    /// Newton steps for the first positions at most.
    pub first_steps: usize,
    /// Faces about the end of a cut that give way when it is closed, at most ...
    pub near: usize,
    /// ... and so many more for each edge that is closed.
    pub near_edge: usize,
    /// How far these may move beyond where they lie, as a share of their box's diagonal.
    pub margin: f64,
    /// Their steps end where one lowers the mean energy by less than this.
    pub least_near: f64,
    /// Share of the energy that closing costs near the end which is left when all gives way: more than the
    /// bound with that, and it is not tried.
    pub left: f64,
    /// Newton steps after which a trial is judged.
    pub trial_steps: usize,
    /// Newton steps after a cut has grown at most.
    pub grown_steps: usize,
    /// Trials, the best first, that are made in earnest until one lowers the energy.
    pub best: usize,
    /// Newton steps after a change at most.
    pub steps: usize,
    /// Steps end where one lowers the mean energy by less than this.
    pub least: f64,
    /// How far the sides of a new cut are drawn apart, as a share of the shortest edge there ...
    pub parted: f64,
    /// ... and how often that is quartered where triangles turn over.
    pub partings: usize,
    /// Places that a cut may grow to are those of most energy times these powers of their distance from the
    /// border and other cuts ...
    pub powers: [f64; 3],
    /// ... of which so many each are tried at once.
    pub targets: usize,
    /// Shortest piece of a seam that is closed at once, as a share of the whole, at first.
    pub piece: f64,
    /// Loose ends whose closing is tried again, of those that were before.
    pub again: usize,
    /// Cuts that are added at most; a part that needs more is left to the merging of charts.
    pub most_cuts: usize,
    /// Share of the energy above an isometry's that a new cut must take away.
    pub gain: f64,
    /// Share by which a round must shorten the cuts to be followed by others.
    pub shorter: f64,
    /// Rounds that may fail to do so, one after the other.
    pub in_vain: usize,
    /// The same where the cuts come from a stand-in.
    pub in_vain_lifted: usize,
    /// Searches that are made from the second start (from the first, the first of them), and in turn tried
    /// for more cuts, after which others may be closed.
    pub plans: [Plan; 4],
}

/// Their values.
pub(super) const SEAMS: SeamsConstants = SeamsConstants {
    coarse: 7000,
    much: 3000,
    slack: 1.2,
    kept: 2,
    loosened: 2,
    used_up: 0.9,
    most_looser: 2.5,
    within_polygon: 1e3,
    first_cuts: 16,
    first_energy: [20.0, 5.0],
    first_steps: 60,
    near: 240,
    near_edge: 16,
    margin: 0.25,
    least_near: 1e-6,
    left: 0.4,
    trial_steps: 3,
    grown_steps: 10,
    best: 2,
    steps: 40,
    least: 1e-4,
    parted: 0.02,
    partings: 6,
    powers: [0.0, 1.0, 2.0],
    targets: 3,
    piece: 0.08,
    again: 4,
    most_cuts: 120,
    gain: 1e-3,
    shorter: 2e-3,
    in_vain: 4,
    in_vain_lifted: 1,
    plans: [Plan { least: 0.06 }, Plan { least: 0.15 }, Plan { least: 0.1 }, Plan { least: 0.03 }],
};
