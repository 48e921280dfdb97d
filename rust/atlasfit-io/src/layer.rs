//! Images that a file's materials put on its faces: what a reader gives, and who draws them anew takes.

/// What [`Layer::face_image`] holds for a face without an image: that of the core.
pub(crate) const NO_IMAGE: u32 = atlasfit::bake::NO_IMAGE;

/// Images of one kind that the materials of a file put on its faces.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Layer {
    /// What the images say, as the file has it: `map_kd`, `baseColorTexture`, ...
    pub name: String,
    /// The bytes of the image files.
    pub images: Vec<Vec<u8>>,
    /// The image of each triangle; `u32::MAX` for one without.
    pub face_image: Vec<u32>,
    /// Where the corners of each triangle lie in its image, v up.
    pub corner_uv: Vec<[[f32; 2]; 3]>,
    /// Whether the images are normal maps.
    pub normals: bool,
}
