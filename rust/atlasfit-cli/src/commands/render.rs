//! `atlasfit render`: a picture of a mesh or of points.

use crate::console::{Console, RunArgs};
use crate::files::{self, InputArgs};
use crate::number::counted;
use crate::output::{self, Holds, Output, OutputArgs, Writer};
use crate::render::camera::{Up, View};
use crate::render::{Mode, Picture, Style, bytes_of_pixels, render, scale};
use anyhow::{Context as _, Result};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Options of `render`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A mesh or points, or - for standard input
    file: PathBuf,
    /// The PNG picture to write, or - for standard output
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees
    #[arg(long, default_value = "front", allow_hyphen_values = true)]
    view: View,
    /// The vertical axis
    #[arg(long, value_enum, default_value = "y")]
    up: Up,
    /// What to show; shaded for a mesh and points for points where it is not given
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    /// The attribute that --mode uncertainty shows
    #[arg(long, value_name = "NAME", default_value = atlasfit::pipeline::UNCERTAINTY)]
    attribute: String,
    /// Width and height in pixels
    #[arg(long, default_value = "1024x1024", value_name = "WxH", value_parser = size)]
    size: [usize; 2],
    /// One normal per face instead of smooth ones
    #[arg(long)]
    flat: bool,
    /// Draw boundary edges in red and edges with more than two faces in magenta
    #[arg(long)]
    boundary: bool,
    /// Leave the file's colours and texture out
    #[arg(long)]
    plain: bool,
    /// Diameter of a point in pixels
    #[arg(long, value_name = "PIXELS", value_parser = diameter)]
    point_size: Option<f64>,
    /// Let the output replace the input
    #[arg(long, help_heading = "Files")]
    force: bool,
    #[command(flatten)]
    read: InputArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// Pixels along a side, at the most: a picture's samples take 8 bytes each at 4 per pixel.
const LARGEST: usize = 8192;

fn size(s: &str) -> Result<[usize; 2], String> {
    let side = |t: &str| t.parse::<usize>().ok().filter(|n| (1..=LARGEST).contains(n));
    s.split_once('x')
        .and_then(|(w, h)| Some([side(w)?, side(h)?]))
        .ok_or_else(|| format!("give WIDTHxHEIGHT, each from 1 to {LARGEST}, for example 1024x768"))
}

fn diameter(s: &str) -> Result<f64, String> {
    s.parse::<f64>()
        .ok()
        .filter(|d| (0.1..=200.0).contains(d))
        .ok_or_else(|| "give a number of pixels from 0.1 to 200".into())
}

/// Bytes for one face, or one point of a cloud, while it is drawn (measured, rounded up).
const BYTES_PER_FACE: u64 = 200;

/// Draws.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let output = Output { option: "--output", path: &args.output, holds: Holds::Picture };
    let write = OutputArgs { output_format: None, ascii: false, force: args.force };
    output::check(&[output], &[&args.file], write, console)?;
    let mut loaded = files::load_as(&args.file, args.read.input_format, &args.run, console)?;
    let by_attribute = args.mode == Some(Mode::Uncertainty);
    let shows = !args.plain && !by_attribute && loaded.corner_uv.is_some();
    let texture = loaded.texture.take().filter(|_| shows);
    let texture = texture.map(|bytes| console.apart(&args.run, "reading", move || files::read_image(&bytes)));
    let texture = texture.transpose()?.and_then(|image| {
        image.inspect_err(|e| console.note(format_args!("the texture is not shown: {e:#}"))).ok()
    });
    let mut mesh = loaded.into_mesh();
    let mut scale = None;
    if by_attribute {
        let (colors, of_colors) = scale::painted(&mesh, &args.attribute)?;
        (mesh.colors, scale) = (Some(colors), Some(of_colors));
    }
    let mode = args.mode.unwrap_or(if mesh.triangles.is_empty() { Mode::Points } else { Mode::Shaded });
    let style = Style {
        mode,
        view: args.view,
        up: args.up,
        size: args.size,
        flat: args.flat,
        boundary: args.boundary,
        colors: !args.plain || by_attribute,
        point_size: args.point_size,
    };
    let elements = BYTES_PER_FACE * mesh.triangles.len().max(mesh.positions.len()) as u64;
    let image = texture.as_ref().map_or(0, |t| 8 * t.rgba.len() as u64);
    let needed = mesh.bytes() + image + elements;
    let mut picture = console.start(&args.run).execute(|ctx| {
        let needed = needed + bytes_of_pixels(&style, ctx.threads());
        ctx.reserve(needed, "Raise the limit, or ask for a smaller picture")?;
        render(&mesh, texture.as_ref(), &style, ctx)
    })?;
    if let Some(scale) = &scale {
        scale::legend(&mut picture, scale)?;
    }
    if picture.not_shown > 0 {
        let (what, are) =
            (counted(picture.not_shown, "face or point"), if picture.not_shown == 1 { "is" } else { "are" });
        console.note(format_args!("{what} {are} not finite and {are} not shown"));
    }
    let [width, height] = picture.size;
    let text = format!("{}: {width}x{height}\n", args.output.display());
    let json = json!({
        "file": files::text(&args.output), "width": width, "height": height, "not_shown": picture.not_shown,
    });
    let bytes = console.apart(&args.run, "encoding the picture", move || png(&picture))??;
    Writer::new(write, &args.run, console).bytes(output, &bytes)?;
    console.report(&text, &json);
    Ok(())
}

/// Writes a picture of a benchmark.
pub fn write_png(path: &Path, picture: &Picture) -> Result<()> {
    files::write(path, png(picture)?)
}

/// The bytes of a PNG file.
pub fn png(picture: &Picture) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.size[0] as u32, picture.size[1] as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder
        .write_header()
        .and_then(|mut w| w.write_image_data(&picture.rgb))
        .context("cannot encode the picture")?;
    Ok(bytes)
}
