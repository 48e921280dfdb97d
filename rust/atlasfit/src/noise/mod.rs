//! How noisy a scan is: the standard deviation of its points along the surface normal.
//!
//! Four looks, each better informed than the one before: local quadrics ([`estimate`]), patches grown with
//! that estimate ([`check`]), thin tubes (the partition's, where they hold most of the scan), charts fitted
//! to a sample of patches ([`learn`]). A [`NoiseModel`] says what is known and from where. Places that
//! are clearly noisier or calmer than the rest have noise of their own (`places`).

mod between;
pub mod check;
pub(crate) mod constants;
pub mod estimate;
pub mod learn;
mod model;
pub(crate) mod places;
pub(crate) mod quantised;
mod stack;

pub(crate) use between::Camera;
pub use model::{NoiseModel, NoiseSource};
