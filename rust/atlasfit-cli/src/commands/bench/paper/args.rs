//! The command line of `bench paper`.

use crate::console::RunArgs;
use atlasfit_net::explicit::{NetworkOptions, Start};
use std::path::PathBuf;

/// Options of `bench paper`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the report, the pictures, and the results of each fit; fits that are there already are not
    /// done again
    #[arg(short, long, default_value = "bench-paper", value_name = "DIR")]
    pub output: PathBuf,
    /// Made-up shapes, few points, few steps: for tests
    #[arg(long)]
    pub quick: bool,
    /// How networks are trained
    #[arg(long, value_enum, default_value = "fast")]
    pub recipe: Training,
    /// Steps of the paper's recipe, at most; with --speed, of the reference
    #[arg(long, default_value_t = NetworkOptions::default().iterations, value_name = "N")]
    pub steps: usize,
    /// Weight of the stretch term where there is one, beside Chamfer distances that are sums, as the paper
    /// writes them. Where they are means, as in much code, a weight of 1 is one of about 30,000 here
    #[arg(long, default_value_t = NetworkOptions::default().stretch_weight, value_name = "LAMBDA")]
    pub stretch: f64,
    /// Where the networks' charts begin
    #[arg(long, value_enum, default_value = "patches")]
    pub start: Beginning,
    /// Seeds of the experiment "starts": --seed and those after it
    #[arg(long, default_value_t = 3, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=100))]
    pub seeds: u64,
    /// Shapes
    #[arg(long, value_delimiter = ',', default_value = "bunny,dragon,car,cup,mobius,chair,spiral,ring")]
    pub shapes: Vec<String>,
    /// Experiments: any of starts, table1, table2, conv, interpolation, lambda, dots
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "starts,table1,conv,lambda,dots,interpolation,table2"
    )]
    pub only: Vec<String>,
    /// The Python that has numpy, and pymeshlab for RIMLS and screened Poisson
    #[arg(long, default_value = "python3", value_name = "PROGRAM")]
    pub python: PathBuf,
    /// Instead of the tables: on the first shape, the time of a step of the paper's recipe beside that of
    /// this script in PyTorch (SHAPE SIGMA STEPS), and the fast recipe's time beside what the script needs
    /// for its Chamfer distance
    #[arg(long, value_name = "SCRIPT")]
    pub speed: Option<PathBuf>,
    /// The folder of shapes.py and meshlab.py
    #[arg(long, default_value = "tests/peers", value_name = "DIR")]
    pub scripts: PathBuf,
    #[command(flatten)]
    pub run: RunArgs,
}

/// How networks are trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Training {
    /// From coarse to fine
    Fast,
    /// As in the paper
    Paper,
}

/// Where charts begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Beginning {
    /// As small patches on the scan
    Patches,
    /// At random, as PyTorch starts layers
    Torch,
}

impl Beginning {
    /// As the networks' option.
    pub const fn start(self) -> Start {
        match self {
            Self::Patches => Start::Patches,
            Self::Torch => Start::Torch,
        }
    }

    /// As in the names of cells.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Patches => "patches",
            Self::Torch => "torch",
        }
    }
}
