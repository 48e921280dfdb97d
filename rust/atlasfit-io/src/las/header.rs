//! The header of a LAS file, and where the fields stand in its records.

use crate::bytes::size;
use atlasfit::geometry::ScalarKind;

/// Whether these bytes are a LAS or LAZ file.
pub(crate) fn is_las(data: &[u8]) -> bool {
    data.starts_with(b"LASF")
}

/// The parts of the header that reading needs.
pub(super) struct Header {
    /// How many points the file announces.
    pub points: u64,
    /// Where the points begin: a byte offset.
    pub start: usize,
    /// The point format, 0 to 10.
    pub format: u8,
    /// Bytes per point.
    pub record: usize,
    pub compressed: bool,
    /// A position is integer × scale + offset, per coordinate.
    pub scale: [f64; 3],
    pub offset: [f64; 3],
    /// The LASzip record.
    pub laszip: Option<Vec<u8>>,
    /// What the file says of the bytes behind the standard record.
    extra: Vec<Field>,
}

/// One attribute: where it stands in a record, and how its number becomes a value.
pub(super) struct Field {
    pub name: String,
    /// Where it starts in a record, in bytes.
    pub offset: usize,
    /// The type in the file.
    pub stored: ScalarKind,
    /// The type of the attribute.
    pub kind: ScalarKind,
    bits: Option<Bits>,
    scale: f64,
    add: f64,
}

/// Some bits of a byte.
#[derive(Clone, Copy)]
struct Bits {
    shift: u32,
    mask: u32,
}

impl Field {
    /// A number that is its own value.
    fn plain(name: &str, offset: usize, kind: ScalarKind) -> Self {
        Self { name: name.into(), offset, stored: kind, kind, bits: None, scale: 1.0, add: 0.0 }
    }

    /// Some bits of the byte at `offset`.
    fn packed(name: &str, offset: usize, shift: u32, mask: u32) -> Self {
        Self { bits: Some(Bits { shift, mask }), ..Self::plain(name, offset, ScalarKind::U8) }
    }

    /// The value of a number as the file has it.
    #[inline]
    pub fn value(&self, v: f64) -> f64 {
        let v = self.bits.map_or(v, |b| f64::from((v as u32 >> b.shift) & b.mask));
        v * self.scale + self.add
    }
}

/// Reads little-endian numbers at fixed places.
pub(super) struct Fixed<'d>(pub &'d [u8]);

impl Fixed<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        self.0.get(at..at.checked_add(N)?)?.try_into().ok()
    }
    pub fn u16(&self, at: usize) -> Option<u16> {
        self.bytes(at).map(u16::from_le_bytes)
    }
    pub fn u32(&self, at: usize) -> Option<u32> {
        self.bytes(at).map(u32::from_le_bytes)
    }
    pub fn u64(&self, at: usize) -> Option<u64> {
        self.bytes(at).map(u64::from_le_bytes)
    }
    fn f64(&self, at: usize) -> Option<f64> {
        self.bytes(at).map(f64::from_le_bytes)
    }
}

/// Bytes of a record of each point format, without extra bytes.
pub(super) const RECORDS: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Reads the header. `None` where the data end inside of it.
pub(super) fn parse(data: &[u8]) -> Option<Header> {
    let numbers = Fixed(data);
    let minor = *data.get(25)?;
    let header_size = usize::from(numbers.u16(94)?);
    let start = numbers.u32(96)? as usize;
    let vlrs = numbers.u32(100)?;
    let format = *data.get(104)?;
    let record = usize::from(numbers.u16(105)?);
    let mut points = u64::from(numbers.u32(107)?);
    if minor >= 4 && header_size >= 375 {
        points = numbers.u64(247).filter(|&p| p > 0).unwrap_or(points);
    }
    let three = |from: usize| Some([numbers.f64(from)?, numbers.f64(from + 8)?, numbers.f64(from + 16)?]);
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
    let mut record_start = header_size;
    for _ in 0..vlrs {
        let (Some(user), Some(id), Some(len)) = (
            numbers.bytes::<16>(record_start + 2),
            numbers.u16(record_start + 18),
            numbers.u16(record_start + 20),
        ) else {
            break;
        };
        let Some(body) = data.get(record_start + 54..record_start + 54 + usize::from(len)) else { break };
        if user.starts_with(b"laszip encoded") && id == 22204 {
            header.laszip = Some(body.to_vec());
        } else if user.starts_with(b"LASF_Spec") && id == 4 {
            header.extra = extra_fields(body, *RECORDS.get(usize::from(header.format))?);
        }
        record_start += 54 + usize::from(len);
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
        let numbers = Fixed(d);
        let scale = if d[3] & 8 != 0 { numbers.f64(112).unwrap_or(1.0) } else { 1.0 };
        let add = if d[3] & 16 != 0 { numbers.f64(136).unwrap_or(0.0) } else { 0.0 };
        let shown = if scale == 1.0 && add == 0.0 { kind } else { ScalarKind::F64 };
        out.push(Field { name, offset, stored: kind, kind: shown, bits: None, scale, add });
        offset += size(kind);
    }
    out
}

/// The attributes of the file's point format, and those that the file describes itself.
pub(super) fn fields(header: &mut Header) -> Vec<Field> {
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
