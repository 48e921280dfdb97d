//! Measures results: distance to a known surface, topology, quality of UVs.
//!
//! In: meshes and points in the user's unit. Out: plain numbers; nothing is changed. Random sampling follows the
//! run's seed and gives the same numbers for any thread count.

pub mod distance;
pub mod locate;
pub mod sample;
#[cfg(test)]
mod shapes;
pub mod topology;
pub mod uv;

pub use distance::{
    DistanceOptions, Distances, PointDistance, SurfaceDistance, chamfer, points, points_each, surface,
};
pub use locate::{Foot, Locator};
pub use topology::{Topology, topology};
pub use uv::{Charts, UvQuality, charts, uv};
