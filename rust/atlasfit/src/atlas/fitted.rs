//! A chart with the points that it was fitted to.

use super::Chart;

/// How smooth a chart is believed to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothness {
    /// The natural logarithm of kappa, noise variance over prior variance.
    pub log_kappa: f64,
    /// Precision of its bends, as a share of what the prior's spectrum gives them. In (0, 1]; 1 for a tube.
    pub bends: f64,
}

impl Smoothness {
    /// Of a tube.
    #[must_use]
    pub fn of_tube(log_kappa: f64) -> Self {
        Self { log_kappa, bends: 1.0 }
    }
}

/// A chart and the points it was fitted to.
pub struct FittedChart {
    /// The chart.
    pub chart: Chart,
    /// Points that the chart explains: index, and the robust weight they had.
    pub members: Vec<(u32, f32)>,
    /// The noise that was expected of them before the fit, standard deviation.
    pub expected: f64,
    /// None where it has no such choice: a tube whose cross-section is a circle.
    pub smoothness: Option<Smoothness>,
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
        Self { chart, members, expected: sigma, smoothness: None, of_two: false }
    }
}
