//! Plain geometric data: points, meshes, attributes, frames of normalisation.

pub mod cloud;
pub mod mesh;
pub mod vec3;

pub use cloud::{Attribute, PointCloud, ScalarKind};
pub use mesh::TriMesh;
