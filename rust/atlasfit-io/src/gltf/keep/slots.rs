//! The places of materials that name textures.
//!
//! In: the JSON of a file. Out: each such place with its texture, its image and its texture coordinates.

use crate::gltf::document::{list, number};
use serde_json::Value;

/// How `KHR_texture_transform` moves texture coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shift {
    scale: [f64; 2],
    /// In radians.
    rotation: f64,
    offset: [f64; 2],
}

impl Shift {
    fn of(extension: &Value) -> Self {
        let pair = |key: &str, else_: f64| {
            let at = |k: usize| extension[key][k].as_f64().unwrap_or(else_);
            [at(0), at(1)]
        };
        let rotation = extension["rotation"].as_f64().unwrap_or(0.0);
        Self { scale: pair("scale", 1.0), rotation, offset: pair("offset", 0.0) }
    }

    /// Texture coordinates as they are looked up; v down.
    pub fn moved(&self, uv: [f64; 2]) -> [f64; 2] {
        let [u, v] = [uv[0] * self.scale[0], uv[1] * self.scale[1]];
        let (sin, cos) = self.rotation.sin_cos();
        [cos * u + sin * v + self.offset[0], cos * v - sin * u + self.offset[1]]
    }
}

/// What a texture looks like on the faces of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Look {
    /// The image; `None` where the texture names none that every reader knows.
    pub image: Option<usize>,
    /// Which set of texture coordinates.
    pub set: usize,
    pub shift: Shift,
    /// Whether the image repeats beyond its border.
    pub repeats: bool,
}

/// A place of a material that names a texture.
#[derive(Debug, Clone)]
pub(super) struct Slot {
    pub material: usize,
    /// The names that lead to it from the material.
    pub path: Vec<String>,
    pub texture: usize,
    pub look: Look,
}

impl Slot {
    /// Whether the image is a normal map.
    pub fn is_normals(&self) -> bool {
        self.path.last().is_some_and(|name| name.to_lowercase().contains("normal"))
    }

    /// The place in the JSON of a file.
    pub fn in_json<'v>(&self, json: &'v mut Value) -> Option<&'v mut Value> {
        let material = json.get_mut("materials")?.get_mut(self.material)?;
        self.path.iter().try_fold(material, |value, key| value.get_mut(key))
    }
}

/// All places of all materials.
pub(super) fn slots(json: &Value) -> Vec<Slot> {
    let mut out = Vec::new();
    for (material, value) in list(json, "materials").iter().enumerate() {
        visit(json, value, &mut Vec::new(), &mut |path, texture, look| {
            out.push(Slot { material, path: path.to_vec(), texture, look });
        });
    }
    out
}

fn visit(json: &Value, value: &Value, path: &mut Vec<String>, each: &mut dyn FnMut(&[String], usize, Look)) {
    // What a program notes for itself names nothing.
    for (key, value) in value.as_object().into_iter().flatten().filter(|(k, _)| *k != "extras") {
        path.push(key.clone());
        match number(&value["index"]) {
            Some(texture) if key.ends_with("Texture") => each(path, texture, look(json, value, texture)),
            _ => visit(json, value, path, each),
        }
        path.pop();
    }
}

fn look(json: &Value, info: &Value, texture: usize) -> Look {
    const REPEAT: u64 = 10497;
    let texture = list(json, "textures").get(texture);
    let extension = &info["extensions"]["KHR_texture_transform"];
    let set = number(&extension["texCoord"]).or_else(|| number(&info["texCoord"])).unwrap_or(0);
    let sampler = texture.and_then(|t| list(json, "samplers").get(number(&t["sampler"])?));
    let repeats = |key: &str| sampler.is_none_or(|s| s[key].as_u64().unwrap_or(REPEAT) == REPEAT);
    Look {
        image: texture.and_then(|t| number(&t["source"])),
        set,
        shift: Shift::of(extension),
        repeats: repeats("wrapS") && repeats("wrapT"),
    }
}
