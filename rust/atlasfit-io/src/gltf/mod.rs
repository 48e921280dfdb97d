//! glTF 2.0 (Khronos 2021).
//!
//! Written: one GLB with the texture inside. Vertices are split where texture coordinates differ between corners.
//! Positions are 32-bit floats in glTF: where that would lose digits they are stored relative to their centre,
//! which becomes the translation of the node. Vertex colours are linear light in glTF and sRGB in ours.

mod write;

pub(crate) use write::write;

use crate::error::Result;
use crate::load::{Content, Input};

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    Err(input.unsupported("this is glTF, which cannot be read yet", "Convert it to PLY or OBJ"))
}

/// sRGB to linear light (IEC 61966-2-1).
fn to_linear(c: f32) -> f32 {
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
