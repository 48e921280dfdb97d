//! PCD, the Point Cloud Library's format, version 0.7: ascii, binary, binary_compressed.
//!
//! Positions, normals, packed colours (`rgb`, `rgba`) and every other field as an attribute. Points of organised
//! clouds without a measurement are NaN in the file and stay so. The viewpoint is not applied (nor does PCL).

use crate::bytes::{self, column, size, zeros};
use crate::error::{Place, Result};
use crate::load::{Content, Input};
use crate::text::{self, Lines};
use atlasfit::geometry::{Attribute, ScalarKind};

/// A field's number type: ours, or a 64-bit integer (time stamps), which becomes a float.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Ours(ScalarKind),
    U64,
    I64,
}

impl Kind {
    fn bytes(self) -> usize {
        match self {
            Self::Ours(k) => size(k),
            _ => 8,
        }
    }
    fn stored(self) -> ScalarKind {
        match self {
            Self::Ours(k) => k,
            _ => ScalarKind::F64,
        }
    }
}

struct Field {
    name: String,
    kind: Kind,
    count: usize,
}

#[derive(Default)]
struct Header {
    fields: Vec<Field>,
    points: u64,
    data: Vec<u8>,
    end: usize,
    lines: u64,
}

/// Whether these bytes are a PCD file.
pub(crate) fn is_pcd(data: &[u8]) -> bool {
    Lines::new(data)
        .take(50)
        .map(|l| text::tokens(l.text).next().unwrap_or_default())
        .find(|w| !w.is_empty() && !w.starts_with(b"#"))
        .is_some_and(|w| w == b"VERSION" || w == b"FIELDS")
}

fn header(input: &Input<'_>) -> Result<Header> {
    let mut h = Header::default();
    let (mut names, mut sizes, mut types, mut counts) = (vec![], vec![], vec![], vec![]);
    let (mut width, mut height, mut points) = (None, 1u64, None);
    let mut lines = Lines::new(input.data);
    while let Some(line) = lines.next() {
        let mut words = text::tokens(line.text);
        let Some(key) = words.next() else { continue };
        let rest: Vec<String> = words.map(|w| String::from_utf8_lossy(w).into_owned()).collect();
        let number = || rest.first().and_then(|w| w.parse::<u64>().ok());
        let wrong = |expected: &str| {
            input.malformed(Place::Line(line.number), text::quote(line.text), expected, "Correct the header")
        };
        match key {
            b"FIELDS" | b"COLUMNS" => names = rest,
            b"SIZE" => sizes = rest,
            b"TYPE" => types = rest,
            b"COUNT" => counts = rest,
            b"WIDTH" => width = Some(number().ok_or_else(|| wrong("WIDTH and a number"))?),
            b"HEIGHT" => height = number().ok_or_else(|| wrong("HEIGHT and a number"))?,
            b"POINTS" => points = Some(number().ok_or_else(|| wrong("POINTS and a number"))?),
            b"DATA" => {
                h.data = rest.first().map(|w| w.to_lowercase().into_bytes()).unwrap_or_default();
                h.end = lines.offset().min(input.data.len());
                h.lines = line.number;
                // Only a LF ends this line when the body is binary.
                if h.data != b"ascii"
                    && h.end >= 2
                    && input.data.get(h.end - 2) == Some(&b'\r')
                    && line.number > 1
                {
                    let crlf = input.data[..h.end - 2].windows(2).any(|w| w == b"\r\n");
                    h.end -= usize::from(!crlf);
                }
                break;
            }
            b"VERSION" | b"VIEWPOINT" => {}
            w if w.starts_with(b"#") => {}
            _ => {
                return Err(wrong(
                    "VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS or DATA",
                ));
            }
        }
    }
    let whole = |found: String, expected: &str| {
        input.malformed(Place::Whole, found, expected, "The header is damaged: get the file again")
    };
    if h.data.is_empty() {
        return Err(whole("a header without DATA".into(), "DATA ascii, binary or binary_compressed"));
    }
    if names.is_empty() || sizes.len() != names.len() || types.len() != names.len() {
        let found = format!("{} FIELDS, {} SIZE, {} TYPE", names.len(), sizes.len(), types.len());
        return Err(whole(found, "as many of each"));
    }
    for (i, name) in names.into_iter().enumerate() {
        let kind = match (types[i].as_str(), sizes[i].as_str()) {
            ("F", "4") => Kind::Ours(ScalarKind::F32),
            ("F", "8") => Kind::Ours(ScalarKind::F64),
            ("U", "1") => Kind::Ours(ScalarKind::U8),
            ("U", "2") => Kind::Ours(ScalarKind::U16),
            ("U", "4") => Kind::Ours(ScalarKind::U32),
            ("I", "1") => Kind::Ours(ScalarKind::I8),
            ("I", "2") => Kind::Ours(ScalarKind::I16),
            ("I", "4") => Kind::Ours(ScalarKind::I32),
            ("U", "8") => Kind::U64,
            ("I", "8") => Kind::I64,
            (t, s) => return Err(whole(format!("TYPE {t} of SIZE {s}"), "F, U or I of 1, 2, 4 or 8 bytes")),
        };
        let count = counts.get(i).map_or(Ok(1), |c| c.parse::<usize>()).unwrap_or(usize::MAX);
        // A row longer than the file cannot be there.
        if count > input.len {
            return Err(whole(format!("COUNT {}", counts[i]), "the numbers per point of a field"));
        }
        h.fields.push(Field { name, kind, count });
    }
    h.points = match (points, width) {
        (Some(p), _) => p,
        (None, Some(w)) => w.saturating_mul(height),
        (None, None) => return Err(whole("neither POINTS nor WIDTH".into(), "the number of points")),
    };
    Ok(h)
}

/// What a field becomes.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Position(usize),
    Normal(usize),
    /// Packed bytes: blue, green, red, and with the flag alpha.
    Color(bool),
    Attribute(usize),
    Nothing,
}

/// A field of the file and what it becomes.
struct Slot {
    target: Target,
    kind: Kind,
    count: usize,
    /// Where it starts in a row.
    offset: usize,
}

/// Points taken at a time: their bytes stay in the cache while field after field is taken from them.
const BLOCK: usize = 4096;

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let header = header(input)?;
    let row: usize =
        header.fields.iter().map(|f| f.kind.bytes().saturating_mul(f.count)).fold(0, usize::saturating_add);
    let mut out = match header.data.as_slice() {
        b"ascii" => ascii(input, &header)?,
        b"binary" => {
            let there = input.len.saturating_sub(header.end);
            let n = points_there(input, &header, there, row)?;
            let (slots, mut out) = columns(input, &header, n)?;
            let mut first = 0;
            input.blocks(header.end, n * row, BLOCK.saturating_mul(row), |bytes| {
                let mut rest = slots.as_slice();
                while let [slot, others @ ..] = rest {
                    let taken = put_position(&mut out, rest, first, bytes, row);
                    if !taken {
                        put(&mut out, slot, first, bytes, row, slot.offset);
                    }
                    rest = if taken { &rest[3..] } else { others };
                }
                first += BLOCK;
            })?;
            out
        }
        b"binary_compressed" => {
            let bytes = decompress(input, &header)?;
            let n = points_there(input, &header, bytes.len(), row)?;
            let (slots, mut out) = columns(input, &header, n)?;
            for slot in &slots {
                // Field after field: the offset of a field in a row, times the points, is where it starts.
                let width = slot.kind.bytes() * slot.count;
                put(&mut out, slot, 0, &bytes[slot.offset * n..(slot.offset + width) * n], width, 0);
            }
            out
        }
        other => {
            return Err(input.malformed(
                Place::Line(header.lines),
                format!("DATA {}", String::from_utf8_lossy(other)),
                "DATA ascii, binary or binary_compressed",
                "Write the file again with PCL",
            ));
        }
    };
    // Many programs leave the alpha byte at 0 and mean opaque.
    if let Some(colors) = &mut out.cloud.colors
        && colors.iter().all(|c| c[3] == 0.0)
    {
        colors.iter_mut().for_each(|c| c[3] = 1.0);
    }
    Ok(out)
}

/// Whether the file is rows of bytes from some place on: then it can be read block by block.
pub(crate) fn is_rows(input: &Input<'_>) -> bool {
    header(input).is_ok_and(|h| h.data == b"binary")
}

fn points_there(input: &Input<'_>, header: &Header, bytes: usize, row: usize) -> Result<usize> {
    let there = (bytes / row.max(1)) as u64;
    if there < header.points || row == 0 {
        return Err(input.malformed(
            Place::Byte(input.len as u64),
            format!("bytes for {there} points"),
            format!("{} points of {row} bytes, as the header says", header.points),
            "The file is cut off or its header is wrong: get it again",
        ));
    }
    Ok(header.points as usize)
}

/// The role of each field, and columns of `n` points for them.
fn columns(input: &mut Input<'_>, header: &Header, n: usize) -> Result<(Vec<Slot>, Content)> {
    let single = |name: &str| header.fields.iter().position(|f| f.name == name && f.count == 1);
    let three = |names: [&str; 3]| -> Option<Vec<usize>> { names.into_iter().map(single).collect() };
    let Some(positions) = three(["x", "y", "z"]) else {
        return Err(input.malformed(
            Place::Whole,
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
    Ok((slots, out))
}

/// Colour from packed bytes.
fn unpack(bytes: [u8; 4], alpha: bool) -> [f32; 4] {
    let [blue, green, red, a] = bytes.map(|b| f32::from(b) / 255.0);
    [red, green, blue, if alpha { a } else { 1.0 }]
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
    bytes::columns(rows, stride, *offset, *kind, false, |i, v| out[i] = v);
    true
}

/// Takes a field of the points from `first` on, `stride` bytes from one to the next.
fn put(out: &mut Content, slot: &Slot, first: usize, bytes: &[u8], stride: usize, offset: usize) {
    let cloud = &mut out.cloud;
    match slot.target {
        Target::Position(k) => {
            let out = &mut cloud.positions[first..];
            each(bytes, stride, offset, slot.kind, |i, v| out[i][k] = v);
        }
        Target::Normal(k) => {
            let out = &mut cloud.normals.as_mut().map_or(&mut [][..], |c| &mut c[first..]);
            each(bytes, stride, offset, slot.kind, |i, v| out[i][k] = v as f32);
        }
        Target::Color(alpha) => {
            let out = &mut cloud.colors.as_mut().map_or(&mut [][..], |c| &mut c[first..]);
            // They are bits, whatever number they claim to be: a float NaN must keep its payload.
            for (color, row) in out.iter_mut().zip(bytes.chunks_exact(stride)) {
                if let Some(bits) = row.get(offset..).and_then(<[u8]>::first_chunk) {
                    *color = unpack(*bits, alpha);
                }
            }
        }
        Target::Attribute(a) => {
            let width = slot.count;
            let out = &mut cloud.attributes[a].values[first * width..];
            for k in 0..width {
                each(bytes, stride, offset + k * slot.kind.bytes(), slot.kind, |i, v| out[i * width + k] = v);
            }
        }
        Target::Nothing => {}
    }
}

/// Calls `put` for the number at `offset` of each row.
fn each(bytes: &[u8], stride: usize, offset: usize, kind: Kind, mut put: impl FnMut(usize, f64)) {
    let eight = |row: &[u8]| row.get(offset..offset + 8).and_then(|b| <[u8; 8]>::try_from(b).ok());
    let rows = bytes.chunks_exact(stride).filter_map(eight).enumerate();
    match kind {
        Kind::Ours(kind) => column(bytes, stride, offset, kind, false, put),
        Kind::U64 => rows.for_each(|(i, b)| put(i, u64::from_le_bytes(b) as f64)),
        Kind::I64 => rows.for_each(|(i, b)| put(i, i64::from_le_bytes(b) as f64)),
    }
}

fn ascii(input: &mut Input<'_>, header: &Header) -> Result<Content> {
    let numbers: usize = header.fields.iter().map(|f| f.count).fold(0, usize::saturating_add);
    let mut lines = Lines::from(input.data, header.end, header.lines);
    let cut_off = |input: &Input<'_>, line: u64, points: u64| {
        input.malformed(
            Place::Line(line),
            format!("the end of the file after at most {points} points"),
            format!("{} points, as the header says", header.points),
            "The file is cut off: get it again",
        )
    };
    // A number takes two bytes with what separates it; up to half of the rows' bytes may be missing where rows are damaged.
    let possible = (input.data.len().saturating_sub(header.end) / numbers.max(1)) as u64;
    if possible < header.points {
        return Err(cut_off(input, header.lines, possible));
    }
    let (slots, mut out) = columns(input, header, header.points as usize)?;
    let (mut bad, mut first_bad) = (0u64, None);
    let mut row = vec![0.0; if header.points > 0 { numbers } else { 0 }];
    for point in 0..header.points {
        let Some(line) = lines.next_filled() else { return Err(cut_off(input, lines.number(), point)) };
        let mut words = text::tokens(line.text);
        let ok = row.iter_mut().all(|v| words.next().and_then(text::number).map(|w| *v = w).is_some());
        if !ok {
            bad += 1;
            first_bad.get_or_insert((line.number, text::quote(line.text)));
            row.fill(f64::NAN);
        }
        let (mut at, i) = (0, point as usize);
        for slot in &slots {
            let values = &row[at..at + slot.count];
            let cloud = &mut out.cloud;
            match slot.target {
                Target::Position(k) => cloud.positions[i][k] = values[0],
                Target::Normal(k) => cloud.normals.iter_mut().for_each(|c| c[i][k] = values[0] as f32),
                Target::Color(alpha) => {
                    let float = slot.kind == Kind::Ours(ScalarKind::F32);
                    let bits = if float && ok { (values[0] as f32).to_bits() } else { values[0] as u32 };
                    cloud.colors.iter_mut().for_each(|c| c[i] = unpack(bits.to_le_bytes(), alpha));
                }
                Target::Attribute(a) => {
                    cloud.attributes[a].values[i * slot.count..][..slot.count].copy_from_slice(values);
                }
                Target::Nothing => {}
            }
            at += slot.count;
        }
        if bad > 10 && bad > header.points / 20 {
            let (number, found) = first_bad.unwrap_or_default();
            return Err(input.malformed(
                Place::Line(number),
                found,
                format!("{numbers} numbers of a point"),
                "Too many rows are like this: the header and the rows do not agree",
            ));
        }
    }
    let first = first_bad.map(|f| format!("line {}", f.0));
    input.report.add("rows that cannot be read, kept as NaN", bad, first);
    Ok(out)
}

/// LZF (Lehmann 2000): literal runs and back references. The size that the file claims is only a limit.
fn decompress(input: &mut Input<'_>, header: &Header) -> Result<Vec<u8>> {
    let rest = input.data.get(header.end..).unwrap_or_default();
    let word = |i: usize| rest.get(i..i + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let broken = |input: &Input<'_>, at: usize| {
        input.malformed(
            Place::Byte((header.end + at) as u64),
            "compressed data that do not unpack",
            "LZF data",
            "The file is damaged: get it again",
        )
    };
    let (Some(packed), Some(unpacked)) = (word(0), word(4)) else { return Err(broken(input, 0)) };
    let Some(data) = packed.checked_add(8).and_then(|end| rest.get(8..end)) else {
        return Err(broken(input, rest.len()));
    };
    // A back reference of 3 bytes gives at most 264.
    let most = unpacked.min(data.len().saturating_mul(88));
    input.reserve(most, 1)?;
    let mut out: Vec<u8> = Vec::with_capacity(most.min(8 * data.len()));
    let mut i = 0;
    while i < data.len() && out.len() < unpacked {
        let control = usize::from(data[i]);
        i += 1;
        if control < 32 {
            let Some(run) = data.get(i..i + control + 1) else { return Err(broken(input, i)) };
            out.extend_from_slice(run);
            i += control + 1;
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*data.get(i).ok_or_else(|| broken(input, i))?);
                i += 1;
            }
            let low = usize::from(*data.get(i).ok_or_else(|| broken(input, i))?);
            i += 1;
            let back = ((control & 31) << 8) + low + 1;
            let Some(start) = out.len().checked_sub(back) else { return Err(broken(input, i)) };
            let length = length + 2;
            if length <= back {
                out.extend_from_within(start..start + length);
            } else {
                // The run repeats bytes that it writes itself.
                for k in start..start + length {
                    out.push(out[k]);
                }
            }
        }
    }
    if out.len() != unpacked {
        return Err(broken(input, i));
    }
    Ok(out)
}
