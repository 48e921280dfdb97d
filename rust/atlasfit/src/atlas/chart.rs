//! One chart: a patch or a tube.

use super::view::{Foot, View};
use super::{Monge, Tube};
use crate::numeric::vec3::Vec3;

/// One chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// The map.
    pub map: Map,
    /// Noise of the points about this chart.
    pub sigma: f64,
    /// +1 or -1: which way the chart's normal points in the atlas's orientation.
    pub sign: f64,
    /// Number of points that it was fitted to, weighted by how much each one counted.
    pub support: f64,
}

/// A chart's map from its domain into space.
#[derive(Debug, Clone, PartialEq)]
pub enum Map {
    /// A height over an elliptic disk.
    Monge(Monge),
    /// A radius about an axis.
    Tube(Tube),
}

impl Chart {
    /// The chart seen from `p`; nothing beyond its domain.
    #[inline]
    #[must_use]
    pub fn view(&self, p: Vec3) -> Option<View> {
        match &self.map {
            Map::Monge(m) => m.view(p),
            Map::Tube(t) => t.view(p),
        }
    }
    /// The chart's point nearest to `p`, as far as `p` is near the chart.
    #[must_use]
    pub fn nearest(&self, p: Vec3) -> Foot {
        match &self.map {
            Map::Monge(m) => m.nearest(p),
            Map::Tube(t) => t.nearest(p),
        }
    }
    /// Weight in the blend at `p`.
    #[must_use]
    pub fn weight(&self, p: Vec3) -> f64 {
        match &self.map {
            Map::Monge(m) => m.weight(p),
            Map::Tube(t) => t.weight(p),
        }
    }
    /// Unit normal at the chart's point over `p`.
    #[must_use]
    pub fn normal_over(&self, p: Vec3) -> Vec3 {
        match &self.map {
            Map::Monge(m) => m.normal_over(p),
            Map::Tube(t) => t.normal_over(p),
        }
    }
    /// The chart's point at domain coordinates: (u, v) over the unit disk of a patch; along a tube, and the
    /// angle over pi.
    #[must_use]
    pub fn at(&self, uv: [f64; 2]) -> Foot {
        match &self.map {
            Map::Monge(m) => m.at(uv),
            Map::Tube(t) => t.at(uv),
        }
    }
    /// How far the data say that there is surface at domain coordinates: 0 to 1, one half at an edge, 0
    /// beyond the domain.
    #[must_use]
    pub fn mask_at(&self, uv: [f64; 2]) -> f64 {
        match &self.map {
            _ if self.reach(uv) > 1.0 + 1e-6 => 0.0, // may have been rounded to single precision
            Map::Monge(m) => m.mask.value(uv[0], uv[1]),
            Map::Tube(t) => t.mask_at(uv[0]),
        }
    }
    /// How far domain coordinates are from the domain's middle; 1 at its rim.
    #[must_use]
    pub fn reach(&self, uv: [f64; 2]) -> f64 {
        match &self.map {
            Map::Monge(_) => uv[0].hypot(uv[1]),
            Map::Tube(_) => uv[0].abs(),
        }
    }
    /// Domain coordinates moved to `t` times their reach.
    #[must_use]
    pub fn shrink(&self, uv: [f64; 2], t: f64) -> [f64; 2] {
        match &self.map {
            Map::Monge(_) => [uv[0] * t, uv[1] * t],
            Map::Tube(_) => [uv[0] * t, uv[1]],
        }
    }
}
