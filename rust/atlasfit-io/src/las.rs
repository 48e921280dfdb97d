//! LAS 1.0 to 1.4 and LAZ (ASPRS LAS specification R15; LAZ through the `laz` crate, feature `laz`).
//!
//! Positions are the file's integers times scale plus offset, in f64. Colour (16 bit, or 8 bit where a program
//! wrote that), intensity, classification, returns, GPS time, source, user data, scan angle and the extra bytes that
//! the file describes are kept where they are not all zero.

use crate::bytes::{column, columns, size, zeros};
use crate::error::{Place, Result};
use crate::load::{Content, Input};
use atlasfit::geometry::{Attribute, ScalarKind};

/// Points unpacked at a time.
const BLOCK: usize = 4096;

/// Whether these bytes are a LAS or LAZ file.
pub(crate) fn is_las(data: &[u8]) -> bool {
    data.starts_with(b"LASF")
}

/// The parts of the header that reading needs.
struct Header {
    points: u64,
    start: usize,
    format: u8,
    record: usize,
    compressed: bool,
    scale: [f64; 3],
    offset: [f64; 3],
    /// The LASzip record.
    laszip: Option<Vec<u8>>,
    extra: Vec<Field>,
}

/// One attribute: where it stands in a record, and how its number becomes a value.
struct Field {
    name: String,
    offset: usize,
    stored: ScalarKind,
    kind: ScalarKind,
    /// Bits of a packed byte: shift and mask.
    bits: Option<(u32, u32)>,
    scale: f64,
    add: f64,
}

impl Field {
    fn plain(name: &str, offset: usize, kind: ScalarKind) -> Self {
        Self { name: name.into(), offset, stored: kind, kind, bits: None, scale: 1.0, add: 0.0 }
    }
    fn packed(name: &str, offset: usize, shift: u32, mask: u32) -> Self {
        Self { bits: Some((shift, mask)), ..Self::plain(name, offset, ScalarKind::U8) }
    }
}

/// Reads little-endian numbers at fixed places.
struct At<'d>(&'d [u8]);

impl At<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        self.0.get(at..at.checked_add(N)?)?.try_into().ok()
    }
    fn u16(&self, at: usize) -> Option<u16> {
        self.bytes(at).map(u16::from_le_bytes)
    }
    fn u32(&self, at: usize) -> Option<u32> {
        self.bytes(at).map(u32::from_le_bytes)
    }
    fn u64(&self, at: usize) -> Option<u64> {
        self.bytes(at).map(u64::from_le_bytes)
    }
    fn f64(&self, at: usize) -> Option<f64> {
        self.bytes(at).map(f64::from_le_bytes)
    }
}

/// Bytes of a record of each point format, without extra bytes.
const RECORDS: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

fn parse(data: &[u8]) -> Option<Header> {
    let at = At(data);
    let minor = *data.get(25)?;
    let header_size = usize::from(at.u16(94)?);
    let start = at.u32(96)? as usize;
    let vlrs = at.u32(100)?;
    let format = *data.get(104)?;
    let record = usize::from(at.u16(105)?);
    let mut points = u64::from(at.u32(107)?);
    if minor >= 4 && header_size >= 375 {
        points = at.u64(247).filter(|&p| p > 0).unwrap_or(points);
    }
    let three = |from: usize| Some([at.f64(from)?, at.f64(from + 8)?, at.f64(from + 16)?]);
    let mut header = Header {
        points,
        start,
        format: format & 0x3F,
        record,
        compressed: format & 0x80 != 0,
        scale: three(131)?,
        offset: three(155)?,
        laszip: None,
        extra: Vec::new(),
    };
    let mut place = header_size;
    for _ in 0..vlrs {
        let (Some(user), Some(id), Some(len)) =
            (at.bytes::<16>(place + 2), at.u16(place + 18), at.u16(place + 20))
        else {
            break;
        };
        let Some(body) = data.get(place + 54..place + 54 + usize::from(len)) else { break };
        if user.starts_with(b"laszip encoded") && id == 22204 {
            header.laszip = Some(body.to_vec());
        } else if user.starts_with(b"LASF_Spec") && id == 4 {
            header.extra = extra_fields(body, *RECORDS.get(usize::from(header.format))?);
        }
        place += 54 + usize::from(len);
    }
    Some(header)
}

/// The fields that a file describes for the bytes behind the standard record.
fn extra_fields(body: &[u8], mut offset: usize) -> Vec<Field> {
    let mut out = Vec::new();
    for d in body.chunks_exact(192) {
        let kind = match d[2] {
            1 => ScalarKind::U8,
            2 => ScalarKind::I8,
            3 => ScalarKind::U16,
            4 => ScalarKind::I16,
            5 => ScalarKind::U32,
            6 => ScalarKind::I32,
            9 => ScalarKind::F32,
            10 => ScalarKind::F64,
            7 | 8 => {
                offset += 8;
                continue;
            }
            0 => {
                offset += usize::from(d[3]);
                continue;
            }
            // Arrays of numbers were withdrawn from the standard: what follows cannot be placed.
            _ => break,
        };
        let name = String::from_utf8_lossy(&d[4..36]).trim_end_matches('\0').to_owned();
        let at = At(d);
        let scale = if d[3] & 8 != 0 { at.f64(112).unwrap_or(1.0) } else { 1.0 };
        let add = if d[3] & 16 != 0 { at.f64(136).unwrap_or(0.0) } else { 0.0 };
        let shown = if scale == 1.0 && add == 0.0 { kind } else { ScalarKind::F64 };
        out.push(Field { name, offset, stored: kind, kind: shown, bits: None, scale, add });
        offset += size(kind);
    }
    out
}

/// The attributes of a point format.
fn fields(header: &mut Header) -> Vec<Field> {
    use ScalarKind::{F64, I8, U8, U16};
    let new = header.format >= 6;
    let mut out = vec![Field::plain("intensity", 12, U16)];
    if new {
        out.push(Field::packed("return_number", 14, 0, 15));
        out.push(Field::packed("number_of_returns", 14, 4, 15));
        out.push(Field::plain("classification", 16, U8));
        let angle = Field { scale: 0.006, kind: F64, ..Field::plain("scan_angle", 18, ScalarKind::I16) };
        out.push(angle);
        out.push(Field::plain("point_source_id", 20, U16));
        out.push(Field::plain("gps_time", 22, F64));
    } else {
        out.push(Field::packed("return_number", 14, 0, 7));
        out.push(Field::packed("number_of_returns", 14, 3, 7));
        out.push(Field::packed("classification", 15, 0, 31));
        out.push(Field::plain("scan_angle", 16, I8));
        out.push(Field::plain("point_source_id", 18, U16));
        if matches!(header.format, 1 | 3 | 4 | 5) {
            out.push(Field::plain("gps_time", 20, F64));
        }
    }
    out.push(Field::plain("user_data", 17, U8));
    out.append(&mut header.extra);
    out
}

/// Whether the file is rows of bytes from some place on: then it can be read block by block.
pub(crate) fn is_rows(input: &Input<'_>) -> bool {
    parse(input.data).is_some_and(|h| !h.compressed && h.start <= input.data.len())
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let damaged = |input: &Input<'_>, at: usize, found: String, expected: &str| {
        input.malformed(
            Place::Byte(at as u64),
            found,
            expected,
            "The file is cut off or damaged: get it again",
        )
    };
    let Some(mut header) = parse(input.data) else {
        return Err(damaged(input, input.len, "the end of the file".into(), "a LAS header"));
    };
    let Some(&least) = RECORDS.get(usize::from(header.format)) else {
        return Err(input.unsupported(
            format!("LAS point format {}", header.format),
            "Write it in one of the formats 0 to 10",
        ));
    };
    if header.record < least {
        let found = format!("records of {} bytes", header.record);
        return Err(damaged(
            input,
            105,
            found,
            &format!("at least {least} bytes for point format {}", header.format),
        ));
    }
    let fields = fields(&mut header);
    let mut reader = Points {
        fields: fields.into_iter().filter(|f| f.offset + size(f.stored) <= header.record).collect(),
        color: match header.format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        },
        header,
        content: Content::default(),
        values: Vec::new(),
        done: 0,
        expected: 0,
    };
    reader.values = reader.fields.iter().map(|_| Vec::new()).collect();
    let per_point = 24 + 16 + 8 * reader.fields.len();
    if reader.header.compressed {
        unpack(input, &mut reader, per_point)?;
    } else {
        let Header { start, record, points, .. } = reader.header;
        let there = (input.len.saturating_sub(start) / record) as u64;
        let n = points.min(there) as usize;
        if there < points {
            if n == 0 {
                return Err(damaged(
                    input,
                    input.len,
                    "the end of the file".into(),
                    &format!("{points} points"),
                ));
            }
            input.report.add(
                "points announced by the header but not in the file (it is cut off)",
                points - there,
                Some(format!("byte {}", input.len)),
            );
        }
        input.reserve(n, per_point)?;
        reader.expected = n;
        input.blocks(start.min(input.len), n * record, BLOCK * record, |records| reader.take(records))?;
    }
    Ok(reader.finish(input))
}

/// The columns while they fill.
struct Points {
    header: Header,
    fields: Vec<Field>,
    color: Option<usize>,
    content: Content,
    /// Per field; empty while all values are zero.
    values: Vec<Vec<f64>>,
    /// Points taken.
    done: usize,
    /// Points for which memory is set aside at once: those whose bytes are there.
    expected: usize,
}

/// At least `n` entries.
fn grow<T: Copy + Send>(column: &mut Vec<T>, zero: T, n: usize) {
    if column.is_empty() {
        *column = zeros(zero, n);
    } else if column.len() < n {
        column.resize(n, zero);
    }
}

impl Points {
    /// Takes whole records.
    fn take(&mut self, records: &[u8]) {
        let Self { header, fields, color, content, values, done, expected } = self;
        let (stride, first, expected) = (header.record, *done, *expected);
        *done += records.len() / stride;
        let room = expected.max(*done);
        let positions = &mut content.cloud.positions;
        grow(positions, [0.0; 3], room);
        let added = &mut positions[first..];
        let (scale, add) = (header.scale, header.offset);
        columns(records, stride, 0, ScalarKind::I32, false, |i, v: [f64; 3]| {
            added[i] = [0, 1, 2].map(|k| v[k] * scale[k] + add[k]);
        });
        for (field, out) in fields.iter().zip(values) {
            let value = |v: f64| {
                let v = field.bits.map_or(v, |(shift, mask)| f64::from((v as u32 >> shift) & mask));
                v * field.scale + field.add
            };
            if out.is_empty() {
                // A column that is zero so far takes no memory.
                let mut zero = true;
                column(records, stride, field.offset, field.stored, false, |_, v| zero &= value(v) == 0.0);
                if zero {
                    continue;
                }
            }
            grow(out, 0.0, room);
            let added = &mut out[first..];
            column(records, stride, field.offset, field.stored, false, |i, v| added[i] = value(v));
        }
        if let Some(offset) = *color {
            let colors = content.cloud.colors.get_or_insert_default();
            grow(colors, [0.0; 4], room);
            let added = &mut colors[first..];
            columns(records, stride, offset, ScalarKind::U16, false, |i, v: [f64; 3]| {
                let [r, g, b] = v.map(|v| v as f32 / 65535.0);
                added[i] = [r, g, b, 1.0];
            });
        }
    }

    fn finish(self, input: &mut Input<'_>) -> Content {
        let mut content = self.content;
        if let Some(colors) = &mut content.cloud.colors {
            const LARGEST_BYTE: f32 = 255.0 / 65535.0;
            let any = |least: f32| colors.iter().any(|c| c[..3].iter().any(|&v| v > least));
            if !any(0.0) {
                content.cloud.colors = None;
            } else if !any(LARGEST_BYTE) {
                let n = colors.len() as u64;
                input.report.add("colours not above 255, read as 8 bits (LAS asks for 16)", n, None);
                colors.iter_mut().flat_map(|c| &mut c[..3]).for_each(|c| *c = (*c * 65535.0).round() / 255.0);
            }
        }
        for (field, values) in self.fields.into_iter().zip(self.values) {
            if !values.is_empty() {
                content.cloud.attributes.push(Attribute {
                    name: field.name,
                    width: 1,
                    kind: field.kind,
                    values,
                });
            }
        }
        content
    }
}

#[cfg(not(feature = "laz"))]
fn unpack(input: &mut Input<'_>, _: &mut Points, _: usize) -> Result<()> {
    Err(input.unsupported(
        "this is LAZ, and this build reads LAS only",
        "Build with the feature \"laz\", or convert to LAS",
    ))
}

/// Unpacks LAZ.
#[cfg(feature = "laz")]
fn unpack(input: &mut Input<'_>, reader: &mut Points, per_point: usize) -> Result<()> {
    use crate::foreign::guarded;
    let damaged = |input: &Input<'_>, found: String| {
        input.malformed(
            Place::Byte(reader_start(input) as u64),
            found,
            "LAZ data",
            "The file is cut off or damaged: get it again",
        )
    };
    let vlr = reader.header.laszip.as_ref().and_then(|b| laz::LazVlr::from_buffer(b).ok());
    // The crate's own sum of the sizes is of 16 bits.
    let bytes = |v: &laz::LazVlr| v.items().iter().map(|i| usize::from(i.size())).sum::<usize>();
    let Some(vlr) = vlr.filter(|v| !v.items().is_empty() && bytes(v) == reader.header.record) else {
        return Err(damaged(input, "no LASzip record that fits the point format".into()));
    };
    let start = reader.header.start;
    if let Err(found) = check_chunks(input.data, start, reader.header.points, reader.header.record, &vlr) {
        return Err(damaged(input, found));
    }
    let data = input.data;
    let mut source = std::io::Cursor::new(data);
    source.set_position(start as u64);
    // The crate indexes its tables with numbers from the file.
    let mut unpacker = match guarded(|| laz::LasZipDecompressor::new(source, vlr)) {
        Some(Ok(u)) => u,
        Some(Err(e)) => return Err(damaged(input, format!("data that do not unpack ({e})"))),
        None => return Err(damaged(input, "data that do not unpack".into())),
    };
    let record = reader.header.record;
    let mut block = vec![0u8; BLOCK * record];
    let mut left = reader.header.points;
    while left > 0 {
        let mut n = left.min(BLOCK as u64) as usize;
        input.reserve(n, per_point)?;
        let bytes = &mut block[..n * record];
        let mut whole = 0;
        let result = guarded(|| {
            for point in bytes.chunks_exact_mut(record) {
                unpacker.decompress_one(point)?;
                whole += 1;
            }
            Ok::<(), std::io::Error>(())
        });
        let broken = !matches!(result, Some(Ok(())));
        if broken {
            n = whole;
        }
        reader.take(&block[..n * record]);
        left -= n as u64;
        if broken {
            if reader.content.cloud.positions.is_empty() {
                return Err(damaged(input, "data that do not unpack".into()));
            }
            let first = Some(format!("point {}", reader.content.cloud.positions.len()));
            input.report.add(
                "points announced by the header that cannot be unpacked (cut off or damaged)",
                left,
                first,
            );
            break;
        }
    }
    Ok(())
}

#[cfg(feature = "laz")]
fn reader_start(input: &Input<'_>) -> usize {
    At(input.data).u32(96).unwrap_or(0) as usize
}

/// Checks the sizes that the unpacker would allocate by: the chunk table, and the layers of each chunk of
/// formats 6 and up (a chunk is: one raw point, a count, the size of each layer, the layers).
#[cfg(feature = "laz")]
fn check_chunks(
    data: &[u8],
    start: usize,
    points: u64,
    record: usize,
    vlr: &laz::LazVlr,
) -> std::result::Result<(), String> {
    let at = At(data);
    let Some(table) = at.u64(start) else { return Err("the end of the file".into()) };
    // A repeated point costs next to nothing, but every chunk holds a raw point, and chunks have limits.
    const POINTS_PER_BYTE: u64 = 4096;
    if points / POINTS_PER_BYTE > data.len() as u64 {
        return Err(format!("{points} points announced in {} bytes", data.len()));
    }
    let table = if (table as i64) <= start as i64 {
        // Written to a stream: the place of the table is at the end.
        data.len().checked_sub(8).and_then(|end| at.u64(end)).unwrap_or(u64::MAX)
    } else {
        table
    };
    if let Some(chunks) = usize::try_from(table).ok().and_then(|t| at.u32(t.checked_add(4)?))
        && chunks as usize > data.len() / record + 1
    {
        return Err(format!("{chunks} chunks announced in {} bytes", data.len()));
    }
    use laz::LazItemType as Item;
    let layers: usize = vlr
        .items()
        .iter()
        .map(|i| match i.item_type() {
            Item::Point14 => 9,
            Item::RGB14 | Item::WavePacket14 => 1,
            Item::RGBNIR14 => 2,
            Item::Byte14(n) => usize::from(n),
            _ => 0,
        })
        .sum();
    if layers == 0 {
        return Ok(());
    }
    let mut place = start + 8;
    let mut left = points;
    while left > 0 {
        let Some(count) = at.u32(place + record) else { break };
        let sizes = place + record + 4;
        let mut end = sizes + 4 * layers;
        for k in 0..layers {
            // A chunk that is cut off is found when it is read; its layers must not be larger than the file.
            end = end.saturating_add(at.u32(sizes + 4 * k).unwrap_or(0) as usize);
        }
        if end > data.len() {
            return Err(format!("a chunk at byte {place} that ends behind the file"));
        }
        if count == 0 {
            break;
        }
        left = left.saturating_sub(u64::from(count));
        place = end;
    }
    Ok(())
}
