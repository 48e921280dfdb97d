//! glTF 2.0 (Khronos 2021).
//!
//! Read: see `read`. Written: one GLB with the texture inside. Vertices are split where texture coordinates differ
//! between corners. Positions are 32-bit floats in glTF: where that would lose digits they are stored relative to
//! their centre, which becomes the translation of the node. Vertex colours are linear light in glTF, sRGB in ours.

#[cfg(feature = "gltf")]
mod read;
mod write;

#[cfg(feature = "gltf")]
pub(crate) use read::read;
pub(crate) use write::write;

#[cfg(not(feature = "gltf"))]
pub(crate) fn read(input: &mut crate::load::Input<'_>) -> crate::Result<crate::load::Content> {
    Err(input.unsupported(
        "this is glTF, which this build does not read",
        "Build with the feature \"gltf\", or convert it to PLY",
    ))
}

/// sRGB to linear light (IEC 61966-2-1).
fn to_linear(c: f32) -> f32 {
    let c = f64::from(c);
    (if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }) as f32
}

/// Linear light to sRGB.
#[cfg(feature = "gltf")]
fn to_srgb(c: f32) -> f32 {
    let c = f64::from(c);
    (if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }) as f32
}
