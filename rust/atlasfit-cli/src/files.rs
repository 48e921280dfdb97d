//! Reads input files and tells what had to be repaired; checks output names.

use crate::console::{Console, RunArgs, Usage};
use anyhow::{Context as _, Result};
use atlasfit::bake::Image;
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

/// Writes a file of a benchmark, in place: the other commands write beside the output first, then rename.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    std::fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}

/// An image as the bytes of a PNG file; without alpha where all of it is opaque.
pub fn png(image: &Image) -> Result<Vec<u8>> {
    let opaque = image.rgba.iter().all(|c| c[3] == 255);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width, image.height);
    encoder.set_color(if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    let rgb: Vec<u8> =
        if opaque { image.rgba.iter().flat_map(|c| [c[0], c[1], c[2]]).collect() } else { Vec::new() };
    let data = if opaque { &rgb[..] } else { image.rgba.as_flattened() };
    encoder.write_header().and_then(|mut w| w.write_image_data(data)).context("cannot encode the texture")?;
    Ok(bytes)
}

/// The image in the bytes of a PNG file.
pub fn read_png(bytes: &[u8]) -> Result<Image> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().context("the texture is no PNG")?;
    let size = reader.output_buffer_size().context("the texture is too large")?;
    let mut data = vec![0; size];
    let info = reader.next_frame(&mut data).context("the texture cannot be read")?;
    data.truncate(info.buffer_size());
    let rgba = match info.color_type {
        png::ColorType::Rgba => data.as_chunks::<4>().0.to_vec(),
        png::ColorType::Rgb => data.as_chunks::<3>().0.iter().map(|c| [c[0], c[1], c[2], 255]).collect(),
        png::ColorType::GrayscaleAlpha => {
            data.as_chunks::<2>().0.iter().map(|c| [c[0], c[0], c[0], c[1]]).collect()
        }
        _ => data.iter().map(|&g| [g, g, g, 255]).collect(),
    };
    Ok(Image { width: info.width, height: info.height, rgba })
}
