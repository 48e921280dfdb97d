//! The rows of an accessor as bytes.
//!
//! In: an accessor, maybe with some rows replaced (sparse), maybe of zeros only. Out: its rows packed one
//! behind the other, and behind them copies of some.

use crate::bytes::size;
use crate::gltf::accessor::{Packed, Shape, kind_of, packed};
use crate::gltf::document::{Document, list, number};
use atlasfit::geometry::ScalarKind;
use serde_json::Value;

/// The rows of an accessor.
pub(super) struct Rows<'f> {
    /// `None` for zeros.
    base: Option<Packed<'f>>,
    replaced: Option<Replaced<'f>>,
    /// Bytes of a row.
    pub bytes: usize,
    pub count: usize,
}

/// Rows that stand in the place of others.
struct Replaced<'f> {
    at: Packed<'f>,
    rows: Packed<'f>,
    count: usize,
}

/// Bytes of a row: the columns of a matrix start at multiples of four bytes.
fn row_bytes(accessor: &Value) -> Option<usize> {
    let number = size(kind_of(&accessor["componentType"])?);
    let column = |rows: usize| (rows * number).next_multiple_of(4);
    Some(match accessor["type"].as_str()? {
        "SCALAR" => number,
        "VEC2" => 2 * number,
        "VEC3" => 3 * number,
        "VEC4" => 4 * number,
        "MAT2" => 2 * column(2),
        "MAT3" => 3 * column(3),
        "MAT4" => 4 * column(4),
        _ => return None,
    })
}

impl<'f> Rows<'f> {
    /// The rows of accessor `id`; what is wrong with it, in words.
    pub fn of(file: &'f Document<'_>, id: usize) -> Result<Self, &'static str> {
        let accessor = list(&file.json, "accessors").get(id).ok_or("it is not there")?;
        let bytes = row_bytes(accessor).ok_or("an unknown type")?;
        let count = number(&accessor["count"]).ok_or("no count")?;
        let shape = Shape { kind: ScalarKind::U8, width: bytes, count };
        let base = match accessor.get("bufferView") {
            Some(_) => Some(packed(file, accessor, shape).ok_or("data outside of their buffer")?),
            None => None,
        };
        let outside = "sparse data outside of their buffer";
        let replaced = match accessor.get("sparse") {
            Some(sparse) => Some(Replaced::of(file, sparse, shape).ok_or(outside)?),
            None => None,
        };
        Ok(Self { base, replaced, bytes, count })
    }

    /// Bytes from one row to the next once they are written.
    pub fn step(&self) -> usize {
        self.bytes.next_multiple_of(4)
    }

    /// The rows, and behind them a copy of each of `copies`.
    pub fn with_copies(&self, copies: &[u32]) -> Vec<u8> {
        let step = self.step();
        let mut out = vec![0; step * (self.count + copies.len())];
        let put = |out: &mut [u8], i: usize, row: &[u8]| {
            if let Some(place) = out.get_mut(i * step..i * step + self.bytes)
                && row.len() >= self.bytes
            {
                place.copy_from_slice(&row[..self.bytes]);
            }
        };
        if let Some(base) = &self.base {
            base.bytes.chunks(base.stride).enumerate().for_each(|(i, row)| put(&mut out, i, row));
        }
        if let Some(replaced) = &self.replaced {
            let mut at = vec![0.0; replaced.count];
            replaced.at.unpack(&mut at);
            for (at, row) in at.into_iter().zip(replaced.rows.bytes.chunks(replaced.rows.stride)) {
                if (at as usize) < self.count {
                    put(&mut out, at as usize, row);
                }
            }
        }
        for (i, &old) in copies.iter().enumerate() {
            let from = old as usize * step;
            out.copy_within(from..from + step, step * (self.count + i));
        }
        out
    }
}

impl<'f> Replaced<'f> {
    fn of(file: &'f Document<'_>, sparse: &Value, shape: Shape) -> Option<Self> {
        let count = number(&sparse["count"]).unwrap_or(0);
        let kind = kind_of(&sparse["indices"]["componentType"])?;
        let at = packed(file, &sparse["indices"], Shape { kind, width: 1, count })?;
        let rows = packed(file, &sparse["values"], Shape { count, ..shape })?;
        Some(Self { at, rows, count })
    }
}
