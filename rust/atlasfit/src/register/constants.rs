//! The numbers of registering sweeps: one place, each with its unit and where it is from.

/// The numbers, see [`REGISTER`].
pub(super) struct RegisterConstants {
    /// Sweeps with fewer points are left where they are. Source: derived, three for each number of a
    /// quadric.
    pub least_points: usize,
    /// The most sweeps. Source: derived, the equations of 100 are solved in less than the 100 ms in which a
    /// cancel must take effect.
    pub most_sweeps: usize,
    /// The most points that are looked at. Source: chosen, more make a sweep's place no surer than it need
    /// be.
    pub most_points: usize,
    /// Points that all sweeps have together to be matched, about. Source: derived, with ten sweeps a sweep's
    /// shift is known to noise / sqrt(400) in each direction.
    pub samples: usize,
    /// Points of a sweep to be matched, at the least. Source: derived, six numbers are looked for and known
    /// to a sixth of the noise.
    pub least_samples: usize,
    /// Share of the points at each end of an axis that do not count for the scan's size. Source: chosen, few
    /// enough that a scan loses nothing.
    pub beyond: f64,
    /// How far a point may be from the nearest of other sweeps to be seen on them, in sides of the scan.
    /// Source: chosen; corrections are small, larger ones are the work of a program that knows the scene.
    pub reach: f64,
    /// The same in spacings, where that is more. Source: chosen.
    pub reach_spacings: f64,
    /// Points of other sweeps that a quadric is laid through: the fewest that are flat by `flat` in the
    /// median, or the last. Source: chosen, three a number of the quadric, and a factor of two apart.
    pub surround: [usize; 3],
    /// They are looked for among so many times as many. Source: chosen, where two sweeps overlap every other
    /// point is of another one.
    pub look_through: usize,
    /// A place is beside neighbours, not among them, farther than this from their mean, in standard
    /// deviations of their spread. Source: chosen, of a disc's points the middle one is at 0, one on its rim
    /// at 2.
    pub within: f64,
    /// Standard deviation of what a quadric leaves over the width of its points, up to which they show a
    /// surface. Source: derived, its direction is then known to about flat / sqrt(points) < 0.1 radians.
    pub flat: f64,
    /// The normals of the others' surface and of that around the point have this cosine at the least. Source:
    /// chosen, 25 degrees: beyond an edge is another part of the surface.
    pub alike: f64,
    /// Degrees of freedom of the residuals' distribution (Student's t). Source: usual, Lange, Little and
    /// Taylor (1989).
    pub freedom: f64,
    /// Times that the number of neighbours is chosen, for sweeps as they are and as they were moved. Derived.
    pub passes: usize,
    /// Rounds of a pass at the most. Source: chosen; five are usual.
    pub rounds: usize,
    /// A pass is over when no sweep moves by more than this share of the residuals' size. Source: derived,
    /// that is what a sweep's place is known to.
    pub done: f64,
}

/// The numbers.
pub(super) const REGISTER: RegisterConstants = RegisterConstants {
    least_points: 18,
    most_sweeps: 100,
    most_points: 400_000,
    samples: 4_000,
    least_samples: 200,
    beyond: 1e-3,
    reach: 0.02,
    reach_spacings: 3.0,
    surround: [18, 36, 72],
    look_through: 3,
    within: 0.6,
    flat: 0.25,
    alike: 0.9,
    freedom: 4.0,
    passes: 2,
    rounds: 10,
    done: 0.05,
};
