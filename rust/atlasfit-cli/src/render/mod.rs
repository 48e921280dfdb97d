//! A small software renderer: people and tests look at results with it.
//!
//! In: a mesh (without triangles: its points) and a [`Style`]. Out: RGB pixels. Everything is drawn at
//! [`canvas::OVER`] times the size and averaged.
//!
//! Each file imports only files that stand before it: `color`, `font`, `camera`, `canvas`, `style`, `scale`,
//! `shade`, then one file per kind of picture: `surface`, `points`, `uv`.

pub mod camera;
mod canvas;
pub mod color;
pub mod font;
mod points;
pub mod scale;
mod shade;
mod style;
mod surface;
mod uv;

use atlasfit::bake::Image;
use atlasfit::geometry::TriMesh;
use atlasfit::{Context, Error, Result};
pub use style::{Mode, Picture, Style};

/// Bytes for one pixel of the picture: its colour, and its share of the encoded file in a buffer that grows
/// to twice its size. Derived.
const BYTES_PER_PIXEL: usize = 3 + 2 * 3;
/// Bytes for one sample of a band: the primitive and its depth. Derived.
const BYTES_PER_SAMPLE: usize = 8;

/// Bytes that the pixels of a picture take at the peak: the picture, and a band for each thread.
pub fn bytes_of_pixels(style: &Style, threads: usize) -> u64 {
    let [width, height] = style.size;
    // UVs, and the borders of their charts twice.
    let canvases = if style.mode == Mode::Uv { 3 } else { 1 };
    // A row more above and below.
    let samples = (canvas::BAND + 2 * canvas::OVER) * canvas::OVER * width;
    (BYTES_PER_PIXEL * width * height + threads * canvases * BYTES_PER_SAMPLE * samples) as u64
}

/// Draws a mesh, in the light with its texture if there is one. Modes that need UVs or faces fail without
/// them.
pub fn render(mesh: &TriMesh, texture: Option<&Image>, style: &Style, ctx: &Context<'_>) -> Result<Picture> {
    mesh.validate()?;
    match style.mode {
        Mode::Points => points::points(mesh, style, ctx),
        Mode::Uncertainty if mesh.triangles.is_empty() => points::points(mesh, style, ctx),
        _ if mesh.triangles.is_empty() => Err(Error::EmptyInput {
            what: "there are no faces to show".into(),
            advice: "Show the points (--mode points)".into(),
        }),
        Mode::Uv => uv::uv_layout(mesh, style, ctx),
        _ => surface::surface(mesh, texture, style, ctx),
    }
}
