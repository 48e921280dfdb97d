//! PCD, the Point Cloud Library's format, version 0.7: ascii, binary, binary_compressed.
//!
//! Positions, normals, packed colours (`rgb`, `rgba`) and every other field as an attribute. Points of organised
//! clouds without a measurement are NaN in the file and stay so. The viewpoint is not applied (nor does PCL).

use crate::bytes::{column, size};
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
        if count > input.data.len() {
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

/// Where the numbers of a field are: row by row, or field by field (compressed files).
struct Body<'b> {
    bytes: &'b [u8],
    /// Bytes from one point's number to the next one's.
    stride: usize,
    /// Where in such a step the field starts.
    offset: usize,
}

/// Points taken at a time: their bytes stay in the cache while field after field is taken from them.
const BLOCK: usize = 4096;

impl Body<'_> {
    /// Calls `put` with the number of each point of a block, counted within it.
    fn each(&self, block: usize, k: usize, kind: Kind, mut put: impl FnMut(usize, f64)) {
        let from = (block * BLOCK * self.stride).min(self.bytes.len());
        let to = ((block + 1) * BLOCK * self.stride).min(self.bytes.len());
        let (bytes, offset) = (&self.bytes[from..to], self.offset + k * kind.bytes());
        match kind {
            Kind::Ours(kind) => column(bytes, self.stride, offset, kind, false, put),
            Kind::U64 | Kind::I64 => {
                for (i, row) in bytes.chunks_exact(self.stride).enumerate() {
                    if let Some(Ok(b)) = row.get(offset..offset + 8).map(<[u8; 8]>::try_from) {
                        put(
                            i,
                            if kind == Kind::U64 {
                                u64::from_le_bytes(b) as f64
                            } else {
                                i64::from_le_bytes(b) as f64
                            },
                        );
                    }
                }
            }
        }
    }
}

/// A field with its values for all points.
struct Filled {
    name: String,
    kind: Kind,
    width: usize,
    values: Vec<f64>,
}

/// The columns of a file; the positions are `None` where x, y and z are not all among the fields.
#[derive(Default)]
struct Columns {
    positions: Option<Vec<[f64; 3]>>,
    fields: Vec<Filled>,
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let header = header(input)?;
    let row: usize =
        header.fields.iter().map(|f| f.kind.bytes().saturating_mul(f.count)).fold(0, usize::saturating_add);
    let numbers: usize = header.fields.iter().map(|f| f.count).sum();
    let filled = match header.data.as_slice() {
        b"ascii" => ascii(input, &header)?,
        b"binary" => {
            let bytes = input.data.get(header.end..).unwrap_or_default();
            let n = points_there(input, &header, bytes.len(), row)?;
            input.reserve(n, 8 * numbers)?;
            fill(&header, n, |offset, _| Body { bytes: &bytes[..n * row], stride: row, offset })
        }
        b"binary_compressed" => {
            let bytes = decompress(input, &header)?;
            let n = points_there(input, &header, bytes.len(), row)?;
            input.reserve(n, 8 * numbers)?;
            // Field after field: the offset of a field in a row, times the points, is where it starts.
            fill(&header, n, |offset, f| {
                let width = f.kind.bytes() * f.count;
                Body { bytes: &bytes[offset * n..(offset + width) * n], stride: width, offset: 0 }
            })
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
    content(input, filled)
}

fn points_there(input: &Input<'_>, header: &Header, bytes: usize, row: usize) -> Result<usize> {
    let there = (bytes / row.max(1)) as u64;
    if there < header.points || row == 0 {
        return Err(input.malformed(
            Place::Byte(input.data.len() as u64),
            format!("bytes for {there} points"),
            format!("{} points of {row} bytes, as the header says", header.points),
            "The file is cut off or its header is wrong: get it again",
        ));
    }
    Ok(header.points as usize)
}

fn fill<'b>(header: &Header, n: usize, body: impl Fn(usize, &Field) -> Body<'b>) -> Columns {
    let mut offset = 0;
    let mut bodies = Vec::new();
    let mut out = Columns::default();
    for f in &header.fields {
        let axis = ["x", "y", "z"].iter().position(|a| *a == f.name && f.count == 1);
        // Padding is named "_".
        if f.name != "_" && f.count > 0 {
            bodies.push((body(offset, f), f.kind, axis, out.fields.len()));
            if axis.is_none() {
                let values = vec![0.0; n * f.count];
                out.fields.push(Filled { name: f.name.clone(), kind: f.kind, width: f.count, values });
            }
        }
        offset += f.kind.bytes() * f.count;
    }
    let axes: Vec<usize> = bodies.iter().filter_map(|b| b.2).collect();
    if !(axes.len() == 3 && [0, 1, 2].iter().all(|a| axes.contains(a))) {
        return Columns::default();
    }
    let mut positions = vec![[0.0; 3]; n];
    for block in 0..n.div_ceil(BLOCK) {
        let first = block * BLOCK;
        for &(ref body, kind, axis, field) in &bodies {
            if let Some(axis) = axis {
                let out = &mut positions[first..];
                body.each(block, 0, kind, |i, v| out[i][axis] = v);
                continue;
            }
            let field = &mut out.fields[field];
            let width = field.width;
            let packed = matches!(field.name.as_str(), "rgb" | "rgba") && kind.bytes() == 4 && width == 1;
            let out = &mut field.values[first * width..];
            for k in 0..width {
                // Packed colours are bits, whatever number they claim to be: a float NaN must keep its payload.
                let kind = if packed { Kind::Ours(ScalarKind::U32) } else { kind };
                body.each(block, k, kind, |i, v| out[i * width + k] = v);
            }
        }
    }
    out.positions = Some(positions);
    out
}

fn ascii(input: &mut Input<'_>, header: &Header) -> Result<Columns> {
    let numbers: usize = header.fields.iter().map(|f| f.count).sum();
    let mut out: Vec<Filled> = header
        .fields
        .iter()
        .map(|f| Filled { name: f.name.clone(), kind: f.kind, width: f.count, values: Vec::new() })
        .collect();
    let (mut bad, mut first_bad) = (0u64, None);
    let mut lines = Lines::from(input.data, header.end, header.lines);
    let mut row = vec![0.0; numbers.min(input.data.len())];
    for point in 0..header.points {
        let Some(line) = lines.next_filled() else {
            return Err(input.malformed(
                Place::Line(lines.number()),
                format!("the end of the file after {point} points"),
                format!("{} points, as the header says", header.points),
                "The file is cut off: get it again",
            ));
        };
        input.reserve(numbers, 8)?;
        let mut words = text::tokens(line.text);
        let ok = row.iter_mut().all(|v| words.next().and_then(text::number).map(|w| *v = w).is_some());
        if !ok {
            bad += 1;
            first_bad.get_or_insert((line.number, text::quote(line.text)));
            row.fill(f64::NAN);
        }
        let mut at = 0;
        for f in &mut out {
            for &v in &row[at..at + f.width] {
                let packed =
                    matches!(f.name.as_str(), "rgb" | "rgba") && f.kind == Kind::Ours(ScalarKind::F32);
                f.values.push(if packed { f64::from((v as f32).to_bits()) } else { v });
            }
            at += f.width;
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
    input.report.add(
        "rows that cannot be read, kept as NaN",
        bad,
        first_bad.map(|f| format!("line {}", f.0)),
    );
    out.retain(|f| f.name != "_" && f.width > 0);
    let mut columns = Columns { positions: None, fields: out };
    if let Some(p) = columns.take(&["x", "y", "z"]) {
        columns.positions = Some((0..p[0].len()).map(|i| [p[0][i], p[1][i], p[2][i]]).collect());
    }
    Ok(columns)
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

impl Columns {
    /// Takes fields of one number each out, if all are there.
    fn take(&mut self, names: &[&str]) -> Option<Vec<Vec<f64>>> {
        let find = |n: &&str| self.fields.iter().position(|f| f.name == **n && f.width == 1);
        let mut at = names.iter().map(find).collect::<Option<Vec<usize>>>()?;
        let out = at.iter().map(|&i| std::mem::take(&mut self.fields[i].values)).collect();
        at.sort_unstable();
        at.dedup();
        for i in at.into_iter().rev() {
            self.fields.remove(i);
        }
        Some(out)
    }
}

fn content(input: &mut Input<'_>, mut columns: Columns) -> Result<Content> {
    let mut out = Content::default();
    let Some(positions) = columns.positions.take() else {
        return Err(input.malformed(
            Place::Whole,
            "no fields x, y and z",
            "points with x, y and z",
            "This file holds no points",
        ));
    };
    let n = positions.len();
    out.cloud.positions = positions;
    if let Some(v) = columns.take(&["normal_x", "normal_y", "normal_z"]) {
        out.cloud.normals = Some((0..n).map(|i| [0, 1, 2].map(|k| v[k][i] as f32)).collect());
    }
    for (name, alpha) in [("rgba", true), ("rgb", false)] {
        if out.cloud.colors.is_some() {
            break;
        }
        if let Some(v) = columns.take(&[name]) {
            let color = |&v: &f64| {
                let c = v as u32;
                let byte = |shift: u32| f32::from((c >> shift) as u8) / 255.0;
                [byte(16), byte(8), byte(0), if alpha { byte(24) } else { 1.0 }]
            };
            let mut colors: Vec<[f32; 4]> = v[0].iter().map(color).collect();
            // Many programs leave the alpha byte at 0 and mean opaque.
            if colors.iter().all(|c| c[3] == 0.0) {
                colors.iter_mut().for_each(|c| c[3] = 1.0);
            }
            out.cloud.colors = Some(colors);
        }
    }
    for f in columns.fields {
        let kind = f.kind.stored();
        out.cloud.attributes.push(Attribute { name: f.name, width: f.width, kind, values: f.values });
    }
    Ok(out)
}
