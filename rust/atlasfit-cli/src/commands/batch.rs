//! `atlasfit batch`: every scan of a folder denoised, one after the other.
//!
//! In: a folder. Out: for each scan in it a surface of the same name, and a line of JSON on standard output.
//! A scan that fails is named, and the rest goes on. What is there already is not done again, unless --force
//! asks for it.

use crate::console::{Console, RunArgs};
use crate::failure::Failure;
use crate::files;
use anyhow::{Context, Result};
use atlasfit_io::{Format, SaveCloud, SaveMesh, check_output, save_cloud, save_mesh};
use serde_json::{Value, json};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `batch`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder with the scans; folders in it are not looked into
    folder: PathBuf,
    /// The folder for the results; made where it is not there
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// The format of the surfaces, by its extension
    #[arg(long, default_value = "glb", value_name = "EXTENSION")]
    surface: String,
    /// Write the denoised points too, as PLY
    #[arg(long)]
    points: bool,
    /// Lay out no UVs
    #[arg(long)]
    no_uv: bool,
    /// Denoise only this scan of the folder, by its file's name: for engines that run one task for each
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Denoise again what is there already
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    run: RunArgs,
}

/// The scans of a folder, by name.
fn scans(folder: &Path) -> Result<Vec<PathBuf>> {
    let read = || format!("cannot read the folder {}", folder.display());
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(read)? {
        let path = entry.with_context(read)?.path();
        let hidden = path.file_name().is_none_or(|n| n.to_string_lossy().starts_with('.'));
        if !hidden && path.is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Denoises all.
///
/// # Errors
/// The folder cannot be read, the results' cannot be written, the command is stopped; or, after all are done,
/// some have failed.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let mut scans = scans(&args.folder)?;
    if let Some(only) = &args.only {
        scans.retain(|s| s.file_name().is_some_and(|n| n.to_string_lossy() == *only));
        if scans.is_empty() {
            anyhow::bail!("{} has no file {only}", args.folder.display());
        }
    }
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("cannot make the folder {}", args.output.display()))?;
    let mut failed = Vec::new();
    for scan in &scans {
        let started = Instant::now();
        let done = one(scan, args, console);
        // Ctrl-C and the time limit end the whole.
        console.check(&args.run, "denoising")?;
        let mut line = done.unwrap_or_else(|error| {
            let Failure { kind, text, .. } = Failure::of(&error);
            failed.push(files::text(scan));
            json!({ "error": { "kind": kind, "text": text } })
        });
        line["scan"] = json!(files::text(scan));
        line["seconds"] = json!(started.elapsed().as_secs_f64());
        // A closed pipe (`| head`) is no failure.
        let _ = writeln!(std::io::stdout(), "{line}");
    }
    if failed.is_empty() {
        return Ok(());
    }
    anyhow::bail!("{} of {} scans failed: {}", failed.len(), scans.len(), failed.join(", "))
}

/// Denoises a scan; what there is to say of it.
fn one(scan: &Path, args: &Args, console: &Console) -> Result<Value> {
    let name = scan.file_name().unwrap_or_default().to_string_lossy();
    // The whole name: scans that differ in their extension only have results of their own.
    let surface = args.output.join(format!("{name}.{}", args.surface));
    let points = args.points.then(|| args.output.join(format!("{name}.points.ply")));
    let outputs: Vec<&Path> = std::iter::once(surface.as_path()).chain(points.as_deref()).collect();
    let files: Vec<String> = outputs.iter().map(|p| files::text(p)).collect();
    if !args.force && outputs.iter().all(|o| o.exists()) {
        return Ok(json!({ "files": files, "skipped": "the results are there already" }));
    }
    for output in &outputs {
        check_output(output)?;
    }
    let loaded = files::load_as(scan, None, &args.run, console)?;
    let options = atlasfit::DenoiseOptions::default().with_uv(!args.no_uv);
    let outcome = atlasfit::denoise(&loaded.cloud, &options, &mut console.start_silent(&args.run))?;
    let stop = console.stop(&args.run);
    if let Some(points) = &points {
        let mut how = SaveCloud::default();
        (how.format, how.stop) = (Some(Format::Ply), stop.clone());
        save_cloud(points, &outcome.points, &how)?;
    }
    let mut how = SaveMesh::default();
    how.stop = stop;
    save_mesh(&surface, &outcome.surface, &how)?;
    let r = &outcome.report;
    Ok(json!({
        "files": files, "points": r.points, "outliers": r.outliers, "spacing": r.spacing, "noise": r.noise,
        "faces": outcome.surface.triangles.len(), "parts": r.parts, "boundary_loops": r.boundary_loops,
        "warnings": r.warnings,
    }))
}
