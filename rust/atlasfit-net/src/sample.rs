//! A point of a chart as the networks see it.

/// A point of a chart, or the gradient with respect to one: x, y, z in the normalised frame (longest side of
/// the scan 1).
pub type Sample = [f32; 3];
