//! Plain geometric data: points, meshes, attributes, and the small numerical tools that all stages share.

pub mod cloud;
pub mod dense;
pub mod mesh;
pub mod neighbours;
pub mod sort;
pub mod vec3;

pub use cloud::{Attribute, PointCloud, ScalarKind};
pub use mesh::TriMesh;
