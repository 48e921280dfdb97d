//! The extensions of a file: those that an edit takes off, and whether all are known.
//!
//! In: the JSON of a file, or an object of it. Out: the same without them, and without their names in the
//! lists of those that are used where nothing has them any more.

use crate::gltf::document::list;
use serde_json::{Map, Value};

/// The extensions of compressed data, whose plain copy a file may hold too.
pub(super) const COMPRESSED: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Takes extensions off an object.
pub(super) fn drop_extensions(object: &mut Map<String, Value>, drops: impl Fn(&str, &Value) -> bool) {
    if let Some(extensions) = object.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.retain(|name, value| !drops(name, value));
        if extensions.is_empty() {
            object.shift_remove("extensions");
        }
    }
}

/// Takes extensions off the lists of those that are used which the edit may have taken from everywhere.
pub(super) fn drop_unused(json: &mut Value) {
    const TAKEN: [&str; 7] = [
        "KHR_texture_transform",
        "EXT_texture_webp",
        "EXT_texture_avif",
        "KHR_texture_basisu",
        "MSFT_texture_dds",
        COMPRESSED[0],
        COMPRESSED[1],
    ];
    let unused: Vec<&str> = TAKEN.into_iter().filter(|name| !has_key(json, name)).collect();
    for key in ["extensionsUsed", "extensionsRequired"] {
        let Some(names) = json.get_mut(key).and_then(Value::as_array_mut) else { continue };
        let before = names.len();
        names.retain(|n| !n.as_str().is_some_and(|n| unused.contains(&n)));
        if names.is_empty() && before > 0 {
            json.as_object_mut().into_iter().for_each(|o| drop(o.shift_remove(key)));
        }
    }
}

/// Whether an object anywhere in a value has this name.
fn has_key(value: &Value, key: &str) -> bool {
    match value {
        Value::Object(o) => o.contains_key(key) || o.values().any(|v| has_key(v, key)),
        Value::Array(a) => a.iter().any(|v| has_key(v, key)),
        _ => false,
    }
}

/// Whether the file uses only extensions that name no accessor, buffer view or image by number, or name those
/// that `refs` knows.
pub(super) fn are_known(json: &Value) -> bool {
    const KNOWN: [&str; 10] = [
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "KHR_lights_punctual",
        "KHR_mesh_quantization",
        "KHR_node_visibility",
        "EXT_texture_webp",
        "EXT_texture_avif",
        "MSFT_texture_dds",
        "EXT_mesh_gpu_instancing",
        "KHR_xmp_json_ld",
    ];
    let is_known = |name: &str| {
        name.starts_with("KHR_materials_") || KNOWN.contains(&name) || COMPRESSED.contains(&name)
    };
    list(json, "extensionsUsed").iter().filter_map(Value::as_str).all(is_known)
}
