//! `atlasfit gp`: the Gaussian processes that the paper's networks tend to, drawn and in numbers.

mod figures;
mod laws;
mod patches;
mod plot;
mod prior;
mod report;

use crate::console::{Console, RunArgs};
use crate::files;
use crate::output::{self, Holds, Output, OutputArgs};
use anyhow::{Context as _, Result};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

/// What to do with the processes.
#[derive(Debug, clap::Subcommand)]
pub enum Gp {
    /// Draw covariances, curves, surfaces, curvature, spectra: PNG and SVG files
    Figures(Figures),
    /// Print the tables: kernels beside quadrature and random networks, laws, the bridge to the default prior
    Report(Report),
}

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
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = report::TABLES)]
    pub only: Vec<String>,
    /// Patches of the scan
    #[arg(long, default_value_t = 24, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub patches: u32,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Runs.
pub fn run(what: &Gp, console: &Console) -> Result<()> {
    match what {
        Gp::Figures(args) => figures(args, console),
        Gp::Report(args) => report::run(args, console),
    }
}

fn figures(args: &Figures, console: &Console) -> Result<()> {
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("cannot make {}", args.output.display()))?;
    let path = |name: &str, extension: &str| args.output.join(format!("{name}.{extension}"));
    // A folder that takes no files is told before the work.
    let probe = path(figures::ALL[0].0, "png");
    let output = Output { option: "--output", path: &probe, holds: Holds::Picture };
    output::check(&[output], &[], OutputArgs { output_format: None, ascii: false, force: true }, console)?;
    let (mut text, mut files) = (String::new(), Vec::new());
    let wanted = |name: &str| args.only.is_empty() || args.only.iter().any(|o| o == name);
    for (name, make) in figures::ALL.into_iter().filter(|f| wanted(f.0)) {
        let seed = args.run.seed;
        let [png, svg] =
            console.apart(&args.run, "drawing the figures", move || -> Result<[Vec<u8>; 2]> {
                let figure = make(seed);
                Ok([crate::commands::render::png(&figure.picture()?)?, figure.svg()?.into_bytes()])
            })??;
        for (extension, bytes) in [("png", png), ("svg", svg)] {
            let path = path(name, extension);
            files::write(&path, bytes)?;
            let _ = writeln!(text, "{}", path.display());
            files.push(files::text(&path));
        }
    }
    console.report(&text, &json!({ "files": files }));
    Ok(())
}
