//! Finding things in space and along meshes: nearest neighbours, boxes, triangles, distances from planes,
//! winding numbers, disjoint sets, edges, shortest ways, welding, point spacing.

pub mod bvh;
pub(crate) mod constants;
pub mod edges;
pub(crate) mod faces;
pub(crate) mod inject;
pub(crate) mod lists;
pub(crate) mod min_cut;
pub mod neighbours;
pub(crate) mod order;
pub(crate) mod outside;
pub(crate) mod paths;
pub(crate) mod quadric;
pub mod sets;
pub mod spacing;
pub(crate) mod triangle;
pub mod weld;
pub(crate) mod winding;

pub use neighbours::{Neighbour, Neighbours};
