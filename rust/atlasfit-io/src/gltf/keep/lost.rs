//! What of a file cannot be kept once its texture coordinates are others.
//!
//! In: the JSON of a file. Out: what is lost, in words, and what it names and is not there.

use super::extensions::COMPRESSED;
use super::slots::Slot;
use crate::gltf::document::{Document, list, number};
use crate::gltf::primitive::Primitive;
use serde_json::Value;

/// What was found.
#[derive(Default)]
pub(super) struct Findings {
    /// What the output does not keep.
    pub lost: Vec<String>,
    /// What cannot be read and stays named.
    pub missing: Vec<String>,
}

/// Adds a text that is not there yet.
fn add(to: &mut Vec<String>, text: String) {
    if !to.contains(&text) {
        to.push(text);
    }
}

/// Whether images of this kind can be drawn anew: PNG and JPEG.
pub(super) fn is_drawable(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xFF, 0xD8]) || bytes.starts_with(b"\x89PNG")
}

impl Findings {
    pub fn undrawable(&mut self, texture: usize) {
        add(&mut self.lost, format!("texture {texture}, whose image is neither PNG nor JPEG"));
    }

    pub fn clamped(&mut self, image: usize) {
        add(
            &mut self.lost,
            format!("what texture coordinates beyond image {image} show: it does not repeat"),
        );
    }

    pub fn missing_image(&mut self, file: &Document<'_>, id: usize) {
        let uri = list(&file.json, "images").get(id).and_then(|i| i["uri"].as_str());
        let name = uri.filter(|uri| !uri.starts_with("data:")).unwrap_or("of the file itself");
        add(&mut self.missing, format!("image {id} ({})", name.chars().take(60).collect::<String>()));
    }

    /// Looks through the JSON of a file.
    pub fn look_through(&mut self, json: &Value, slots: &[Slot]) {
        let textured = |m: usize| slots.iter().any(|s| s.material == m);
        for primitive in list(json, "meshes").iter().flat_map(|m| list(m, "primitives")) {
            let is_surface = Primitive::of(primitive).is_none_or(|p| p.is_triangles());
            if !is_surface && number(&primitive["material"]).is_some_and(textured) {
                add(&mut self.lost, "textures on points or lines".into());
            }
            let moves_uv = |t: &Value| t.as_object().is_some_and(|t| t.keys().any(|k| k == "TEXCOORD_0"));
            if is_surface && list(primitive, "targets").iter().any(moves_uv) {
                add(&mut self.lost, "morph targets of texture coordinates".into());
            }
            for (name, value) in primitive["extensions"].as_object().into_iter().flatten() {
                if name != "KHR_materials_variants" {
                    add(&mut self.lost, format!("{name}, which may say something of vertices"));
                } else if list(value, "mappings").iter().filter_map(|m| number(&m["material"])).any(textured)
                {
                    add(&mut self.lost, "variants of materials that have textures".into());
                }
            }
        }
        let anisotropy = |m: &Value| m["extensions"].get("KHR_materials_anisotropy").is_some();
        if list(json, "materials").iter().any(anisotropy) {
            add(&mut self.lost, "directions of anisotropy, which follow the texture coordinates".into());
        }
        let moves_textures = |c: &Value| {
            let pointer = &c["target"]["extensions"]["KHR_animation_pointer"]["pointer"];
            pointer.as_str().is_some_and(|p| p.contains("KHR_texture_transform"))
        };
        if list(json, "animations").iter().flat_map(|a| list(a, "channels")).any(moves_textures) {
            add(&mut self.lost, "animations that move textures".into());
        }
        let used = list(json, "extensionsUsed").iter().filter_map(Value::as_str);
        for name in used.filter(|name| COMPRESSED.contains(name)) {
            add(&mut self.lost, format!("the compressed copy of the data ({name})"));
        }
    }
}
