//! The subcommands, one file each.

pub mod measure;
pub mod render;
