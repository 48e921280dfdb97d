//! Measures results: distance to a true surface, topology, quality of UVs.
//!
//! In: meshes and points in the user's unit. Out: plain numbers; nothing is changed. Random sampling follows
//! the run's seed and gives the same numbers for any thread count.

mod chamfer;
pub mod compare;
pub mod distance;
pub mod locate;
mod meeting;
mod memory;
pub mod rims;
pub mod sample;
#[cfg(test)]
mod shapes;
mod statistics;
pub mod topology;
pub mod uv;

pub use chamfer::chamfer;
pub use compare::{CompareOptions, Comparison, compare};
pub use distance::{
    DistanceOptions, PointDistance, SurfaceDistance, distance_memory_needed, points, points_each, surface,
};
pub use locate::{Foot, Locator};
pub use meeting::self_intersecting;
pub use memory::memory_needed;
pub use rims::{RimDistance, rims};
pub use statistics::Distances;
pub use topology::{Topology, topology};
pub use uv::{Charts, UvQuality, charts, uv};
