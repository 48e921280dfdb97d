//! The subcommands, one file each.

pub mod batch;
pub mod bench;
pub mod compare;
pub mod convert;
pub mod denoise;
pub mod gp;
pub mod info;
#[cfg(feature = "learn")]
pub mod learn;
pub mod measure;
pub mod render;
pub mod simplify;
pub mod tiles;
pub mod unwrap;
