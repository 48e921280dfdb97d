//! The subcommands, one file each.

pub mod batch;
pub mod bench;
pub mod compare;
pub mod completions;
pub mod convert;
pub mod denoise;
pub mod doctor;
pub mod gp;
pub mod info;
#[cfg(feature = "learn")]
pub mod learn;
pub mod man;
pub mod measure;
pub mod render;
pub mod simplify;
pub mod tiles;
pub mod unwrap;
