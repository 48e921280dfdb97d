//! What a chart says of a place: seen from a point in space near it, and at a point of its own.

use crate::numeric::vec3::Vec3;

/// A chart seen from a point in space near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Signed distance, positive on the side of the normal (to first order).
    pub distance: f64,
    /// How far the data say that there is surface: 0 to 1, one half at an edge.
    pub mask: f64,
    /// Partition-of-unity weight before it is normed: 1 at the chart's centre, falling smoothly to 0 at its
    /// rim.
    pub weight: f64,
    /// Unit normal of the chart, not yet in the atlas's orientation.
    pub normal: Vec3,
    /// Radius of a tube there; infinite for a patch.
    pub radius: f64,
}

/// A point of a chart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Position.
    pub position: Vec3,
    /// Unit normal of the chart, not yet in the atlas's orientation.
    pub normal: Vec3,
    /// Partition-of-unity weight before it is normed, in [0, 1].
    pub weight: f64,
    /// Domain coordinates.
    pub uv: [f64; 2],
}
