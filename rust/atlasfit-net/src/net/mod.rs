//! The networks of the paper with their exact gradients: fully connected (`dense`) and convolutional
//! ([`conv`]), and what they are made of.

pub(crate) mod adam;
pub mod conv;
pub(crate) mod dense;
pub mod gemm;
pub(crate) mod hinge;
mod ridge;

pub use conv::Conv;
pub(crate) use dense::Dense;
pub(crate) use hinge::Grid;
