//! The parts of a glTF file: its JSON and its buffers.

use super::uri::{base64, unescape};
use crate::error::{Location, Result};
use crate::input::Input;
use serde_json::Value;
use std::borrow::Cow;
use std::path::{Component, Path};

/// A file.
#[derive(Debug, Clone)]
pub(super) struct Document<'d> {
    pub json: Value,
    /// Bytes of memory that the JSON takes.
    pub json_bytes: usize,
    buffers: Vec<Cow<'d, [u8]>>,
}

/// The entries of a JSON array; none where it is not there.
pub(super) fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

/// A JSON value as an index or a count.
pub(super) fn number(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|v| usize::try_from(v).ok())
}

impl<'d> Document<'d> {
    /// Reads the JSON and gathers the buffers. Refuses files of other versions, and compressed ones.
    pub fn read(input: &mut Input<'d>) -> Result<Self> {
        let data = input.data;
        let Chunks { json, binary } =
            if data.starts_with(b"glTF") { chunks(input)? } else { Chunks { json: data, binary: None } };
        let json_bytes = json_bytes(json);
        input.reserve(json_bytes, 1)?;
        let json: Value = serde_json::from_slice(json).map_err(|e| {
            input.malformed(
                if data.starts_with(b"{") { Location::Line(e.line() as u64) } else { Location::Byte(20) },
                format!("JSON that cannot be read ({e})"),
                "the JSON of a glTF file",
                "The file is damaged: get it again",
            )
        })?;
        if !json["asset"]["version"].as_str().is_some_and(|v| v.starts_with('2')) {
            return Err(input.unsupported("this is not glTF 2", "Write it again as glTF 2.0"));
        }
        for extension in list(&json, "extensionsRequired").iter().filter_map(Value::as_str) {
            if matches!(extension, "KHR_draco_mesh_compression" | "EXT_meshopt_compression") {
                return Err(input.unsupported(
                    format!("the meshes are compressed ({extension})"),
                    "Write the file again without compression",
                ));
            }
        }
        let buffers = buffers(input, &json, binary)?;
        Ok(Self { json, json_bytes, buffers })
    }

    /// The bytes of a buffer view. `None` where they leave the buffer.
    pub fn view(&self, view: &Value) -> Option<&[u8]> {
        let from = number(&view["byteOffset"]).unwrap_or(0);
        let buffer = self.buffers.get(number(&view["buffer"])?)?;
        buffer.get(from..from.checked_add(number(&view["byteLength"])?)?)
    }

    /// The bytes of all buffers.
    pub fn buffers(&self) -> &[Cow<'d, [u8]>] {
        &self.buffers
    }

    /// The same with bytes of its own.
    pub fn into_owned(self, input: &mut Input<'_>) -> Result<Document<'static>> {
        let mut buffers = Vec::new();
        for buffer in self.buffers {
            if let Cow::Borrowed(bytes) = buffer {
                input.reserve(bytes.len(), 1)?;
            }
            buffers.push(Cow::Owned(buffer.into_owned()));
        }
        Ok(Document { json: self.json, json_bytes: self.json_bytes, buffers })
    }

    /// The files that this one names.
    pub fn files(&self) -> Vec<String> {
        let named = ["buffers", "images"].into_iter().flat_map(|key| list(&self.json, key));
        let uris = named.filter_map(|v| v["uri"].as_str()).filter(|uri| !uri.starts_with("data:"));
        uris.map(unescape).collect()
    }

    /// The image of the first material that has a base colour texture.
    pub fn texture(&self, input: &mut Input<'_>) -> Option<Vec<u8>> {
        let of = |m: &Value| number(&m["pbrMetallicRoughness"]["baseColorTexture"]["index"]);
        let id = list(&self.json, "materials").iter().find_map(of)?;
        let image = list(&self.json, "textures").get(id).and_then(|t| number(&t["source"]))?;
        self.image(input, image)
    }

    /// The bytes of an image.
    pub fn image(&self, input: &mut Input<'_>, id: usize) -> Option<Vec<u8>> {
        let image = list(&self.json, "images").get(id)?;
        match image["uri"].as_str() {
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => {
                    input.reserve(data.len() / 4, 3).ok()?;
                    base64(data.split_once(',')?.1.as_bytes())
                }
                None => input.beside(&unescape(uri)),
            },
            None => {
                let bytes = self.view(list(&self.json, "bufferViews").get(number(&image["bufferView"])?)?)?;
                input.reserve(bytes.len(), 1).ok()?;
                Some(bytes.to_vec())
            }
        }
    }
}

/// Bytes of memory that a JSON text takes when it is read, counted before it is: a rough upper bound. What an
/// array or an object costs is far more than its two brackets.
fn json_bytes(json: &[u8]) -> usize {
    /// An array: room for four values.
    const ARRAY: usize = 360;
    /// An object: room for four names and values, and the table that finds them.
    const OBJECT: usize = 640;
    /// A further value of an array or an object; vectors have room for up to twice as many.
    const VALUE: usize = 160;
    /// A name or text beside its letters.
    const TEXT: usize = 48;
    let (mut sum, mut at) = (json.len(), 0);
    while let Some(&byte) = json.get(at) {
        at += 1;
        sum += match byte {
            b'[' => ARRAY,
            b'{' => OBJECT,
            b',' => VALUE,
            b'"' => {
                // To the quote that ends it: one without an odd number of backslashes before it.
                while let Some(&inside) = json.get(at) {
                    at += if inside == b'\\' { 2 } else { 1 };
                    if inside == b'"' {
                        break;
                    }
                }
                TEXT
            }
            _ => 0,
        };
    }
    sum
}

/// The chunks of a GLB.
struct Chunks<'d> {
    json: &'d [u8],
    binary: Option<&'d [u8]>,
}

fn chunks<'d>(input: &Input<'d>) -> Result<Chunks<'d>> {
    let data = input.data;
    let word =
        |at: usize| data.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let cut = |at: usize, expected: &str| {
        input.malformed(
            Location::Byte(at as u64),
            "a chunk longer than the file",
            expected,
            "The file is cut off: get it again",
        )
    };
    let chunk = |at: usize| -> Option<(&[u8], &[u8])> {
        let body = data.get(at + 8..(at + 8).checked_add(word(at)?)?)?;
        Some((data.get(at + 4..at + 8)?, body))
    };
    let Some((b"JSON", json)) = chunk(12) else { return Err(cut(12, "a JSON chunk")) };
    let next = 20 + json.len().next_multiple_of(4);
    let binary = match chunk(next) {
        Some((b"BIN\0", body)) => Some(body),
        None if next + 8 <= data.len() => return Err(cut(next, "a binary chunk")),
        _ => None,
    };
    Ok(Chunks { json, binary })
}

/// The bytes of all buffers: the binary chunk, base64 in the JSON, or files beside this one.
fn buffers<'d>(input: &mut Input<'d>, json: &Value, binary: Option<&'d [u8]>) -> Result<Vec<Cow<'d, [u8]>>> {
    let mut out = Vec::new();
    for (i, buffer) in list(json, "buffers").iter().enumerate() {
        let place = format!("buffer {i}");
        let Some(uri) = buffer["uri"].as_str() else {
            out.push(Cow::Borrowed(if i == 0 { binary.unwrap_or_default() } else { &[] }));
            continue;
        };
        let bytes = if let Some(rest) = uri.strip_prefix("data:") {
            input.reserve(rest.len() / 4, 3)?;
            rest.split_once(',').and_then(|(_, text)| base64(text.as_bytes()))
        } else {
            // Files beside this one only: a model has no business anywhere else.
            let name = unescape(uri);
            let path = Path::new(&name);
            let inside = path.components().all(|c| matches!(c, Component::Normal(_)));
            if !inside {
                return Err(input.unsupported(
                    format!("{place} names a file outside of the folder ({name})"),
                    "Put the file beside the glTF file, or write a GLB",
                ));
            }
            let path = input.path.with_file_name("").join(path);
            if let Ok(about) = std::fs::metadata(&path) {
                input.reserve(about.len() as usize, 1)?;
            }
            std::fs::read(path).ok()
        };
        let Some(bytes) = bytes else {
            return Err(input.unsupported(
                format!("{place} cannot be read ({})", uri.chars().take(60).collect::<String>()),
                "Put the file that it names beside the glTF file, or write a GLB",
            ));
        };
        out.push(Cow::Owned(bytes));
    }
    Ok(out)
}
