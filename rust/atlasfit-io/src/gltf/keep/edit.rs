//! The JSON of a file while it is edited, with the bytes of its new buffer views.
//!
//! In: a file, and what is to be added to it. Out: its JSON, where what is new has taken the places of what
//! nobody names any more, and the buffer.

use super::blob::Blob;
use super::extensions::{COMPRESSED, are_known, drop_extensions, drop_unused};
use super::refs::{ACCESSORS, IMAGES, List, Named, VIEWS};
use crate::gltf::document::Document;
use serde_json::{Map, Value};

/// Entries of a list that are new, behind its old ones.
struct New {
    list: List,
    /// What the old file names.
    old: Named,
    /// The old entry that each new one replaces.
    like: Vec<Option<usize>>,
}

impl New {
    fn of(list: List, json: &mut Value) -> Self {
        Self { list, old: list.named(json), like: Vec::new() }
    }

    /// Adds an entry; its number for now.
    fn add(&mut self, json: &mut Value, entry: Value, like: Option<usize>) -> usize {
        if let Some(entries) = self.list.entries(json) {
            entries.push(entry);
        }
        self.like.push(like);
        self.old.is.len() + self.like.len() - 1
    }

    fn settle(&self, json: &mut Value, closes: bool) -> Vec<usize> {
        self.list.settle(json, &self.old, &self.like, closes)
    }
}

/// A file that is edited.
pub(super) struct Edit<'k> {
    pub json: Value,
    pub file: &'k Document<'static>,
    accessors: New,
    images: New,
    views: New,
    /// The bytes of the new views.
    bytes: Vec<Vec<u8>>,
}

impl<'k> Edit<'k> {
    pub fn of(file: &'k Document<'static>) -> Self {
        let mut json = file.json.clone();
        let [accessors, images, views] = [ACCESSORS, IMAGES, VIEWS].map(|l| New::of(l, &mut json));
        Self { json, file, accessors, images, views, bytes: Vec::new() }
    }

    /// Adds a view of these bytes, which replaces `like` and says what `says` does besides. Its number.
    pub fn add_view(&mut self, bytes: Vec<u8>, like: Option<usize>, says: Value) -> usize {
        let old = like.and_then(|l| self.file.json["bufferViews"].get(l)).and_then(Value::as_object);
        let mut view = old.cloned().unwrap_or_default();
        ["byteOffset", "byteStride"].iter().for_each(|key| drop(view.shift_remove(*key)));
        view.insert("buffer".into(), 0.into());
        view.insert("byteLength".into(), bytes.len().into());
        if let Value::Object(more) = says {
            view.extend(more);
        }
        self.bytes.push(bytes);
        self.views.add(&mut self.json, view.into(), like)
    }

    /// Adds an accessor that replaces `like`. Its number.
    pub fn add_accessor(&mut self, accessor: Map<String, Value>, like: Option<usize>) -> usize {
        self.accessors.add(&mut self.json, accessor.into(), like)
    }

    /// Adds an image that replaces `like`. Its number.
    pub fn add_image(&mut self, image: Value, like: Option<usize>) -> usize {
        self.images.add(&mut self.json, image, like)
    }

    /// Gives what is new its places. `embed` gives the bytes of the images that are to move from their files
    /// into the buffer, `file` is the name of the buffer's own file.
    pub fn finish(mut self, embed: impl Fn(&str) -> Option<Vec<u8>>, file: Option<&str>) -> Finished<'k> {
        // What extensions that are not known may name stays where it is.
        let closes = are_known(&self.json);
        self.accessors.settle(&mut self.json, closes);
        self.images.settle(&mut self.json, closes);
        self.embed(embed);
        let places = self.views.settle(&mut self.json, closes);
        for object in VIEWS.entries(&mut self.json).into_iter().flatten().filter_map(Value::as_object_mut) {
            drop_extensions(object, |name, _| COMPRESSED.contains(&name));
        }
        let buffer = Blob::of(&mut self.json, self.file, places.into_iter().zip(self.bytes).collect());
        one_buffer(&mut self.json, buffer.len, file);
        drop_unused(&mut self.json);
        Finished { json: self.json, buffer }
    }

    fn embed(&mut self, embed: impl Fn(&str) -> Option<Vec<u8>>) {
        for i in 0..crate::gltf::document::list(&self.json, IMAGES.key).len() {
            let uri = self.json[IMAGES.key][i]["uri"].as_str().filter(|uri| !uri.starts_with("data:"));
            let Some(bytes) = uri.and_then(&embed) else { continue };
            let kind = match &bytes[..] {
                [0xFF, 0xD8, ..] => "image/jpeg",
                [b'R', b'I', b'F', b'F', ..] => "image/webp",
                [0xAB, b'K', b'T', b'X', ..] => "image/ktx2",
                _ => "image/png",
            };
            let view = self.add_view(bytes, None, Value::Null);
            if let Some(image) = self.json[IMAGES.key][i].as_object_mut() {
                image.shift_remove("uri");
                image.insert("mimeType".into(), kind.into());
                image.insert("bufferView".into(), view.into());
            }
        }
    }
}

/// An edited file.
pub(super) struct Finished<'k> {
    pub json: Value,
    pub buffer: Blob<'k>,
}

/// Says that there is one buffer, of this length and in this file.
fn one_buffer(json: &mut Value, length: usize, file: Option<&str>) {
    let mut buffer = json["buffers"][0].as_object().cloned().unwrap_or_default();
    drop_extensions(&mut buffer, |name, _| COMPRESSED.contains(&name));
    match file {
        Some(name) => drop(buffer.insert("uri".into(), name.into())),
        None => drop(buffer.shift_remove("uri")),
    }
    buffer.insert("byteLength".into(), length.into());
    if let Some(json) = json.as_object_mut() {
        json.insert("buffers".into(), vec![Value::from(buffer)].into());
    }
}
