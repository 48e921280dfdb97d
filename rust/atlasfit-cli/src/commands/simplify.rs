//! `atlasfit simplify`: a mesh with fewer triangles; its UVs, colours and texture stay.

use crate::console::{Console, RunArgs, Usage};
use crate::files::{self, InputArgs};
use crate::number::counted;
use crate::output::{self, Holds, Output, OutputArgs, Writer};
use anyhow::Result;
use atlasfit::simplify::{SimplifyOptions, simplify_mesh};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Options of `simplify`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("how far").required(true).multiple(true))]
pub struct Args {
    /// The mesh, or - for standard input
    mesh: PathBuf,
    /// The mesh to write, or - for standard output; its extension decides the format
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Triangles that are few enough
    #[arg(long, value_name = "N", group = "how far", value_parser = clap::value_parser!(u64).range(1..))]
    faces: Option<u64>,
    /// How far any vertex may be from the new mesh, in the mesh's unit; alone: as few triangles as that
    /// allows
    #[arg(long, value_name = "LENGTH", group = "how far")]
    max_error: Option<f64>,
    #[command(flatten)]
    read: InputArgs,
    #[command(flatten)]
    write: OutputArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// Simplifies.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let output = Output { option: "--output", path: &args.output, holds: Holds::Faces };
    output::check(&[output], &[&args.mesh], args.write, console)?;
    let started = Instant::now();
    let mut loaded = files::load_as(&args.mesh, args.read.input_format, &args.run, console)?;
    if loaded.faces.is_empty() {
        return Err(Usage(format!("{} has no faces", args.mesh.display())).into());
    }
    loaded.left_out.iter().for_each(|l| console.note(format_args!("not kept: {l}")));
    let png = match loaded.texture.take() {
        Some(image) => {
            let image = console.apart(&args.run, "reading", move || files::read_image(&image))??;
            Some(files::png_apart(image, &args.run, console)?)
        }
        None => None,
    };
    let mesh = loaded.into_mesh();
    let options = SimplifyOptions::default()
        .with_faces(args.faces.map(|n| usize::try_from(n).unwrap_or(usize::MAX)))
        .with_max_error(args.max_error);
    let light = console.start(&args.run).execute(|ctx| simplify_mesh(&mesh, &options, ctx))?;
    light.warnings.iter().for_each(|w| console.warn(w));
    let mut writer = Writer::new(args.write, &args.run, console);
    writer.mesh(output, &light.mesh, None, png.as_deref(), |_| false)?;
    let written = writer.written;
    let (before, after) = (mesh.triangles.len(), light.mesh.triangles.len());
    let text = format!(
        "{}: {} of {}, {:.1} s\n",
        written.files.join(", "),
        counted(after, "face"),
        counted(before, "face"),
        started.elapsed().as_secs_f64()
    );
    let json = json!({
        "mesh": files::text(&args.mesh), "faces_before": before, "faces": after,
        "vertices": light.mesh.positions.len(), "seconds": started.elapsed().as_secs_f64(),
        "lost": written.lost, "files": written.files,
    });
    console.report(&text, &json);
    Ok(())
}
