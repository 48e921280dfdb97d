//! Cutting a scan into overlapping disk-like patches and thin tubes that cover it.
//!
//! In: points, search tree, spacing, noise ([`Cut`]). Out: patches ([`partition`]) and tubes
//! ([`tubes::find`]); every point that lies on a surface is well inside at least one.

pub(crate) mod constants;
mod cover;
mod cut;
pub(crate) mod grow;
mod moments;
mod noisy_parts;
mod refit;
mod slab;
pub(crate) mod tubes;

pub(crate) use cover::{partition, sample};
pub(crate) use cut::{Cut, PatchSize, grow_all};
pub(crate) use refit::{keep, restore};
