//! The length that sizes are counted in.
//!
//! In: the points, where the charts put them. Out: the unit at each vertex of the surface.

use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;

/// The length that sizes are counted in: the spacing of the points, or their noise where that is longer.
pub(super) struct Units {
    of_chart: Vec<f64>,
    of_all: f64,
}

impl Units {
    /// The mean of the points of each chart.
    pub fn new(projected: &[ProjectedPoint], known: &KnownScan<'_>) -> Self {
        let (mut sums, mut all) = (vec![(0.0, 0.0); known.charts.len()], (0.0, 0.0));
        for (p, i) in projected.iter().zip(0..) {
            let unit = f64::from(known.spacing[i as usize]).max(known.noise_at(i));
            for sum in sums.get_mut(p.chart as usize).into_iter().chain([&mut all]) {
                sum.0 += unit;
                sum.1 += 1.0;
            }
        }
        let mean = |(sum, count): (f64, f64)| sum / f64::max(count, 1.0);
        Self { of_chart: sums.into_iter().map(mean).collect(), of_all: mean(all) }
    }
    /// The unit at a vertex.
    pub fn at(&self, s: &Surface, vertex: u32) -> f64 {
        let own = self.of_chart.get(s.chart[vertex as usize] as usize);
        own.copied().filter(|&unit| unit > 0.0).unwrap_or(self.of_all)
    }
}
