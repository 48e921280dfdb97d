//! The networks of the paper with their exact gradients: fully connected ([`dense`]) and convolutional ([`conv`]), and what they are made of.

pub mod adam;
pub mod conv;
pub mod dense;
pub mod gemm;
pub mod hinge;

pub use conv::Conv;
pub use dense::Dense;
pub use hinge::Grid;
