//! A small glTF file with nearly all that one can hold, and what looks into such files.

use serde_json::{Value, json};
use std::path::Path;

/// The JSON of a file and its buffer.
pub struct Gltf {
    pub json: Value,
    pub buffer: Vec<u8>,
}

/// The bytes of rows of floats.
pub fn floats(rows: &[f32]) -> Vec<u8> {
    rows.iter().flat_map(|c| c.to_le_bytes()).collect()
}

impl Gltf {
    /// Adds bytes as a view; its number.
    pub fn view(&mut self, bytes: &[u8], more: Value) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len() });
        view.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        self.buffer.extend_from_slice(bytes);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        views.len() - 1
    }

    /// Adds an accessor of a view of its own; its number.
    pub fn rows(&mut self, bytes: &[u8], about: Value) -> usize {
        let view = self.view(bytes, json!({}));
        self.accessor(view, about)
    }

    pub fn accessor(&mut self, view: usize, mut about: Value) -> usize {
        about["bufferView"] = view.into();
        let all = self.json["accessors"].as_array_mut().unwrap();
        all.push(about);
        all.len() - 1
    }

    pub fn image(&mut self, name: &str, png: &[u8]) {
        let view = self.view(png, json!({}));
        let image = json!({ "name": name, "mimeType": "image/png", "bufferView": view });
        self.json["images"].as_array_mut().unwrap().push(image);
    }

    /// As the bytes of a GLB.
    pub fn glb(mut self) -> Vec<u8> {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.json["buffers"] = json!([{ "byteLength": self.buffer.len(), "name": "all" }]);
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let word = |n: usize| (n as u32).to_le_bytes();
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend(word(28 + text.len() + self.buffer.len()));
        out.extend(word(text.len()).iter().chain(b"JSON"));
        out.extend(&text);
        out.extend(word(self.buffer.len()).iter().chain(b"BIN\0"));
        out.extend(&self.buffer);
        out
    }

    /// Reads a GLB, or a glTF file with one buffer beside it.
    pub fn read(path: &Path) -> Self {
        let data = std::fs::read(path).unwrap();
        if !data.starts_with(b"glTF") {
            let json: Value = serde_json::from_slice(&data).unwrap();
            let name = json["buffers"][0]["uri"].as_str().unwrap();
            let buffer = std::fs::read(path.with_file_name(name)).unwrap();
            return Self { json, buffer };
        }
        let word = |at: usize| u32::from_le_bytes(data[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!([word(4), word(8)], [2, data.len()]);
        let binary = 20 + word(12);
        assert_eq!([word(12) % 4, word(binary) % 4, binary + 8 + word(binary)], [0, 0, data.len()]);
        let json = serde_json::from_slice(&data[20..binary]).unwrap();
        Self { json, buffer: data[binary + 8..].to_vec() }
    }

    /// The bytes behind a view.
    fn bytes(&self, view: &Value) -> &[u8] {
        let view = &self.json["bufferViews"][at(view)];
        let from = at(&view["byteOffset"]);
        &self.buffer[from..from + at(&view["byteLength"])]
    }

    /// The rows of an accessor, and checks that they are where the format allows.
    pub fn rows_of(&self, accessor: &Value) -> Vec<Vec<u8>> {
        let a = &self.json["accessors"][at(accessor)];
        let number = bytes_of(&a["componentType"]);
        let width = ["", "SCALAR", "VEC2", "VEC3", "VEC4"].iter().position(|t| a["type"] == *t);
        let row = number * width.map_or(16, |w| w);
        let mut rows = vec![vec![0; row]; at(&a["count"])];
        if a.get("bufferView").is_some() {
            let view = &self.json["bufferViews"][at(&a["bufferView"])];
            let stride = view["byteStride"].as_u64().map_or(row, |s| s as usize);
            let from = at(&a["byteOffset"]);
            assert_eq!((at(&view["byteOffset"]) + from) % number, 0, "a wrong alignment");
            assert!(view["target"] != 34962 || stride.is_multiple_of(4), "vertices at odd places");
            let bytes = self.bytes(&a["bufferView"]);
            for (i, r) in rows.iter_mut().enumerate() {
                r.copy_from_slice(&bytes[from + i * stride..from + i * stride + row]);
            }
        }
        if let Some(sparse) = a.get("sparse") {
            let indices = self.bytes(&sparse["indices"]["bufferView"]);
            let values = self.bytes(&sparse["values"]["bufferView"]);
            for (i, value) in indices.chunks(2).zip(values.chunks(row)) {
                rows[usize::from(u16::from_le_bytes([i[0], i[1]]))] = value.to_vec();
            }
        }
        rows
    }

    /// The rows of a column at each corner of a primitive.
    pub fn by_corner(&self, primitive: &Value, accessor: &Value) -> Vec<Vec<u8>> {
        let rows = self.rows_of(accessor);
        let Some(indices) = primitive.get("indices") else { return rows };
        let corner = |i: Vec<u8>| {
            let mut bytes = [0; 4];
            bytes[..i.len()].copy_from_slice(&i);
            rows[u32::from_le_bytes(bytes) as usize].clone()
        };
        self.rows_of(indices).into_iter().map(corner).collect()
    }

    /// All primitives of all meshes.
    pub fn primitives(&self) -> Vec<&Value> {
        let meshes = self.json["meshes"].as_array().unwrap().iter();
        meshes.flat_map(|m| m["primitives"].as_array().unwrap()).collect()
    }

    /// The file of an image inside the buffer.
    pub fn png(&self, image: usize) -> &[u8] {
        self.bytes(&self.json["images"][image]["bufferView"])
    }
}

/// A number of the JSON; 0 where it is not there.
pub fn at(value: &Value) -> usize {
    value.as_u64().unwrap_or(0) as usize
}

/// Bytes of a number of this type.
fn bytes_of(component: &Value) -> usize {
    match component.as_u64().unwrap() {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        _ => 4,
    }
}
