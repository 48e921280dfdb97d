//! `atlasfit bench`: the project's figures beside its peers', one file or folder per benchmark.

mod against;
mod cells;
mod compare;
mod denoise;
mod paper;
mod peers;
mod shared;
mod surfaces;
mod uncertainty;
mod unwrap;

use crate::console::Console;
use anyhow::{Context as _, Result};

/// What to benchmark.
#[derive(Debug, clap::Subcommand)]
pub enum Bench {
    /// Accuracy, completeness, topology and time of denoising, beside screened Poisson
    Denoise(denoise::Args),
    /// Charts, seams, stretch, coverage and time of unwrapping, beside uvunwrap, xatlas and Blender
    Unwrap(unwrap::Args),
    /// Accuracy, completeness, topology and time of surfaces of the same denoised points, beside CGAL's
    Surfaces(surfaces::Args),
    /// How often 90% intervals of the uncertainty hold the true distance, and what it costs
    Uncertainty(uncertainty::Args),
    /// How much noise alone is taken for change between two scans, and how much of a dent is found
    Compare(compare::Args),
    /// The tables of Deep Manifold Prior with its networks, beside the default prior
    Paper(paper::Args),
}

/// Runs a benchmark. Its files lie in a temporary folder unless they are to be kept.
pub fn run(bench: &Bench, console: &Console) -> Result<()> {
    console.run_alone();
    let temporary = std::env::temp_dir().join(format!("atlasfit-bench-{}", std::process::id()));
    let keep = match bench {
        Bench::Denoise(args) => args.keep.clone(),
        Bench::Unwrap(_)
        | Bench::Surfaces(_)
        | Bench::Uncertainty(_)
        | Bench::Compare(_)
        | Bench::Paper(_) => None,
    };
    let folder = keep.clone().unwrap_or_else(|| temporary.clone());
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let done = match bench {
        Bench::Denoise(args) => denoise::run(args, &folder, console),
        Bench::Unwrap(args) => unwrap::run(args, &folder, console),
        Bench::Surfaces(args) => surfaces::run(args, &folder, console),
        Bench::Uncertainty(args) => uncertainty::run(args, &folder, console),
        Bench::Compare(args) => compare::run(args, &folder, console),
        Bench::Paper(args) => paper::run(args, console),
    };
    if keep.is_none() {
        // What cannot be removed stays in the system's temporary folder.
        let _ = std::fs::remove_dir_all(&temporary);
    }
    done
}
