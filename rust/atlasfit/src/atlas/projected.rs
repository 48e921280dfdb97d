//! A point of a scan on the atlas.

use crate::numeric::vec3::Vec3;

/// A point on the atlas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectedPoint {
    /// Position on the blended surface.
    pub position: Vec3,
    /// Unit normal in the atlas's orientation.
    pub normal: Vec3,
    /// The chart that weighs most; `u32::MAX` where no chart claims the point.
    pub chart: u32,
}
