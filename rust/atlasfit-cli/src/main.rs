//! The `atlasfit` program: denoises scans, unwraps meshes, tells what files hold, converts them, measures
//! results, draws pictures.
//!
//! Results go to standard output (text, or one JSON object with `--json`), progress and warnings to standard
//! error. Exit codes: 0 done, 1 the work failed, 2 the command line is wrong, 130 cancelled (Ctrl-C).

mod commands;
mod console;
mod files;
mod number;
mod render;

use clap::{Parser, Subcommand};
use console::{Console, Usage};
use std::process::ExitCode;

/// Fits an atlas of smooth charts to a noisy 3D scan: denoised points, one clean surface, chart UVs.
#[derive(Parser)]
#[command(version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print one JSON object on standard output instead of text
    #[arg(long, global = true)]
    json: bool,
    /// Print no progress and no notes
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Denoise a scan: clean points, one stitched surface, chart UVs
    Denoise(Box<commands::denoise::Args>),
    /// Lay out UVs for a mesh: few charts, little stretch, no flips, no overlaps, packed
    Unwrap(commands::unwrap::Args),
    /// Tell what a file holds: counts, attributes, extent, defects, spacing and noise
    Info(commands::info::Args),
    /// Write a file in another format
    Convert(commands::convert::Args),
    /// Measure a result: distance to a true surface, topology, UV quality
    Measure(commands::measure::Args),
    /// Draw a mesh or points to a PNG picture
    Render(commands::render::Args),
    /// Reproduce the project's figures beside its peers'
    #[command(subcommand)]
    Bench(commands::bench::Bench),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    silence_handled_panics();
    let console = match Console::new(cli.quiet, cli.json) {
        Ok(console) => console,
        Err(e) => return fail(&e),
    };
    let done = match &cli.command {
        Command::Denoise(args) => commands::denoise::run(args, &console),
        Command::Unwrap(args) => commands::unwrap::run(args, &console),
        Command::Bench(bench) => commands::bench::run(bench, &console),
        Command::Info(args) => commands::info::run(args, &console),
        Command::Convert(args) => commands::convert::run(args, &console),
        Command::Measure(args) => commands::measure::run(args, &console),
        Command::Render(args) => commands::render::run(args, &console),
    };
    done.map_or_else(|e| fail(&e), |()| ExitCode::SUCCESS)
}

/// Panics of third-party readers on damaged files become errors, which say more than the panic's own text.
fn silence_handled_panics() {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !atlasfit_io::panics_become_errors() {
            tell(panic);
        }
    }));
}

fn fail(error: &anyhow::Error) -> ExitCode {
    let code = match error.downcast_ref::<atlasfit::Error>() {
        Some(atlasfit::Error::Cancelled) => 130,
        Some(atlasfit::Error::InvalidArgument { .. }) => 2,
        _ if error.is::<Usage>() => 2,
        _ => 1,
    };
    // Some errors name their cause themselves.
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    eprintln!("atlasfit: {text}");
    ExitCode::from(code)
}
