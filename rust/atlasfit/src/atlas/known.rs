//! The scan as the charts know it, as data.

use super::Chart;
use crate::numeric::vec3::Vec3;

/// The scan as the charts know it. Lengths are in the frame of the surface.
pub(crate) struct KnownScan<'a> {
    /// Its points.
    pub(crate) points: &'a [Vec3],
    /// Their spacing.
    pub(crate) spacing: &'a [f32],
    /// Standard deviation of their noise, as usual. Above 0.
    pub(crate) noise: f64,
    /// The noise at each, as a multiple of the usual; empty where it is the same everywhere.
    pub(crate) relative_noise: &'a [f32],
    /// The charts.
    pub(crate) charts: &'a [Chart],
}

impl KnownScan<'_> {
    /// Standard deviation of a point's noise.
    pub(crate) fn noise_at(&self, point: u32) -> f64 {
        self.noise * relative_noise(self.relative_noise, point as usize)
    }
}

/// The noise at a point, as a multiple of the usual: one where all are `relative` alike.
pub(crate) fn relative_noise(relative: &[f32], point: usize) -> f64 {
    relative.get(point).map_or(1.0, |&r| f64::from(r))
}
