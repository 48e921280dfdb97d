//! `atlasfit completions`: a script that lets a shell complete the program's commands and options.

use crate::console::Console;
use anyhow::{Context as _, Result};
use clap_complete::Shell;
use std::io::Write as _;

/// Options of `completions`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The shell that the script is for
    #[arg(value_enum)]
    shell: Shell,
}

/// Writes the script to standard output.
pub fn run(args: &Args, mut program: clap::Command, console: &Console) -> Result<()> {
    console.take_output();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "atlasfit", &mut script);
    std::io::stdout().write_all(&script).context("cannot write to standard output")
}
