//! Cutting a scan into overlapping disk-like patches and thin tubes that cover it.
//!
//! In: points, search tree, spacing, noise ([`Cut`]). Out: patches ([`partition`]) and tubes
//! ([`tubes::find`]); every point that lies on a surface is well inside at least one.

mod cover;
mod cut;
pub(crate) mod grow;
mod moments;
mod noisy_parts;
mod refit;
pub(crate) mod tubes;

pub(crate) use cover::{partition, sample};
pub(crate) use cut::{Cut, PATCH_SIZE, PatchSize, grow_all};
pub(crate) use refit::keep;

/// A point counts as covered by a patch when it lies within this share of the domain (of its radius): there
/// the partition-of-unity weight of the patch, (1 - 0.72^2)^2 = 0.23, is still substantial.
pub(crate) const CORE: f64 = 0.72;
