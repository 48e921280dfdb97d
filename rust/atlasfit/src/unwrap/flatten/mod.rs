//! Flattening: planar positions of a chart's vertices that keep its triangles' shapes, and exact tests of
//! them.

pub(crate) mod arap;
mod block;
mod constants;
pub(crate) mod contacts;
pub(crate) mod dirichlet;
mod factor;
pub(crate) mod graph;
pub(crate) mod newton;
pub(crate) mod project;
pub(crate) mod shape;
