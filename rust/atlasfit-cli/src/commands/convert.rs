//! `atlasfit convert`: a file in another format, with all that the format can hold.

use crate::console::{Console, RunArgs, Usage};
use crate::files::{self, InputArgs};
use crate::number::counted;
use crate::output::{self, Holds, Output, OutputArgs, Writer};
use anyhow::Result;
use serde_json::json;
use std::path::PathBuf;

/// Options of `convert`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file to read, or - for standard input; its content decides the format
    input: PathBuf,
    /// The file to write, or - for standard output; its extension decides the format: .ply, .obj, .glb, .off,
    /// .stl or .xyz
    output: PathBuf,
    #[command(flatten)]
    read: InputArgs,
    #[command(flatten)]
    write: OutputArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// Converts. What the output's format cannot hold is a note.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let output = Output { option: "OUTPUT", path: &args.output, holds: Holds::Anything };
    output::check(&[output], &[&args.input], args.write, console)?;
    let format = output.format(args.write)?;
    let mut loaded = files::load_as(&args.input, args.read.input_format, &args.run, console)?;
    if !format.holds_points() && loaded.faces.is_empty() {
        return Err(Usage(format!(
            "{} has no faces, and {} holds nothing else. Use .ply or .xyz",
            args.input.display(),
            format.name()
        ))
        .into());
    }
    let (from, points, faces) = (loaded.format, loaded.cloud.len(), loaded.faces.len());
    let repairs = files::repairs(&loaded);
    let needed = loaded.memory_to_write(format);
    console
        .start_silent(&args.run)
        .execute(|ctx| ctx.reserve(needed, "Raise the limit, or write a PLY file"))?;
    let mut writer = Writer::new(args.write, &args.run, console);
    if faces == 0 {
        writer.cloud(output, &loaded.cloud)?;
    } else {
        let polygons = loaded.polygons.take();
        writer.mesh(output, &loaded.into_mesh(), polygons.as_ref(), None, |_| false)?;
    }
    let written = writer.written;
    let text = format!(
        "{} from {} to {}: {}, {}\n",
        written.files.join(", "),
        from.name(),
        format.name(),
        counted(points, "point"),
        counted(faces, "face")
    );
    let json = json!({
        "file": files::text(&args.input), "format": from.name(), "points": points, "faces": faces,
        "repairs": repairs, "written": format.name(), "lost": written.lost, "files": written.files,
    });
    console.report(&text, &json);
    Ok(())
}
