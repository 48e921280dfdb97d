//! glTF 2.0 (Khronos 2021).
//!
//! Read: see `read`. Written again with other UVs and all else as it is: see `keep`. Written anew: one GLB
//! with the texture inside, or, under a name that ends in .gltf, JSON with the buffer (.bin) and the texture
//! beside it. Vertices are split where texture coordinates differ between corners. Positions are 32-bit
//! floats in glTF: where that would lose digits they are stored relative to their centre, which becomes the
//! translation of the node. Vertex colours are linear light in glTF, sRGB in ours.

#[cfg(feature = "gltf")]
mod accessor;
mod color;
#[cfg(feature = "gltf")]
mod document;
#[cfg(feature = "gltf")]
mod instances;
#[cfg(feature = "gltf")]
pub(crate) mod keep;
#[cfg(feature = "gltf")]
mod matrix;
#[cfg(feature = "gltf")]
mod primitive;
#[cfg(feature = "gltf")]
mod read;
#[cfg(feature = "gltf")]
mod scene;
#[cfg(feature = "gltf")]
mod uri;
mod write;

#[cfg(feature = "gltf")]
pub(crate) use read::read;
pub(crate) use write::write;

#[cfg(not(feature = "gltf"))]
pub(crate) fn read(input: &mut crate::input::Input<'_>) -> crate::error::Result<crate::content::Content> {
    Err(input.unsupported(
        "this is glTF, which this build does not read",
        "Build with the feature \"gltf\", or convert it to PLY",
    ))
}
