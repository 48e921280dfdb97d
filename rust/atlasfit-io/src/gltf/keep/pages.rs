//! New images for a file's materials.
//!
//! In: the JSON of a file, its groups of places that name textures, and a PNG file for each. Out: the JSON
//! with textures that show those, through the first set of texture coordinates.

use super::edit::Edit;
use super::extensions::drop_extensions;
use super::refs::IMAGES;
use super::slots::{Slot, slots};
use super::textures::Group;
use crate::gltf::document::list;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// A new image.
#[derive(Clone, Copy)]
pub(crate) struct Page<'p> {
    /// The bytes of a PNG file.
    pub bytes: &'p [u8],
    /// The file that is to hold it; `None` = the buffer.
    pub file: Option<&'p str>,
}

/// Which group shows each texture; `None` where several do, or a place of no group.
fn owners(json: &Value, groups: &[Group]) -> BTreeMap<usize, Option<usize>> {
    let mut out: BTreeMap<usize, Option<usize>> = BTreeMap::new();
    for slot in slots(json) {
        let same = |s: &Slot| s.material == slot.material && s.path == slot.path;
        let group = groups.iter().position(|g| g.slots.iter().any(same));
        let owner = out.entry(slot.texture).or_insert(group);
        if *owner != group {
            *owner = None;
        }
    }
    out
}

/// Puts the pages in the place of the images of their groups.
pub(super) fn replace(edit: &mut Edit<'_>, groups: &[Group], pages: &[Page<'_>]) {
    let owners = owners(&edit.json, groups);
    // Pages of fewer images than there were take the first places, so that none in between is left over.
    let as_many = groups.iter().all(|g| g.images().len() == 1);
    for (g, (group, page)) in groups.iter().zip(pages).enumerate() {
        let like = group.images().first().copied().filter(|_| as_many);
        let image = add_image(edit, group, page, like);
        let mut textures: BTreeMap<usize, usize> = BTreeMap::new();
        for slot in &group.slots {
            let texture = *textures.entry(slot.texture).or_insert_with(|| {
                let own = owners.get(&slot.texture) == Some(&Some(g));
                show(&mut edit.json, slot.texture, own, image)
            });
            if let Some(info) = slot.in_json(&mut edit.json).and_then(Value::as_object_mut) {
                info.insert("index".into(), texture.into());
                info.shift_remove("texCoord");
                drop_extensions(info, |name, _| name == "KHR_texture_transform");
            }
        }
    }
}

/// Adds an image that holds a page and replaces `like`; its number.
fn add_image(edit: &mut Edit<'_>, group: &Group, page: &Page<'_>, like: Option<usize>) -> usize {
    let images = group.images();
    // One that replaces a single image keeps its name.
    let mut object = match (&images[..], list(&edit.json, IMAGES.key)) {
        ([only], all) => all.get(*only).and_then(Value::as_object).cloned().unwrap_or_default(),
        _ => Map::new(),
    };
    ["uri", "bufferView", "mimeType", "extensions"].iter().for_each(|key| drop(object.shift_remove(*key)));
    object.insert("mimeType".into(), "image/png".into());
    match page.file {
        Some(name) => object.insert("uri".into(), name.into()),
        None => {
            object.insert("bufferView".into(), edit.add_view(page.bytes.to_vec(), None, json!({})).into())
        }
    };
    edit.add_image(object.into(), like)
}

/// A texture that shows an image: `texture` itself, or a copy where it is not the group's own. Its number.
fn show(json: &mut Value, texture: usize, own: bool, image: usize) -> usize {
    let Some(textures) = json.get_mut("textures").and_then(Value::as_array_mut) else { return texture };
    let mut number = texture;
    if !own && let Some(copy) = textures.get(texture).cloned() {
        number = textures.len();
        textures.push(copy);
    }
    if let Some(object) = textures.get_mut(number).and_then(Value::as_object_mut) {
        object.insert("source".into(), image.into());
        // Extensions that name the image in another format.
        drop_extensions(object, |_, value| value.get("source").is_some());
    }
    number
}

/// Takes the places off that name images which cannot be drawn.
pub(super) fn remove(json: &mut Value, undrawn: &[Slot]) {
    for slot in undrawn {
        let Some((name, path)) = slot.path.split_last() else { continue };
        let parent = Slot { path: path.to_vec(), ..slot.clone() };
        if let Some(object) = parent.in_json(json).and_then(Value::as_object_mut) {
            object.shift_remove(name);
        }
    }
}
