//! Reads input files and tells what had to be repaired; checks output names.

use crate::console::{Console, RunArgs, Usage};
use anyhow::Result;
use atlasfit_io::{Format, LoadOptions, Loaded};
use serde_json::{Value, json};
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

/// What had to be repaired, as JSON.
pub fn repairs(loaded: &Loaded) -> Value {
    loaded
        .report
        .notes
        .iter()
        .map(|n| json!({ "what": n.what, "count": n.count, "first": n.first }))
        .collect::<Vec<_>>()
        .into()
}

/// The format that an output's extension asks for. A wrong one must not cost the work.
pub fn output_format(path: &Path) -> Result<Format> {
    match Format::from_path(path) {
        Some(format) if format.can_write() => Ok(format),
        Some(format) => Err(Usage(format!(
            "{}: {} files are only read, not written. Use .ply, .obj, .glb, .off, .stl or .xyz",
            path.display(),
            format.name()
        ))
        .into()),
        None => Err(Usage(format!(
            "{}: no known format has this extension. Use .ply, .obj, .glb, .off, .stl or .xyz",
            path.display()
        ))
        .into()),
    }
}
