//! The `atlasfit` program: denoises scans, unwraps meshes, tells what files hold, converts them, measures
//! results, compares scans, draws pictures.
//!
//! Results go to standard output (text, or one JSON object with `--json`, also of a command that failed),
//! progress and warnings to standard error. Exit codes: 0 done, 1 the work failed, 2 the
//! command line is wrong, 130 cancelled (Ctrl-C).

mod commands;
mod console;
mod failure;
mod files;
mod number;
mod output;
mod page;
mod plot;
mod render;
mod values;
mod version;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use console::Console;
use failure::Failure;
use std::io::Write;
use std::process::ExitCode;

/// Fits an atlas of smooth charts to a noisy 3D scan: denoised points, one clean surface, chart UVs.
#[derive(Parser)]
#[command(name = "atlasfit", version = version::SHORT, long_version = version::long())]
#[command(propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print one JSON object on standard output instead of text
    #[arg(long, global = true)]
    json: bool,
    /// Print no progress and no notes, and of a command that writes files no report
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Denoise a scan: clean points, one stitched surface, chart UVs
    Denoise(Box<commands::denoise::Args>),
    /// Scans of any size in bounded memory: cut into tiles, denoised one by one, put together again
    #[command(subcommand)]
    Tiles(commands::tiles::Tiles),
    /// Denoise every scan of a folder: one line of JSON each, failures set aside
    Batch(Box<commands::batch::Args>),
    /// Lay out UVs for a mesh: few charts, little stretch, no flips, no overlaps, packed
    Unwrap(commands::unwrap::Args),
    /// Pack the charts of the UVs that a mesh has anew: they keep their shapes
    #[command(mut_args(commands::unwrap::packing))]
    Pack(commands::unwrap::Args),
    /// Make a mesh of fewer triangles; its UVs, colours and texture stay
    Simplify(commands::simplify::Args),
    /// Tell what a file holds: counts, attributes, extent, defects, spacing and noise
    Info(commands::info::Args),
    /// Write a file in another format
    Convert(commands::convert::Args),
    /// Measure a result: distance to a true surface, topology, UV quality
    Measure(commands::measure::Args),
    /// Tell what changed between two scans of the same thing, beyond what their uncertainty allows
    Compare(commands::compare::Args),
    /// Draw a mesh or points to a PNG picture
    Render(commands::render::Args),
    /// Tell what the program can use on this machine, and try it out
    Doctor(commands::doctor::Args),
    /// Write a script that lets a shell complete commands and options
    Completions(commands::completions::Args),
    /// Write the manual pages
    Man(commands::man::Args),
    /// Reproduce the project's figures beside its peers'
    #[command(subcommand)]
    Bench(commands::bench::Bench),
    /// The Gaussian processes behind the paper's networks: figures and tables
    #[command(subcommand)]
    Gp(commands::gp::Gp),
    /// Learn from a collection of shapes, as in the paper: make data, train, measure, reconstruct
    #[cfg(feature = "learn")]
    #[command(subcommand)]
    Learn(Box<commands::learn::Learn>),
}

fn main() -> ExitCode {
    // Before the command line is understood there is no console to ask.
    let json = std::env::args_os().any(|a| a == "--json");
    let cli =
        match with_negative_numbers(Cli::command()).try_get_matches().and_then(|m| Cli::from_arg_matches(&m))
        {
            Ok(cli) => cli,
            Err(e) => return not_understood(&e, json),
        };
    handle_panics();
    let console = match Console::new(cli.quiet, cli.json) {
        Ok(console) => console,
        Err(e) => {
            eprintln!("atlasfit: {e:#}");
            return ExitCode::FAILURE;
        }
    };
    let done = match &cli.command {
        Command::Denoise(args) => commands::denoise::run(args, &console),
        Command::Tiles(what) => commands::tiles::run(what, &console),
        Command::Batch(args) => commands::batch::run(args, &console),
        Command::Unwrap(args) | Command::Pack(args) => commands::unwrap::run(args, &console),
        Command::Bench(bench) => commands::bench::run(bench, &console),
        Command::Gp(what) => commands::gp::run(what, &console),
        #[cfg(feature = "learn")]
        Command::Learn(what) => commands::learn::run(what, &console),
        Command::Simplify(args) => commands::simplify::run(args, &console),
        Command::Info(args) => commands::info::run(args, &console),
        Command::Convert(args) => commands::convert::run(args, &console),
        Command::Measure(args) => commands::measure::run(args, &console),
        Command::Compare(args) => commands::compare::run(args, &console),
        Command::Render(args) => commands::render::run(args, &console),
        Command::Doctor(args) => commands::doctor::run(args, &console),
        Command::Completions(args) => commands::completions::run(args, Cli::command(), &console),
        Command::Man(args) => commands::man::run(args, Cli::command(), &console),
    };
    let Err(error) = done else { return ExitCode::SUCCESS };
    let Failure { kind, code, text } = Failure::of(&error);
    console.failed(kind, &text, code);
    ExitCode::from(code)
}

/// The command line, where the value of an option may begin with a minus: each option then says itself what
/// it takes, instead of "unexpected argument".
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    command
        .mut_args(|arg| {
            let takes_value = arg.get_action().takes_values() && !arg.is_positional();
            if takes_value { arg.allow_negative_numbers(true) } else { arg }
        })
        .mut_subcommands(with_negative_numbers)
}

/// Help and version are no failure; the rest is one, in JSON too where that is asked for.
fn not_understood(error: &clap::Error, json: bool) -> ExitCode {
    // A closed pipe (`| head`) is no failure.
    let _ = error.print();
    if json && error.use_stderr() {
        let text = error.to_string();
        let text = text.trim_start_matches("error: ").trim_end();
        let failure = serde_json::json!({ "kind": "usage", "text": text });
        println!(
            "{:#}",
            serde_json::json!({ "error": failure, "exit_code": 2, "notes": [], "warnings": [] })
        );
    }
    ExitCode::from(if error.use_stderr() { 2 } else { 0 })
}

/// What a panic needs to print its backtrace, in bytes: the program's own symbols, read whole.
const BACKTRACE_BYTES: usize = 64 << 20;

/// Panics of third-party readers on damaged files become errors, which say more than the panic's own text.
///
/// Where the system gives no more memory, the run ends here. The standard library panics when a thread that
/// just started gets no room for its signal stack, and takes a lock to print the backtrace; an allocation
/// that fails under that lock waits for the same lock, for ever.
fn handle_panics() {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if atlasfit_io::panics_become_errors() {
            return;
        }
        if !atlasfit::run::has_room(BACKTRACE_BYTES) {
            // Neither call allocates.
            let _ = writeln!(std::io::stderr(), "atlasfit: out of memory: the system gives no more; {panic}");
            std::process::exit(1);
        }
        tell(panic);
    }));
}
