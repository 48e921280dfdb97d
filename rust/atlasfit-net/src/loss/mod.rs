//! What the network priors minimise (paper, equation 2): Chamfer distance to the scan plus the weighted stretch of the charts.
//!
//! In: samples of the charts, f32 in the normalised frame. Out: the value, and the gradient added to the caller's buffer.

pub mod chamfer;
pub mod stretch;

pub use chamfer::Chamfer;
pub use stretch::stretch;

/// A sample of a chart, or its gradient, in the normalised frame.
pub type Sample = [f32; 3];
