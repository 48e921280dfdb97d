//! The numbers of simplifying a mesh: one place, each with its unit and where it is from.

/// The numbers, see [`SIMPLIFY`].
pub(crate) struct SimplifyConstants {
    /// What the first edges may cost, in mean lengths of an edge; then twice as much, and so on. Source:
    /// chosen, a flat surface's rounding is far below, its detail above.
    pub first: f64,
    /// A cost is done with when a sweep takes less than this share of the triangles. In (0, 1). Source:
    /// chosen, a sweep that takes less costs more time than it saves.
    pub few: f64,
    /// How strongly a vertex is drawn to the middle of its edge, as a share of the planes' pull. In (0, 1).
    /// Source: chosen, small: it decides where the planes do not.
    pub middle: f64,
    /// Weight of the planes that stand on the boundary, as a share of those of the surface. Source: chosen:
    /// a boundary may move as far as the surface.
    pub rim: f64,
    /// Cosine between the normals of a triangle before and after a collapse, at the least. Source: chosen, 60
    /// degrees: two triangles that turn so far in turn do not fold.
    pub turn: f64,
    /// Least shape of a triangle that a collapse makes (1 for equal sides, 0 without area: Bhatia and
    /// Lawrence 1990), unless there was a worse one. Source: derived, between an isosceles triangle with 20
    /// degrees at its apex, 0.56, and one with two such angles, 0.40.
    pub shape: f64,
    /// Triangles about a vertex, at the most. Source: chosen, twice the regular six.
    pub valence: usize,
}

/// Their values.
pub(crate) const SIMPLIFY: SimplifyConstants =
    SimplifyConstants { first: 1e-3, few: 0.02, middle: 1e-3, rim: 1.0, turn: 0.5, shape: 0.5, valence: 12 };
