//! `atlasfit gp`: the Gaussian processes that the paper's networks tend to, drawn and in numbers.

mod args;
mod figures;
mod laws;
mod patches;
mod prior;
mod report;

use crate::console::Console;
use crate::files;
use crate::output::{self, Holds, Output, OutputArgs};
use anyhow::{Context as _, Result};
use args::{Figures, Report};
use serde_json::json;
use std::fmt::Write as _;

/// What to do with the processes.
#[derive(Debug, clap::Subcommand)]
pub enum Gp {
    /// Draw covariances, curves, surfaces, curvature, spectra: PNG and SVG files
    Figures(Figures),
    /// Print the tables: kernels beside quadrature and random networks, laws, the bridge to the default prior
    Report(Report),
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
