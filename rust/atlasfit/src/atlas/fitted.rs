//! A chart with the points that it was fitted to.

use super::Chart;

/// A chart and the points it was fitted to.
pub struct FittedChart {
    /// The chart.
    pub chart: Chart,
    /// Points that the chart explains: index, and the robust weight they had.
    pub members: Vec<(u32, f32)>,
    /// The noise that was expected of them before the fit, standard deviation.
    pub expected: f64,
    /// Its smoothness, the natural logarithm of kappa (noise variance over prior variance); none where it has
    /// no such choice: a tube whose cross-section is a circle.
    pub log_kappa: Option<f64>,
    /// Whether it is one of two sheets that were told apart though they lie within each other's noise.
    pub of_two: bool,
}

#[cfg(test)]
impl FittedChart {
    /// A flat chart over the plane z = 0, of this radius and noise, that explains these points.
    pub(crate) fn flat(radius: f64, sigma: f64, points: std::ops::Range<u32>) -> Self {
        use super::mask::Mask;
        use super::{Map, Monge};
        use crate::numeric::vec3::Vec3;

        let map = Monge {
            center: Vec3::ZERO,
            axes: [Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.0, 0.0, 1.0])],
            radii: [radius; 2],
            coeffs: Box::new([0.0; crate::numeric::spline::COEFFS]),
            mask: Mask::full(),
        };
        let chart = Chart { map: Map::Monge(map), sigma, sign: 1.0, support: 1.0 };
        let members = points.map(|p| (p, 1.0)).collect();
        Self { chart, members, expected: sigma, log_kappa: None, of_two: false }
    }
}
