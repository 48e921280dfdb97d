//! `atlasfit man`: the manual pages, one for the program and one for each of its commands.

use crate::console::Console;
use anyhow::{Context as _, Result};
use atlasfit::Stop;
use clap_mangen::Man;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Options of `man`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder to write the pages to: atlasfit.1, atlasfit-denoise.1, ...
    folder: PathBuf,
}

/// Writes the pages.
pub fn run(args: &Args, mut program: clap::Command, console: &Console) -> Result<()> {
    std::fs::create_dir_all(&args.folder)
        .with_context(|| format!("cannot make the folder {}", args.folder.display()))?;
    program.build();
    let mut files = Vec::new();
    pages(program, &args.folder, &mut files)?;
    let text = format!("{} pages in {}\n", files.len(), args.folder.display());
    console.report(&text, &json!({ "files": files }));
    Ok(())
}

/// Writes the page of a command and those of the commands under it.
fn pages(command: clap::Command, folder: &Path, files: &mut Vec<String>) -> Result<()> {
    // `help` has no options, and its text is that of the others.
    let below: Vec<_> = command.get_subcommands().filter(|c| c.get_name() != "help").cloned().collect();
    let page = Man::new(command.version(env!("CARGO_PKG_VERSION")).disable_help_subcommand(true));
    let path = folder.join(page.get_filename());
    let mut roff = Vec::new();
    page.render(&mut roff).context("cannot write a manual page")?;
    atlasfit_io::write_file(&path, &roff, &Stop::default())?;
    files.push(path.display().to_string());
    below.into_iter().try_for_each(|command| pages(command, folder, files))
}
