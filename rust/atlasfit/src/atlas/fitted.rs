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
