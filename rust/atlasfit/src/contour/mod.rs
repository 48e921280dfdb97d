//! One stitched surface from the blended charts.
//!
//! In: a signed distance on a thin band of voxels ([`crate::blend::field`]). Out: a triangle mesh: one
//! surface, boundary only where the scan has one. [`quads`] contours, [`clean`] makes a two-manifold of it,
//! [`holes`] closes small gaps.

mod adjacency;
mod before;
mod boundary;
pub(crate) mod bowties;
pub(crate) mod cavities;
mod cells;
pub(crate) mod clean;
pub(crate) mod compact;
pub(crate) mod components;
pub(crate) mod constants;
mod facing;
pub(crate) mod fragments;
pub(crate) mod holes;
pub(crate) mod loops;
mod membrane;
mod mixed;
mod normals;
pub(crate) mod parts;
mod patch;
pub(crate) mod quads;
mod refine;
mod slits;
pub(crate) mod smooth;
pub(crate) mod surface;
mod triangulate;
pub(crate) mod untangle;
mod viewers;

pub(crate) use facing::Facing;
