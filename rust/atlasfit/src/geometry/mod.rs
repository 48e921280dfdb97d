//! Plain geometric data: points, meshes, attributes.

pub mod cloud;
pub mod mesh;
pub mod names;
pub mod polygons;
pub mod triangulate;

pub use cloud::{Attribute, PointCloud, ScalarKind, Scanners};
pub use mesh::{MOST_PAGES, TriMesh};
pub use polygons::Polygons;
