//! The images of a file's materials, layer by layer.
//!
//! In: the places of materials that name textures, the primitives and their old texture coordinates. Out: the
//! layers that are drawn anew, and which places show which layer. Places of different names that show the
//! same images in the same way (occlusion and roughness in one image) share a layer.

use super::lost::{Findings, is_drawable};
use super::parts::{Block, Part, corners, is_right, json_of};
use super::slots::{Look, Slot};
use crate::error::Result;
use crate::gltf::accessor::{self, announced};
use crate::gltf::document::{Document, number};
use crate::input::Input;
use crate::layer::{Layer, NO_IMAGE};
use std::collections::BTreeMap;

/// Places that show one layer.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub slots: Vec<Slot>,
    /// How the layer looks on each material.
    looks: BTreeMap<usize, Look>,
    normals: bool,
}

impl Group {
    /// The images that it is drawn from.
    pub fn images(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self.looks.values().filter_map(|l| l.image).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Takes the places of `other`, where both show the same on some material and differ on none.
    fn joins(&mut self, other: &Group) -> bool {
        let mut both = self.looks.iter().filter_map(|(m, l)| Some((l, other.looks.get(m)?))).peekable();
        if self.normals != other.normals || both.peek().is_none() || both.any(|(a, b)| a != b) {
            return false;
        }
        self.looks.extend(&other.looks);
        self.slots.extend_from_slice(&other.slots);
        true
    }
}

/// The places that images can be drawn for, as groups.
fn groups(slots: Vec<Slot>) -> Vec<Group> {
    let mut by_path: Vec<Group> = Vec::new();
    for slot in slots {
        let of = by_path.iter().position(|g| g.slots[0].path == slot.path).unwrap_or_else(|| {
            let normals = slot.is_normals();
            by_path.push(Group { slots: Vec::new(), looks: BTreeMap::new(), normals });
            by_path.len() - 1
        });
        by_path[of].looks.insert(slot.material, slot.look);
        by_path[of].slots.push(slot);
    }
    let mut out: Vec<Group> = Vec::new();
    for group in by_path {
        if !out.iter_mut().any(|known| known.joins(&group)) {
            out.push(group);
        }
    }
    out
}

/// What is drawn anew.
#[derive(Default)]
pub(super) struct Textures {
    pub groups: Vec<Group>,
    /// One per group.
    pub layers: Vec<Layer>,
    /// Places whose images cannot be drawn.
    pub undrawn: Vec<Slot>,
}

/// What the textures are looked up for.
pub(super) struct Surface<'a> {
    pub file: &'a Document<'a>,
    pub parts: &'a [Part],
    pub blocks: &'a [Block],
}

/// The layers of the materials that the parts have. What stands in the way goes to `findings`.
pub(super) fn textures(
    input: &mut Input<'_>,
    surface: &Surface<'_>,
    slots: Vec<Slot>,
    findings: &mut Findings,
) -> Result<Textures> {
    let mut out = Textures::default();
    let mut bytes: BTreeMap<usize, Vec<u8>> = BTreeMap::new();
    let mut drawn = Vec::new();
    for slot in slots {
        if !surface.parts.iter().any(|p| p.material == Some(slot.material)) {
            continue;
        }
        let Some(id) = slot.look.image else {
            findings.undrawable(slot.texture);
            out.undrawn.push(slot);
            continue;
        };
        if let std::collections::btree_map::Entry::Vacant(place) = bytes.entry(id) {
            let Some(image) = surface.file.image(input, id) else {
                findings.missing_image(surface.file, id);
                continue;
            };
            place.insert(image);
        }
        if is_drawable(&bytes[&id]) {
            drawn.push(slot);
        } else {
            findings.undrawable(slot.texture);
            out.undrawn.push(slot);
        }
    }
    out.groups = groups(drawn);
    let mut names: Vec<String> = Vec::new();
    for group in &out.groups {
        let mut layer = laid(input, surface, group, findings)?;
        for id in group.images() {
            input.reserve(bytes[&id].len(), 1)?;
            layer.images.push(bytes[&id].clone());
        }
        // Files are named after layers.
        while names.contains(&layer.name) {
            layer.name.push('_');
        }
        names.push(layer.name.clone());
        out.layers.push(layer);
    }
    Ok(out)
}

/// A layer without its images: which image each triangle has, and where its corners lie.
fn laid(
    input: &mut Input<'_>,
    surface: &Surface<'_>,
    group: &Group,
    findings: &mut Findings,
) -> Result<Layer> {
    let triangles: usize = surface.parts.iter().map(|p| p.triangles).sum();
    input.reserve(triangles, size_of::<[[f32; 2]; 3]>() + size_of::<u32>())?;
    let mut layer = Layer {
        name: group.slots[0].path.last().cloned().unwrap_or_default(),
        images: Vec::new(),
        face_image: vec![NO_IMAGE; triangles],
        corner_uv: vec![[[0.0; 2]; 3]; triangles],
        normals: group.normals,
    };
    let images = group.images();
    let mut first = 0;
    for part in surface.parts {
        let look = part.material.and_then(|m| group.looks.get(&m));
        if let Some(look) = look
            && let Some(image) = look.image.and_then(|id| images.binary_search(&id).ok())
            && let Some(uv) = corner_uv(input, surface, part, look)?
        {
            let inside = |c: &f32| (-1e-3..=1.001).contains(c);
            if !look.repeats && !uv.as_flattened().as_flattened().iter().all(inside) {
                findings.clamped(images[image]);
            }
            for (t, uv) in uv.into_iter().take(part.triangles).enumerate() {
                layer.corner_uv[first + t] = uv;
                layer.face_image[first + t] = image as u32;
            }
        }
        first += part.triangles;
    }
    Ok(layer)
}

/// Where the corners of a part's triangles lie in an image, v up; `None` without those texture coordinates.
fn corner_uv(
    input: &mut Input<'_>,
    surface: &Surface<'_>,
    part: &Part,
    look: &Look,
) -> Result<Option<Vec<[[f32; 2]; 3]>>> {
    let file = surface.file;
    let vertices = surface.blocks[part.block].vertices;
    let name = format!("TEXCOORD_{}", look.set);
    let id = number(&json_of(&file.json, part)["attributes"][name]);
    let Some(id) = id.filter(|&id| announced(file, id) == Some(vertices)) else { return Ok(None) };
    let rows = accessor::read(input, file, id)?;
    if rows.width != 2 || rows.values.len() != 2 * vertices {
        return Ok(None);
    }
    let at = |v: u32| {
        let i = 2 * v as usize;
        let [u, v] = look.shift.moved([rows.values[i], rows.values[i + 1]]).map(|c| c as f32);
        [u, 1.0 - v].map(|c| if c.is_finite() { c } else { 0.0 })
    };
    let corners = corners(input, file, part, vertices)?;
    let turned = |t: [u32; 3]| if part.mirrored { [t[0], t[2], t[1]] } else { t };
    input.reserve(part.triangles, size_of::<[[f32; 2]; 3]>())?;
    Ok(Some(corners.triangles.into_iter().filter(is_right).map(|t| turned(t).map(at)).collect()))
}
