//! What the explicit networks minimise: Chamfer distance to the scan plus the weighted stretch of the charts.
//!
//! In: samples of the charts, f32 in the normalised frame. Out: the value, and the gradient added to the
//! caller's buffer.
//! Source: *Deep Manifold Prior*, equation 4: Chamfer distance (section 3, "Loss function", not numbered)
//! plus lambda times the stretch of equation 3.

mod chamfer;
mod stretch;

pub use crate::sample::Sample;
pub use chamfer::Chamfer;
pub use stretch::stretch;
