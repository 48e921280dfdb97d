//! Plain geometric data: points, meshes, attributes.

pub mod cloud;
pub mod join;
pub mod mesh;
pub mod motion;
pub mod names;
pub mod polygons;
pub mod triangulate;

pub use cloud::{Attribute, PointCloud, ScalarKind, Scanners};
pub use mesh::{MOST_PAGES, TriMesh};
pub use motion::Motion;
pub use polygons::Polygons;
