//! Wavefront OBJ.
//!
//! Read: vertices (also with colours), texture coordinates and normals with indices of their own, polygons,
//! relative indices, continued lines. Materials, groups, lines and free-form statements are counted and left
//! out. Written: the same, with an MTL beside it when there is a texture.

pub(crate) mod edit;
pub(crate) mod library;
mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::write;
