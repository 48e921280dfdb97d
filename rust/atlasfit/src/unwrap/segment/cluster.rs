//! A cluster of faces, and what joining two of them costs.

use crate::numeric::vec3::Vec3;

/// Weight of compactness against flatness: a normal turn of about 0.3 rad weighs as much as shape. Source not
/// recorded; judge it by `atlasfit bench unwrap`.
const COMPACT: f64 = 0.01;
/// A patch's normals must stay within this angle of its mean, so that projection to a plane cannot flip: cos
/// 70°.
pub(super) const CONE_COS: f64 = 0.342;

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
    if cone(a, b, sum.normalized()) > CONE_COS.acos() {
        return None;
    }
    Some((gain.max(0.0) + COMPACT * area) / (shared.max(1e-12) * area.max(1e-300).sqrt()))
}
