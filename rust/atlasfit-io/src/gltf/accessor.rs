//! Accessors: rows of numbers in buffers, maybe with some rows replaced.

use super::document::{Document, list, number};
use crate::bytes::{scalar, size};
use crate::error::{Location, Result};
use crate::input::Input;
use atlasfit::geometry::ScalarKind;
use serde_json::Value;

/// The numbers of an accessor.
pub(super) struct Rows {
    /// Row after row.
    pub values: Vec<f64>,
    /// Numbers per row.
    pub width: usize,
}

/// How many rows that an accessor announces; what is there is checked when it is read.
pub(super) fn announced(file: &Document<'_>, id: usize) -> Option<usize> {
    number(&list(&file.json, "accessors").get(id)?["count"])
}

/// Rows as they stand in a buffer.
#[derive(Clone, Copy)]
pub(super) struct Packed<'b> {
    /// From the first row on, as far as the rows go.
    pub bytes: &'b [u8],
    /// Bytes from one row to the next.
    pub stride: usize,
    shape: Shape,
}

#[derive(Clone, Copy)]
pub(super) struct Shape {
    pub kind: ScalarKind,
    /// Numbers per row.
    pub width: usize,
    /// How many rows.
    pub count: usize,
}

/// The type of a component.
pub(super) fn kind_of(component: &Value) -> Option<ScalarKind> {
    Some(match component.as_u64()? {
        5120 => ScalarKind::I8,
        5121 => ScalarKind::U8,
        5122 => ScalarKind::I16,
        5123 => ScalarKind::U16,
        5125 => ScalarKind::U32,
        5126 => ScalarKind::F32,
        _ => return None,
    })
}

/// What normalised numbers of a type are divided by.
fn largest(kind: ScalarKind) -> f64 {
    match kind {
        ScalarKind::I8 => 127.0,
        ScalarKind::U8 => 255.0,
        ScalarKind::I16 => 32767.0,
        ScalarKind::U16 => 65535.0,
        _ => 1.0,
    }
}

/// The rows at `place`, which names a buffer view and an offset in it. `None` where they leave the buffer.
pub(super) fn packed<'b>(file: &'b Document<'_>, place: &Value, shape: Shape) -> Option<Packed<'b>> {
    let view = list(&file.json, "bufferViews").get(number(&place["bufferView"])?)?;
    let bytes = file.view(view)?.get(number(&place["byteOffset"]).unwrap_or(0)..)?;
    let row = shape.width * size(shape.kind);
    let stride = number(&view["byteStride"]).unwrap_or(row);
    if stride < row {
        return None;
    }
    let needed = match shape.count {
        0 => 0,
        n => (n - 1).checked_mul(stride)?.checked_add(row)?,
    };
    Some(Packed { bytes: bytes.get(..needed)?, stride, shape })
}

impl Packed<'_> {
    /// Copies the numbers to `values`, which has room for them.
    pub fn unpack(&self, values: &mut [f64]) {
        let Shape { kind, width, count } = self.shape;
        for k in 0..width {
            // The last row may be shorter than the stride: rows are cut to start at their number.
            let from = k * size(kind);
            for (i, row) in
                self.bytes[from.min(self.bytes.len())..].chunks(self.stride).take(count).enumerate()
            {
                if row.len() >= size(kind) {
                    values[i * width + k] = scalar(row, kind, false);
                }
            }
        }
    }
}

/// Replaces the rows that a sparse accessor names. `None` where its data leave the buffer.
fn replace_sparse(file: &Document<'_>, sparse: &Value, shape: Shape, values: &mut [f64]) -> Option<()> {
    let count = number(&sparse["count"]).unwrap_or(0);
    let kind = kind_of(&sparse["indices"]["componentType"])?;
    let indices = packed(file, &sparse["indices"], Shape { kind, width: 1, count })?;
    let rows = packed(file, &sparse["values"], Shape { count, ..shape })?;
    let mut at = vec![0.0; count];
    indices.unpack(&mut at);
    let mut new = vec![0.0; count * shape.width];
    rows.unpack(&mut new);
    for (at, new) in at.into_iter().zip(new.chunks_exact(shape.width)) {
        if let Some(row) = values.chunks_exact_mut(shape.width).nth(at as usize) {
            row.copy_from_slice(new);
        }
    }
    Some(())
}

/// Reads accessor `id`.
pub(super) fn read(input: &mut Input<'_>, file: &Document<'_>, id: usize) -> Result<Rows> {
    let wrong = |input: &Input<'_>, found: &str| {
        input.malformed(
            Location::Whole,
            format!("accessor {id}: {found}"),
            "data within the buffers, as glTF 2.0 asks",
            "The file is cut off or damaged: get it again",
        )
    };
    let Some(a) = list(&file.json, "accessors").get(id) else { return Err(wrong(input, "it is not there")) };
    let width = match a["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        _ => return Err(wrong(input, "a type other than SCALAR, VEC2, VEC3, VEC4")),
    };
    let Some(kind) = kind_of(&a["componentType"]) else {
        return Err(wrong(input, "an unknown component type"));
    };
    let Some(count) = number(&a["count"]) else { return Err(wrong(input, "no count")) };
    let shape = Shape { kind, width, count };
    let mut values = Vec::new();
    if a.get("bufferView").is_some() {
        let Some(rows) = packed(file, a, shape) else {
            return Err(wrong(input, "data outside of their buffer"));
        };
        input.reserve(count, 8 * width)?;
        values.resize(count * width, 0.0);
        rows.unpack(&mut values);
    } else {
        if count > input.data.len() {
            return Err(wrong(input, "more zeros than the file has bytes"));
        }
        input.reserve(count, 8 * width)?;
        values.resize(count * width, 0.0);
    }
    if let Some(sparse) = a.get("sparse")
        && replace_sparse(file, sparse, shape, &mut values).is_none()
    {
        return Err(wrong(input, "sparse data outside of their buffer"));
    }
    if a["normalized"].as_bool() == Some(true) && largest(kind) != 1.0 {
        values.iter_mut().for_each(|v| *v = (*v / largest(kind)).max(-1.0));
    }
    Ok(Rows { values, width })
}
