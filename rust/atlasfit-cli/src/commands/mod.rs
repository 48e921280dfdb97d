//! The subcommands, one file each.

pub mod bench;
pub mod denoise;
pub mod measure;
pub mod render;
