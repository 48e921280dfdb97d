//! Numerical tools that know nothing of scans and charts: vectors, small dense algebra, splines, robust
//! weights, strays among what is known, special functions, order statistics, random numbers, sorting, sums
//! over pairs; counts as text.

pub mod dense;
pub(crate) mod mixture;
pub(crate) mod pairs;
pub(crate) mod pentadiagonal;
pub(crate) mod plane;
pub mod rng;
pub mod robust;
pub(crate) mod scatter;
pub mod sort;
pub mod special;
pub mod spline;
pub mod stats;
pub mod vec3;
pub mod wording;

pub use rng::Rng;
pub use vec3::Vec3;
