//! `atlasfit convert`: a file in another format, with all that the format can hold.

use crate::console::{Console, RunArgs, Usage};
use crate::files;
use crate::number::count;
use anyhow::Result;
use atlasfit_io::{Format, SaveCloud, SaveMesh, save_cloud, save_mesh};
use serde_json::json;
use std::path::PathBuf;

/// Options of `convert`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file to read; its content decides the format
    input: PathBuf,
    /// The file to write; its extension decides the format: .ply, .obj, .glb, .off, .stl or .xyz
    output: PathBuf,
    /// Write text where the format has both text and binary
    #[arg(long)]
    ascii: bool,
    #[command(flatten)]
    run: RunArgs,
}

/// Converts. What the output's format cannot hold is a note.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let format = files::output_format(&args.output)?;
    let mut loaded = files::load(&args.input, &args.run, console)?;
    if format == Format::Stl && loaded.faces.is_empty() {
        return Err(Usage(format!(
            "{} has no faces, and STL holds nothing else. Use .ply or .xyz",
            args.input.display()
        ))
        .into());
    }
    let (from, points, faces) = (loaded.format, loaded.cloud.len(), loaded.faces.len());
    let repairs = files::repairs(&loaded);
    let needed = loaded.memory_to_write(format);
    console
        .start_silent(&args.run)
        .execute(|ctx| ctx.reserve(needed, "Raise the limit, or write a PLY file"))?;
    let saved = if faces == 0 {
        save_cloud(&args.output, &loaded.cloud, &SaveCloud { ascii: args.ascii, ..SaveCloud::default() })?
    } else {
        let polygons = loaded.polygons.take();
        let how = SaveMesh { ascii: args.ascii, polygons: polygons.as_ref(), ..SaveMesh::default() };
        save_mesh(&args.output, &loaded.into_mesh(), &how)?
    };
    for lost in &saved.lost {
        console.note(format_args!("{}: not kept: {lost}", args.output.display()));
    }
    let files: Vec<String> = saved.files.iter().map(|f| f.display().to_string()).collect();
    let text = format!(
        "{} from {} to {}: {} points, {} faces\n",
        files.join(", "),
        from.name(),
        format.name(),
        count(points),
        count(faces)
    );
    let json = json!({
        "file": args.input, "format": from.name(), "points": points, "faces": faces, "repairs": repairs,
        "written": format.name(), "lost": saved.lost, "files": files,
    });
    console.report(&text, &json);
    Ok(())
}
