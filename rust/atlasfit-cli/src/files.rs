//! Reads input files and tells what had to be repaired.

use crate::console::{Console, RunArgs};
use anyhow::Result;
use atlasfit_io::{LoadOptions, Loaded};
use std::path::Path;

/// Reads a cloud or mesh; repairs are notes.
pub fn load(path: &Path, args: &RunArgs, console: &Console) -> Result<Loaded> {
    let loaded = atlasfit_io::load(path, &LoadOptions { max_memory_bytes: args.max_memory })?;
    for note in &loaded.report.notes {
        console.note(format_args!("{}: {note}", path.display()));
    }
    console.check()?;
    Ok(loaded)
}
