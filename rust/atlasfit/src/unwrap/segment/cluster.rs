//! A cluster of faces, and what joining two of them costs.

use super::constants::SEGMENT;
use crate::numeric::vec3::Vec3;

/// A connected set of faces.
pub(super) struct Cluster {
    /// Its area; the surface has area 1.
    pub area: f64,
    /// Sum of its faces' normals, each times its area.
    pub sum: Vec3,
    /// Cone round the normals: axis is `sum` normalised, half angle in radians.
    pub angle: f64,
    /// How often it has grown.
    pub stamp: u32,
    /// Neighbouring clusters and the length shared with each.
    pub near: Vec<(u32, f64)>,
}

impl Cluster {
    /// One without neighbours.
    pub(super) fn new(area: f64, sum: Vec3, angle: f64) -> Self {
        Self { area, sum, angle, stamp: 0, near: Vec::new() }
    }

    /// The same without its neighbours.
    pub(super) fn bare(&self) -> Self {
        Self::new(self.area, self.sum, self.angle)
    }

    /// Both clusters as one, without neighbours.
    pub(super) fn with(&self, other: &Self) -> Self {
        let sum = self.sum + other.sum;
        Self::new(self.area + other.area, sum, cone(self, other, sum.normalized()))
    }
}

/// Half angle of the cone about an axis that holds the normals of two clusters, in radians.
fn cone(a: &Cluster, b: &Cluster, axis: Vec3) -> f64 {
    [a, b].iter().map(|c| c.sum.normalized().dot(axis).clamp(-1.0, 1.0).acos() + c.angle).fold(0.0, f64::max)
}

/// Cost of joining two clusters that share a border of length `shared`; `None` where 1 - |mean normal| of the
/// result would be more than `flatness`, or its normals would not fit the cone.
pub(super) fn cost(a: &Cluster, b: &Cluster, shared: f64, flatness: f64) -> Option<f64> {
    let area = a.area + b.area;
    let sum = a.sum + b.sum;
    let error = area - sum.norm();
    if error > flatness * area {
        return None;
    }
    let gain = error - (a.area - a.sum.norm()) - (b.area - b.sum.norm());
    if cone(a, b, sum.normalized()) > SEGMENT.cone_cos.acos() {
        return None;
    }
    Some((gain.max(0.0) + SEGMENT.compact * area) / (shared.max(1e-12) * area.max(1e-300).sqrt()))
}
