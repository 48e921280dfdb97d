//! The length that sizes are counted in.
//!
//! In: the points, where the charts put them. Out: the unit at each vertex of the surface.

use crate::atlas::projected::chart_means;
use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;

/// The length that sizes are counted in: the spacing of the points, or their noise where that is longer.
pub(super) struct Units {
    of_chart: Vec<Option<f64>>,
    of_all: f64,
}

impl Units {
    /// The mean of the points of each chart.
    pub fn new(projected: &[ProjectedPoint], known: &KnownScan<'_>) -> Self {
        let unit = |i: usize| f64::from(known.spacing[i]).max(known.noise_at(i as u32));
        let of_chart = chart_means(projected, known.charts.len(), unit);
        let of_all = (0..projected.len()).map(unit).sum::<f64>() / projected.len().max(1) as f64;
        Self { of_chart, of_all }
    }
    /// The unit at a vertex.
    pub fn at(&self, s: &Surface, vertex: u32) -> f64 {
        let own = self.of_chart.get(s.chart[vertex as usize] as usize);
        own.copied().flatten().filter(|&unit| unit > 0.0).unwrap_or(self.of_all)
    }
}
