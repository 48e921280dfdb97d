//! Pictures as the encoder sees them: the object alone, in the middle of a square, brightness and cover.
//!
//! In: an image of any size, with alpha or on a plain background. Out: side x side x 2 numbers, 0 to 255.

use crate::error::{Error, Result};
use crate::model::CHANNELS;
use atlasfit::bake::Image;
use atlasfit::geometry::TriMesh;
use atlasfit::run::Context;

/// How far a channel differs from the background's where something is: above the rounding of a picture that
/// is written as JPEG and read again.
const DIFFERENT: u8 = 12;
/// The share of the picture that is left free on every side, as the project's renderer leaves it.
const MARGIN: f64 = 0.04;

/// Draws meshes and reads files of images. The program implements it by its own renderer and decoders.
pub trait Painter: Sync {
    /// A mesh from a direction (azimuth and elevation in degrees, y up, 0 from +z), in the light, on a plain
    /// background, `side` x `side` pixels.
    ///
    /// # Errors
    /// Cancelled, out of time.
    fn draw(&self, mesh: &TriMesh, view: [f64; 2], side: usize, ctx: &Context<'_>)
    -> atlasfit::Result<Image>;

    /// The image in the bytes of a file.
    ///
    /// # Errors
    /// A text that says why there is none.
    fn read(&self, bytes: &[u8]) -> std::result::Result<Image, String>;
}

/// The picture of an image: its object is cut out and put in the middle of a square. `name` names it in
/// errors.
///
/// # Errors
/// [`Error::BadFile`] where nothing stands out from the background.
pub fn prepare(image: &Image, side: usize, name: &str) -> Result<Vec<u8>> {
    let bad = |what: &str| {
        let advice = "Give one object on a plain or transparent background";
        Error::bad_file(name.as_ref(), what.to_owned(), advice)
    };
    let [width, height] = [image.width as usize, image.height as usize];
    if width == 0 || height == 0 || image.rgba.len() != width * height {
        return Err(bad("the picture has no pixels"));
    }
    let cover = cover(image);
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for (i, _) in cover.iter().enumerate().filter(|(_, c)| **c >= 0.5) {
        let at = [i % width, i / width];
        low = [0, 1].map(|k| low[k].min(at[k]));
        high = [0, 1].map(|k| high[k].max(at[k] + 1));
    }
    if low[0] >= high[0] {
        return Err(bad("the picture is empty: all of it looks like background"));
    }
    // A square about the object, with the margin; what lies outside of the image is background.
    let extent = (high[0] - low[0]).max(high[1] - low[1]) as f64;
    let pixel = extent / (1.0 - 2.0 * MARGIN) / side as f64;
    let corner = [0, 1].map(|k| 0.5 * (low[k] + high[k]) as f64 - 0.5 * pixel * side as f64);
    let mut out = Vec::with_capacity(CHANNELS * side * side);
    for y in 0..side {
        for x in 0..side {
            let from = [corner[0] + x as f64 * pixel, corner[1] + y as f64 * pixel];
            out.extend(average(image, &cover, from, pixel));
        }
    }
    Ok(out)
}

/// How much of each pixel is covered, 0 to 1: alpha, or where all of it is opaque, whether the pixel differs
/// from the background, the colour that most of the border has.
fn cover(image: &Image) -> Vec<f32> {
    if image.rgba.iter().any(|c| c[3] < 255) {
        return image.rgba.iter().map(|c| f32::from(c[3]) / 255.0).collect();
    }
    let [width, height] = [image.width as usize, image.height as usize];
    let border = (0..width).flat_map(|x| [x, (height - 1) * width + x]);
    let border = border.chain((0..height).flat_map(|y| [y * width, y * width + width - 1]));
    let mut colors: Vec<[u8; 4]> = border.map(|i| image.rgba[i]).collect();
    colors.sort_unstable();
    let middle = |k: usize| {
        let mut channel: Vec<u8> = colors.iter().map(|c| c[k]).collect();
        channel.sort_unstable();
        channel[channel.len() / 2]
    };
    let background = [middle(0), middle(1), middle(2)];
    let differs = |c: &[u8; 4]| (0..3).any(|k| c[k].abs_diff(background[k]) > DIFFERENT);
    image.rgba.iter().map(|c| if differs(c) { 1.0 } else { 0.0 }).collect()
}

/// Brightness, where covered, and cover of a square of an image, averaged by area.
fn average(image: &Image, cover: &[f32], from: [f64; 2], size: f64) -> [u8; 2] {
    let sides = [image.width as usize, image.height as usize];
    let weights = |k: usize| -> Vec<(usize, f64)> {
        let (low, high) = (from[k].max(0.0), (from[k] + size).min(sides[k] as f64));
        let first = low as usize;
        let last = (high.ceil().max(0.0) as usize).min(sides[k]);
        (first..last).map(|i| (i, (high.min((i + 1) as f64) - low.max(i as f64)).max(0.0))).collect()
    };
    let (columns, mut light, mut covered) = (weights(0), 0.0, 0.0);
    for (y, wy) in weights(1) {
        for &(x, wx) in &columns {
            let i = y * sides[0] + x;
            let [r, g, b, _] = image.rgba[i].map(f64::from);
            let w = wx * wy * f64::from(cover[i]);
            // Luma of ITU-R BT.601.
            light += w * (0.299 * r + 0.587 * g + 0.114 * b);
            covered += w;
        }
    }
    let brightness = if covered > 0.0 { light / covered } else { 0.0 };
    [brightness.round() as u8, (255.0 * covered / (size * size)).round().min(255.0) as u8]
}
