//! The numbers of rims: one place, each with its unit and where it is from.

/// The numbers, see [`RIM`].
pub(crate) struct RimConstants {
    /// Distance of neighbouring nodes along the boundary, in spacings. Source: derived, half of what points
    /// can show.
    pub step: f64,
    /// Fewest nodes of a boundary. Source: chosen.
    pub least_nodes: usize,
    /// Times that the curve is smoothed by (1, 2, 1) / 4 before points are held against it. Source: derived,
    /// to a standard deviation of a spacing: the steps of voxels go.
    pub smoothings: usize,
    /// And which way is out, and how dense the points are. Source: chosen, two spacings.
    pub wide_smoothings: usize,
    /// And whether points thin out. Source: derived, four spacings: some twenty points say so.
    pub long_smoothings: usize,
    /// Points up to so far within and beyond the boundary say where it is, in spacings. Source: chosen, what
    /// the mask can be off by.
    pub band: f64,
    /// And so many standard deviations of the noise. Source: derived, 1 in 40 points lies beyond.
    pub band_sigmas: f64,
    /// Points farther off the surface than this, in spacings, are another sheet's. Source: chosen.
    pub off: f64,
    /// So are those whose normal has a smaller cosine with the curve's (60 degrees). Source: chosen.
    pub same_way: f64,
    /// Points at least so far within say how dense they are, in spacings: those nearer to the boundary lack
    /// neighbours. Source: derived, the eight nearest lie within 1.6 spacings.
    pub within: f64,
    /// Their neighbours are not farther than this, in spacings. Source: derived, twice as far.
    pub neighbours: f64,
    /// Nodes of a boundary that are repeated beyond its start and end, so that it is as one without them.
    /// Source: derived, several lengths over which the stiffest boundary is smooth.
    pub overlap: usize,
    /// Least standard deviation of points about where they end, in spacings. Source: chosen, what keeps the
    /// likelihood smooth; less than what rims are off by.
    pub sharpest: f64,
    /// Shares of the noise by which points may be off along the surface. Source: derived: all of it for
    /// noise in all directions, little for noise along the ray.
    pub shares: [f64; 3],
    /// How much stiffer than points are dense boundaries may be: fourth powers of the length, in spacings,
    /// over which they are smooth. Source: derived, from one to thirteen spacings.
    pub stiffness: [f64; 5],
    /// That of the first fit. Source: chosen, about the middle.
    pub first_stiffness: f64,
    /// Standard deviations by which the first fits take points to be off, in spacings: from afar all points
    /// have a say. Source: chosen.
    pub from_afar: [f64; 3],
    /// One over the variance of how far the mask is off, in spacings, for each spacing of boundary. Source:
    /// chosen, hardly anything.
    pub hold: f64,
    /// Points next to a boundary are not less dense than this share of those within. Source: chosen.
    pub least_density: f64,
    /// Where the points next to the boundary are at least the second of these shares as dense as within, the
    /// scan ends there, and nothing beyond it stays. Where they are no denser than the first, they thin out:
    /// the surface may go on. Source: chosen, what twenty points tell from 1 and from 0.
    pub thin: [f64; 2],
    /// How far, in spacings. Source: chosen, as far as the mask is off.
    pub slack: f64,
    /// Share of points that belong to nothing, of those within. Source: chosen.
    pub stray: f64,
    /// Steps of a fit, and of halving one. Source: chosen; a handful is usual.
    pub steps: usize,
    /// Nodes of a boundary that one thread looks at.
    pub nodes_at_once: usize,
    /// A fit ends where the logarithm of the likelihood gains less, in nats. Source: chosen.
    pub settled: f64,
    /// Most that the boundary moves, in spacings. Source: chosen, the mask's resolution.
    pub farthest: f64,
    /// One over the variance of how far it moves beyond that. Source: chosen, next to nothing.
    pub wall: f64,
    /// Vertices so near to the boundary go onto it, in spacings, so that no sliver is cut off. Source:
    /// chosen, a fifth of a voxel.
    pub on: f64,
    /// Rings of vertices that follow the boundary. Source: chosen: a vertex two spacings from a boundary
    /// that moves by one moves by a half.
    pub rings: usize,
    /// Sweeps by which they follow. Source: chosen, a few for each ring.
    pub sweeps: usize,
    /// A vertex that goes less than this share of its way stays where it is. Source: chosen.
    pub least_share: f64,
    /// Strips along a hole, from and to so far from it, in spacings or voxels: the points in the first are
    /// held against those in the second. Source: chosen; a turn away from the scanner shows over that length.
    pub strips: [[f64; 2]; 2],
    /// How far densities at the end of a surface and farther in differ otherwise, in natural logarithms.
    /// Source: chosen, what scans of open surfaces have.
    pub uneven: f64,
    /// Values of their ratio from 0 to 1 that are summed over. Changes no result where it is large.
    pub ratios: u32,
    /// Holes that nobody looked into are filled where their boundary is at most this many times as long as
    /// chance leaves open. Source: chosen; wider ones are the user's to fill.
    pub unseen: f64,
    /// Least mean cosine between the surface's normals along a hole and that of the plane across it: else the
    /// surface goes on elsewhere than across, as into a bore. Source: chosen, as on a sphere about a hole of
    /// 120 degrees.
    pub least_flatness: f64,
}

/// Their values.
pub(crate) const RIM: RimConstants = RimConstants {
    step: 0.5,
    least_nodes: 8,
    smoothings: 8,
    wide_smoothings: 32,
    long_smoothings: 128,
    band: 4.0,
    band_sigmas: 2.0,
    off: 1.0,
    same_way: 0.5,
    within: 1.6,
    neighbours: 3.2,
    overlap: 40,
    sharpest: 0.1,
    shares: [1.0, 0.5, 0.0],
    stiffness: [3.0, 30.0, 300.0, 3000.0, 30000.0],
    first_stiffness: 30.0,
    from_afar: [1.0, 0.5, 0.25],
    hold: 0.01,
    least_density: 0.1,
    thin: [0.4, 0.6],
    slack: 2.0,
    stray: 0.001,
    steps: 30,
    nodes_at_once: 256,
    settled: 1e-3,
    farthest: 2.0,
    wall: 1e3,
    on: 0.15,
    rings: 6,
    sweeps: 30,
    least_share: 0.1,
    strips: [[0.0, 2.0], [6.0, 12.0]],
    uneven: 0.2,
    ratios: 64,
    unseen: 4.0,
    least_flatness: 0.5,
};
