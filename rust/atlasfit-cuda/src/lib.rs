//! Kernels for NVIDIA GPUs behind `atlasfit_learn`'s operations: those that candle lacks, or does in many
//! passes over memory. Empty without the feature `cuda`.
//!
//! In and out: candle's storages of f32 numbers that lie in order. Each kernel has a safe twin for the CPU in
//! `atlasfit_learn`, which says what it computes; a test there compares the two where there is a GPU.
#![cfg(feature = "cuda")]

mod adam;
mod launch;
mod nearest;
mod norm;
mod pictures;

pub use adam::{adam_moments, adam_move};
pub use launch::Given;
pub use nearest::{chamfer_gradient, nearest};
pub use norm::{NormSize, norm_apply, norm_gradient, norm_moments, norm_sums};
pub use pictures::{Windows, fold, outer_add, sum_middle, unfold, upsample, upsample_adjoint};
