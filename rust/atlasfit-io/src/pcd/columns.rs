//! The columns of a PCD file: which field goes where, and how a block of points is taken.

use super::header::{Field, Header, Kind};
use crate::bytes::{self, ColumnLayout, column, zeros};
use crate::content::Content;
use crate::error::{Location, Result};
use crate::input::Input;
use atlasfit::geometry::Attribute;

/// What a field becomes.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Target {
    Position(usize),
    Normal(usize),
    /// Packed bytes: blue, green, red, and with the flag alpha.
    Color(bool),
    Attribute(usize),
    Nothing,
}

/// A field of the file and what it becomes.
pub(super) struct Slot {
    pub target: Target,
    pub kind: Kind,
    /// Numbers per point.
    pub count: usize,
    /// Where it starts in a row, in bytes.
    pub offset: usize,
}

/// What the fields become, and their columns.
pub(super) struct Columns {
    pub slots: Vec<Slot>,
    pub content: Content,
}

/// Decides what each field becomes, and makes columns of `n` points for them.
pub(super) fn plan(input: &mut Input<'_>, header: &Header, n: usize) -> Result<Columns> {
    let single = |name: &str| header.fields.iter().position(|f| f.name == name && f.count == 1);
    let three = |names: [&str; 3]| -> Option<Vec<usize>> { names.into_iter().map(single).collect() };
    let Some(positions) = three(["x", "y", "z"]) else {
        return Err(input.malformed(
            Location::Whole,
            "no fields x, y and z",
            "points with x, y and z",
            "This file holds no points",
        ));
    };
    let normals = three(["normal_x", "normal_y", "normal_z"]).unwrap_or_default();
    let packed = |name| single(name).filter(|&i| header.fields[i].kind.bytes() == 4);
    let color = packed("rgba").map(|i| (i, true)).or_else(|| packed("rgb").map(|i| (i, false)));
    let mut slots = Vec::with_capacity(header.fields.len());
    let (mut offset, mut attributes) = (0, Vec::new());
    for (i, f) in header.fields.iter().enumerate() {
        let target = if let Some(k) = positions.iter().position(|&p| p == i) {
            Target::Position(k)
        } else if let Some(k) = normals.iter().position(|&p| p == i) {
            Target::Normal(k)
        } else if let Some((_, alpha)) = color.filter(|c| c.0 == i) {
            Target::Color(alpha)
        } else if f.name == "_" || f.count == 0 {
            // Padding is named "_".
            Target::Nothing
        } else {
            attributes.push(f);
            Target::Attribute(attributes.len() - 1)
        };
        slots.push(Slot { target, kind: f.kind, count: f.count, offset });
        offset += f.kind.bytes() * f.count;
    }
    let numbers: usize = attributes.iter().map(|f| f.count).fold(0, usize::saturating_add);
    let rest = if normals.is_empty() { 0 } else { 12 } + if color.is_some() { 16 } else { 0 };
    input.reserve(n, numbers.saturating_mul(8).saturating_add(24 + rest))?;
    let mut out = Content::default();
    out.cloud.positions = zeros([0.0; 3], n);
    out.cloud.normals = (!normals.is_empty()).then(|| zeros([0.0; 3], n));
    out.cloud.colors = color.is_some().then(|| zeros([0.0; 4], n));
    let attribute = |f: &Field| {
        let values = zeros(0.0, n * f.count);
        Attribute { name: f.name.clone(), width: f.count, kind: f.kind.stored(), values }
    };
    out.cloud.attributes = attributes.into_iter().map(attribute).collect();
    Ok(Columns { slots, content: out })
}

/// Colour from packed bytes.
pub(super) fn unpack(bytes: [u8; 4], alpha: bool) -> [f32; 4] {
    let [blue, green, red, a] = bytes.map(|b| f32::from(b) / 255.0);
    [red, green, blue, if alpha { a } else { 1.0 }]
}

impl Columns {
    /// Takes all fields of a block of points, row after row of `row` bytes; `first` is the number of the
    /// first.
    pub fn take_rows(&mut self, first: usize, rows: &[u8], row: usize) {
        let Self { slots, content } = self;
        let mut rest = slots.as_slice();
        while let [slot, others @ ..] = rest {
            let layout = Layout { stride: row, offset: slot.offset };
            let taken = put_position(content, rest, first, rows, row);
            if !taken {
                put(content, slot, first, rows, layout);
            }
            rest = if taken { &rest[3..] } else { others };
        }
    }

    /// Takes all fields of the `n` points, which stand field after field.
    pub fn take_fields(&mut self, bytes: &[u8], n: usize) {
        for slot in &self.slots {
            // The offset of a field in a row, times the points, is where it starts.
            let stride = slot.kind.bytes() * slot.count;
            let bytes = &bytes[slot.offset * n..(slot.offset + stride) * n];
            put(&mut self.content, slot, 0, bytes, Layout { stride, offset: 0 });
        }
    }
}

/// Where a field stands: bytes from one point to the next, and from a point's first byte to the field.
#[derive(Clone, Copy)]
struct Layout {
    stride: usize,
    offset: usize,
}

/// Takes x, y and z at once where they are the next three fields, of one kind of number: nearly always.
fn put_position(out: &mut Content, slots: &[Slot], first: usize, rows: &[u8], stride: usize) -> bool {
    let Some(Slot { target: Target::Position(0), kind: Kind::Ours(kind), offset, .. }) = slots.first() else {
        return false;
    };
    let one = |k: usize| {
        slots.get(k).is_some_and(|s| s.target == Target::Position(k) && s.kind == Kind::Ours(*kind))
    };
    if !(one(1) && one(2)) {
        return false;
    }
    let out = &mut out.cloud.positions[first..];
    let layout = ColumnLayout { stride, offset: *offset, kind: *kind, big_endian: false };
    bytes::columns(rows, layout, |i, v| out[i] = v);
    true
}

/// Takes a field of the points from `first` on.
fn put(out: &mut Content, slot: &Slot, first: usize, bytes: &[u8], layout: Layout) {
    let cloud = &mut out.cloud;
    match slot.target {
        Target::Position(k) => {
            let out = &mut cloud.positions[first..];
            each(bytes, layout, slot.kind, |i, v| out[i][k] = v);
        }
        Target::Normal(k) => {
            let out = &mut cloud.normals.as_mut().map_or(&mut [][..], |c| &mut c[first..]);
            each(bytes, layout, slot.kind, |i, v| out[i][k] = v as f32);
        }
        Target::Color(alpha) => {
            let out = &mut cloud.colors.as_mut().map_or(&mut [][..], |c| &mut c[first..]);
            // They are bits, whatever number they claim to be: a float NaN must keep its payload.
            for (color, row) in out.iter_mut().zip(bytes.chunks_exact(layout.stride)) {
                if let Some(bits) = row.get(layout.offset..).and_then(<[u8]>::first_chunk) {
                    *color = unpack(*bits, alpha);
                }
            }
        }
        Target::Attribute(a) => {
            let width = slot.count;
            let out = &mut cloud.attributes[a].values[first * width..];
            for k in 0..width {
                let layout = Layout { offset: layout.offset + k * slot.kind.bytes(), ..layout };
                each(bytes, layout, slot.kind, |i, v| out[i * width + k] = v);
            }
        }
        Target::Nothing => {}
    }
}

/// Calls `put` for the number of each row.
fn each(bytes: &[u8], layout: Layout, kind: Kind, mut put: impl FnMut(usize, f64)) {
    let Layout { stride, offset } = layout;
    let eight = |row: &[u8]| row.get(offset..offset + 8).and_then(|b| <[u8; 8]>::try_from(b).ok());
    let rows = bytes.chunks_exact(stride).filter_map(eight).enumerate();
    match kind {
        Kind::Ours(kind) => column(bytes, ColumnLayout { stride, offset, kind, big_endian: false }, put),
        Kind::U64 => rows.for_each(|(i, b)| put(i, u64::from_le_bytes(b) as f64)),
        Kind::I64 => rows.for_each(|(i, b)| put(i, i64::from_le_bytes(b) as f64)),
    }
}
