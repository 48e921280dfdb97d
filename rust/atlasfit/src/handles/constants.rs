//! The numbers of cutting handles: one place, each with its unit and where it is from.

/// The numbers, see [`HANDLES`].
pub(crate) struct HandleConstants {
    /// Radii of the pieces that are looked at, in spacings of the points or standard deviations of their
    /// noise, whichever is longer. Source: chosen: a wider handle has points of its own all about it.
    pub radii: [f64; 4],
    /// Radius of the cells that tell where to look, in the same. Source: chosen: a cell and those beside it
    /// hold the widest piece about any of its vertices, but for their corners.
    pub cell: f64,
    /// Distance between places of a cell that are looked at, in the same. Source: chosen.
    pub apart: f64,
    /// Places of a piece that loops are looked for at, at most. Source: chosen: loops that lie between them
    /// are found too.
    pub bases: usize,
    /// Numbers that a tube is worth. Source: derived: its place, its direction and its radius.
    pub of_tube: f64,
    /// How far from a loop points see a cut, in the same unit as the radii. Source: chosen: smoothing reaches
    /// one ring of triangles about it.
    pub seen: f64,
    /// Steps in which the ends of a cut are drawn in, each half of the way to the neighbours. Source: chosen.
    pub steps: usize,
    /// Rings of triangles about what is looked at that are taken along. Source: chosen, so that few loops
    /// come to their end.
    pub rings: usize,
    /// Times that the surface is looked through: of pieces that overlap one is cut at a time. Source: chosen.
    pub rounds: usize,
}

/// Their values.
pub(crate) const HANDLES: HandleConstants = HandleConstants {
    radii: [1.5, 2.0, 3.0, 4.5],
    cell: 2.0,
    apart: 1.0,
    bases: 32,
    of_tube: 6.0,
    seen: 2.0,
    steps: 3,
    rings: 4,
    rounds: 6,
};
