//! A chart with the points that it was fitted to.

use super::Chart;

/// A chart and the points it was fitted to.
pub struct FittedChart {
    /// The chart.
    pub chart: Chart,
    /// Points that the chart explains: index, and the robust weight they had.
    pub members: Vec<(u32, f32)>,
}
