//! Where the JSON of a file names accessors, buffer views and images by number.
//!
//! In: the JSON. Out: each such number, to be read or changed. What extensions that are not known name is not
//! among them: where there are such, numbers of what stays never change.

use crate::gltf::document::{list, number};
use serde_json::Value;

/// Calls `each` with every entry of a list or object.
fn each_of(value: Option<&mut Value>, each: &mut dyn FnMut(&mut Value)) {
    match value {
        Some(Value::Array(all)) => all.iter_mut().for_each(each),
        Some(Value::Object(all)) => all.iter_mut().map(|(_, v)| v).for_each(each),
        _ => {}
    }
}

/// Calls `each` with the value of a name.
fn one(value: &mut Value, key: &str, each: &mut dyn FnMut(&mut Value)) {
    if let Some(v) = value.get_mut(key) {
        each(v);
    }
}

/// Calls `each` with every number of an accessor.
pub(super) fn accessors(json: &mut Value, each: &mut dyn FnMut(&mut Value)) {
    each_of(json.get_mut("meshes"), &mut |mesh| {
        each_of(mesh.get_mut("primitives"), &mut |primitive| {
            one(primitive, "indices", each);
            each_of(primitive.get_mut("attributes"), each);
            each_of(primitive.get_mut("targets"), &mut |target| each_of(Some(target), each));
        });
    });
    each_of(json.get_mut("animations"), &mut |animation| {
        each_of(animation.get_mut("samplers"), &mut |sampler| {
            one(sampler, "input", each);
            one(sampler, "output", each);
        });
    });
    each_of(json.get_mut("skins"), &mut |skin| one(skin, "inverseBindMatrices", each));
    each_of(json.get_mut("nodes"), &mut |node| {
        each_of(node.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes"), each);
    });
}

/// Calls `each` with every number of a buffer view.
pub(super) fn views(json: &mut Value, each: &mut dyn FnMut(&mut Value)) {
    each_of(json.get_mut("accessors"), &mut |accessor| {
        one(accessor, "bufferView", each);
        for key in ["/sparse/indices", "/sparse/values"] {
            accessor.pointer_mut(key).into_iter().for_each(|v| one(v, "bufferView", each));
        }
    });
    each_of(json.get_mut("images"), &mut |image| one(image, "bufferView", each));
}

/// Calls `each` with every number of an image.
pub(super) fn images(json: &mut Value, each: &mut dyn FnMut(&mut Value)) {
    each_of(json.get_mut("textures"), &mut |texture| {
        one(texture, "source", each);
        each_of(texture.get_mut("extensions"), &mut |extension| one(extension, "source", each));
    });
}

/// A PNG file of one white texel.
const WHITE: &str = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR42mP4DwABAQEAHLCM\
    mQAAAABJRU5ErkJggg==";

/// Calls a function with every number of the JSON that names an entry of a list.
type EachNumber = fn(&mut Value, &mut dyn FnMut(&mut Value));

/// A list whose entries are named by number.
#[derive(Clone, Copy)]
pub(super) struct List {
    pub key: &'static str,
    each: EachNumber,
    /// What stands in the place of an entry that nobody names any more, where it is not the last.
    idle: fn() -> Value,
}

pub(super) const ACCESSORS: List = List {
    key: "accessors",
    each: accessors,
    idle: || serde_json::json!({ "componentType": 5126, "count": 1, "type": "SCALAR" }),
};
pub(super) const VIEWS: List =
    List { key: "bufferViews", each: views, idle: || serde_json::json!({ "buffer": 0, "byteLength": 1 }) };
pub(super) const IMAGES: List = List {
    key: "images",
    each: images,
    idle: || serde_json::json!({ "uri": format!("data:image/png;base64,{WHITE}") }),
};

impl List {
    /// The entries of the list; it is made where it is not there.
    pub fn entries<'v>(&self, json: &'v mut Value) -> Option<&'v mut Vec<Value>> {
        let value = json.as_object_mut()?.entry(self.key).or_insert(Value::Null);
        if !value.is_array() {
            *value = Value::Array(Vec::new());
        }
        value.as_array_mut()
    }

    /// Which entries are named; the numbers of those that are but are not there.
    pub fn named(&self, json: &mut Value) -> Named {
        let mut named = Named { is: vec![false; list(json, self.key).len()], beyond: None };
        (self.each)(json, &mut |v| match number(v) {
            Some(id) if id < named.is.len() => named.is[id] = true,
            Some(id) => named.beyond = Some(id),
            None => {}
        });
        named
    }

    /// Puts the entries from `old.is.len()` on in the places of those that `old` says were named and that are
    /// not any more: entry i of them first where `like[i]` was. Places that are left over go where `closes`,
    /// else they stay idle unless they are the last. Gives the places of the new entries.
    pub fn settle(&self, json: &mut Value, old: &Named, like: &[Option<usize>], closes: bool) -> Vec<usize> {
        let now = self.named(json);
        let first = old.is.len();
        let mut free: Vec<bool> = (0..first).map(|i| old.is[i] && !now.is[i]).collect();
        let mut places: Vec<Option<usize>> = vec![None; like.len()];
        for (place, like) in places.iter_mut().zip(like) {
            *place = like.filter(|&l| l < first && std::mem::take(&mut free[l]));
        }
        let mut left = (0..first).filter(|&i| free[i]);
        let mut beyond = first..;
        let places: Vec<usize> = places
            .into_iter()
            .map(|p| p.or_else(|| left.next()).or_else(|| beyond.next()).unwrap_or(first))
            .collect();
        let idle: Vec<usize> = left.collect();
        let Some(entries) = self.entries(json) else { return places };
        let mut new = entries.split_off(first.min(entries.len()));
        entries.resize(places.iter().map(|p| p + 1).max().unwrap_or(0).max(entries.len()), Value::Null);
        places.iter().zip(new.drain(..)).for_each(|(&place, entry)| entries[place] = entry);
        for &i in idle.iter().rev() {
            if closes || i + 1 == entries.len() {
                entries.remove(i);
            } else {
                entries[i] = (self.idle)();
            }
        }
        if entries.is_empty() {
            json.as_object_mut().into_iter().for_each(|o| drop(o.shift_remove(self.key)));
        }
        // What stood behind a gap moved up.
        let gaps = if closes { &idle[..] } else { &[] };
        let moved = |place: usize| place - gaps.partition_point(|&gap| gap < place);
        let places: Vec<usize> = places.into_iter().map(moved).collect();
        (self.each)(json, &mut |v| {
            if let Some(id) = number(v) {
                let new = id.checked_sub(first).and_then(|i| places.get(i).copied());
                *v = new.unwrap_or_else(|| moved(id)).into();
            }
        });
        places
    }
}

/// Which entries of a list are named.
pub(super) struct Named {
    pub is: Vec<bool>,
    /// A number that no entry has.
    pub beyond: Option<usize>,
}
