//! Options of `bench denoise`.

use crate::console::RunArgs;
use std::path::PathBuf;

/// Options of `bench denoise`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Simulated scans instead, of these kinds: views, outliers, misregistered, quantised, uneven, lidar,
    /// sheets; a number chooses one of several (outliers20, sheets3) [default: all]
    #[arg(long, value_delimiter = ',', value_name = "KINDS", num_args = 0..=1, default_missing_value = "")]
    pub scanner: Option<Vec<String>>,
    /// Shapes: ring, spiral, mobius, bumps, knot, room, box, spikes, or names of PLY meshes in the data folder
    /// [default: bunny,dragon,car,cup,mobius,chair,spiral,ring; with --scanner bumps,knot,ring,spiral and all
    /// meshes of the data folder]
    #[arg(long, value_delimiter = ',')]
    pub shapes: Option<Vec<String>>,
    /// Standard deviations of the noise, for a shape of size 1 [default: 0.002,0.005,0.01,0.02; with
    /// --scanner 0.004]
    #[arg(long, value_delimiter = ',')]
    pub sigmas: Option<Vec<f64>>,
    /// The folder of meshes [default: ../shared/data/denoise beside the repository, where it is]
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Points per scan
    #[arg(long, default_value_t = 16_000, value_name = "N")]
    pub count: usize,
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
    /// The Python that has numpy, and pymeshlab for the peers
    #[arg(long, default_value = "python3", value_name = "PROGRAM")]
    pub python: PathBuf,
    /// The folder of shapes.py, scanner.py and meshlab.py
    #[arg(long, default_value = "tests/peers", value_name = "DIR")]
    pub scripts: PathBuf,
    /// Keep scans and surfaces in this folder
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}
