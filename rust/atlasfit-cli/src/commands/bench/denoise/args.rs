//! Options of `bench denoise`.

use super::super::cells::CellArgs;
use std::path::PathBuf;

/// Options of `bench denoise`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    pub cells: CellArgs,
    /// Fits per cell, ours and the peers'; the median time counts
    #[arg(
        long,
        default_value_t = 1,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=100)
    )]
    pub repeat: u32,
    /// Poisson settings DEPTH,NEIGHBOURS,WEIGHT, the default one first
    #[arg(long, value_delimiter = '/', default_value = "7,20,4/7,30,2/7,40,1/8,20,4")]
    pub settings: Vec<String>,
    /// Leave the peers out
    #[arg(long)]
    pub no_peers: bool,
    /// Run the peers only
    #[arg(long, conflicts_with = "no_peers")]
    pub only_peers: bool,
    /// Keep the peers' results in this file (JSON lines) and take them from it. Times from it are marked with
    /// *
    #[arg(long, value_name = "FILE")]
    pub peer_cache: Option<PathBuf>,
    /// Time this build and another one (a program) in turn instead: `denoise` of each cell with default
    /// options, --repeat runs of each; nothing else is measured
    #[arg(long, value_name = "PROGRAM", conflicts_with_all = ["only_peers", "markdown", "csv", "peer_cache"])]
    pub against: Option<PathBuf>,
    /// Write the table as Markdown
    #[arg(long, value_name = "FILE")]
    pub markdown: Option<PathBuf>,
    /// Write all figures as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Keep scans and surfaces in this folder
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
}
