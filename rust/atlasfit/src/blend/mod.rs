//! The charts blended into one surface by a partition of unity.
//!
//! In: fitted charts with their members. Out: denoised points ([`project`]), charts that end where others
//! contradict them ([`trim`](mod@trim)), and the surface as a signed distance on a thin band of voxels
//! ([`field`], [`fill`], [`agree`]). Nothing is assumed of the whole: no inside and outside, no closedness,
//! no orientability.

pub(crate) mod constants;
pub(crate) mod membership;
pub(crate) mod project;
pub(crate) mod sites;
pub(crate) mod trim;

pub(crate) mod agree;
pub(crate) mod blocks;
pub(crate) mod corners;
pub(crate) mod field;
pub(crate) mod fill;
mod gauge;
mod influence;
pub(crate) mod levels;
