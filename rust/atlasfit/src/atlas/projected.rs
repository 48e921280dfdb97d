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

/// The mean of a value of each point over the points of each chart; none for a chart without points.
pub(crate) fn chart_means(
    projected: &[ProjectedPoint],
    charts: usize,
    value: impl Fn(usize) -> f64,
) -> Vec<Option<f64>> {
    let mut sums = vec![(0.0, 0.0); charts];
    for (i, p) in projected.iter().enumerate() {
        if let Some((sum, count)) = sums.get_mut(p.chart as usize) {
            *sum += value(i);
            *count += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect()
}
