//! The command lines of `gp`.

use super::figures;
use crate::console::RunArgs;
use std::path::PathBuf;

/// The tables, by the names that `--only` takes.
pub const TABLES: [&str; 8] =
    ["kernels", "depth", "width", "curvature", "batch-norm", "convolution", "spectra", "bridge"];

/// Options of `gp figures`.
#[derive(Debug, clap::Args)]
pub struct Figures {
    /// Folder of the figures
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Figures; without it, all
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = figures::ALL.map(|f| f.0))]
    pub only: Vec<String>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `gp report`.
#[derive(Debug, clap::Args)]
pub struct Report {
    /// A scan whose patches are smoothed by the default prior and by the exact process; without it, made-up
    /// patches
    #[arg(long, value_name = "FILE")]
    pub scan: Option<PathBuf>,
    /// Tables; without it, all
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = TABLES)]
    pub only: Vec<String>,
    /// Patches of the scan
    #[arg(long, default_value_t = 24, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub patches: u32,
    #[command(flatten)]
    pub run: RunArgs,
}
