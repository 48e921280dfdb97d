//! Reads input files and tells what had to be repaired; PNG files in and out. `-` is standard input.

use crate::console::{Console, RunArgs, Usage};
use anyhow::{Context as _, Result};
use atlasfit::Stop;
use atlasfit::bake::Image;
use atlasfit_io::{Asset, Format, LoadOptions, Loaded};
use serde_json::{Value, json};
use std::io::Read as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// How input is read.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct InputArgs {
    /// Format of the input by its extension (ply, obj, las, ...), where its content must not decide
    #[arg(long, value_name = "FORMAT", value_parser = format_named, help_heading = "Files")]
    pub input_format: Option<Format>,
}

/// The format of an extension.
pub fn format_named(s: &str) -> Result<Format, String> {
    let path = Path::new("file").with_extension(s.trim_start_matches('.'));
    Format::from_path(&path).ok_or_else(|| "give ply, obj, off, stl, xyz, pcd, las, e57 or glb".into())
}

/// The name of standard input and of standard output.
pub const STANDARD: &str = "-";

/// A path as text, for JSON too: what is not UTF-8 is replaced.
pub fn text(path: &Path) -> String {
    path.display().to_string()
}

/// The name of a file without its folder.
pub fn name(path: &Path) -> String {
    text(path.file_name().map_or(path, Path::new))
}

/// Reads a cloud or mesh; repairs are notes.
pub fn load(path: &Path, args: &RunArgs, console: &Console) -> Result<Loaded> {
    load_as(path, None, args, console)
}

/// Reads a cloud or mesh of the format given, or of the one that its content says.
pub fn load_as(path: &Path, format: Option<Format>, args: &RunArgs, console: &Console) -> Result<Loaded> {
    let options = LoadOptions::default()
        .with_max_memory_bytes(args.max_memory)
        .with_format(format)
        .with_stop(console.stop(args));
    let loaded = if path == Path::new(STANDARD) {
        let data = standard_input(args, console)?;
        console.apart(args, "reading", move || {
            atlasfit_io::load_bytes("standard input".as_ref(), &data, &options)
        })??
    } else {
        let path = path.to_owned();
        console.apart(args, "reading", move || atlasfit_io::load(&path, &options))??
    };
    tell(path, &loaded, args, console)?;
    Ok(loaded)
}

/// Tells what had to be repaired.
fn tell(path: &Path, loaded: &Loaded, args: &RunArgs, console: &Console) -> Result<()> {
    for note in &loaded.report.notes {
        console.note(format_args!("{}: {note}", path.display()));
    }
    console.check(args, "reading")
}

/// A mesh, and the parts of its file that UVs do not touch.
pub struct Kept {
    pub loaded: Loaded,
    pub asset: Option<Asset>,
}

/// [`load_as`], with what is needed to write the file again with other UVs to a file of the format `output`;
/// `None` where it is not.
pub fn load_kept(
    path: &Path,
    format: Option<Format>,
    output: Option<Format>,
    args: &RunArgs,
    console: &Console,
) -> Result<Kept> {
    let Some(output) = output.filter(|_| path != Path::new(STANDARD)) else {
        return Ok(Kept { loaded: load_as(path, format, args, console)?, asset: None });
    };
    let options = LoadOptions::default()
        .with_max_memory_bytes(args.max_memory)
        .with_format(format)
        .with_stop(console.stop(args));
    let owned = path.to_owned();
    let (loaded, asset) =
        console.apart(args, "reading", move || atlasfit_io::load_asset(&owned, output, &options))??;
    tell(path, &loaded, args, console)?;
    Ok(Kept { loaded, asset })
}

/// All bytes of standard input, which may make us wait: another thread reads, so that Ctrl-C is heard.
fn standard_input(args: &RunArgs, console: &Console) -> Result<Vec<u8>> {
    static TAKEN: AtomicBool = AtomicBool::new(false);
    if TAKEN.swap(true, Ordering::Relaxed) {
        return Err(
            Usage("standard input can be read only once. Give a file for the other input".into()).into()
        );
    }
    let (give, take) = sync_channel::<std::io::Result<Vec<u8>>>(4);
    std::thread::spawn(move || {
        let mut input = std::io::stdin().lock();
        loop {
            let mut chunk = vec![0; 1 << 20];
            let read = input.read(&mut chunk);
            let over = !matches!(read, Ok(n) if n > 0);
            // Nobody listens any more once the command has ended.
            if give
                .send(read.map(|n| {
                    chunk.truncate(n);
                    chunk
                }))
                .is_err()
                || over
            {
                return;
            }
        }
    });
    let mut data = Vec::new();
    loop {
        console.check(args, "reading")?;
        match take.recv_timeout(Duration::from_millis(20)) {
            Ok(Ok(chunk)) if chunk.is_empty() => return Ok(data),
            Ok(chunk) => data.extend(chunk.context("cannot read standard input")?),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(data),
        }
        if let Some(most) = args.max_memory
            && data.len() as u64 > most
        {
            anyhow::bail!("standard input holds more bytes than the memory limit of {most}. Raise the limit");
        }
    }
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

/// Writes a file of a benchmark.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    Ok(atlasfit_io::write_file(path, content.as_ref(), &Stop::default())?)
}

/// [`png`], which Ctrl-C and the time limit end.
pub fn png_apart(image: Image, args: &RunArgs, console: &Console) -> Result<Vec<u8>> {
    console.apart(args, "encoding the texture", move || png(&image))?
}

/// An image as the bytes of a PNG file; without alpha where all of it is opaque.
fn png(image: &Image) -> Result<Vec<u8>> {
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

/// The image in the bytes of a PNG or JPEG file.
pub fn read_image(bytes: &[u8]) -> Result<Image> {
    if bytes.starts_with(&[0xFF, 0xD8]) { read_jpeg(bytes) } else { read_png(bytes) }
}

/// The image in the bytes of a JPEG file.
fn read_jpeg(bytes: &[u8]) -> Result<Image> {
    use zune_jpeg::zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};
    let rgba = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGBA);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), rgba);
    let data = decoder.decode().context("the JPEG image cannot be read")?;
    let info = decoder.info().context("the JPEG image has no size")?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    Ok(Image { width, height, rgba: data.as_chunks::<4>().0.to_vec() })
}

/// The image in the bytes of a PNG file.
fn read_png(bytes: &[u8]) -> Result<Image> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().context("the image is neither PNG nor JPEG")?;
    let size = reader.output_buffer_size().context("the image is too large")?;
    let mut data = vec![0; size];
    let info = reader.next_frame(&mut data).context("the image cannot be read")?;
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
