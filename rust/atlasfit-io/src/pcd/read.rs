//! Reads PCD.

use super::columns::{Columns, Target, plan, unpack};
use super::header::{self, Encoding, Header, Kind};
use super::lzf;
use crate::bad_lines::BadLines;
use crate::content::Content;
use crate::error::{Error, Location, Result};
use crate::input::Input;
use crate::text;
use atlasfit::geometry::{ScalarKind, Scanners};

/// Points taken at a time: their bytes stay in the cache while field after field is taken from them.
const BLOCK: usize = 4096;

/// One in so many rows of text may be unreadable before the file is refused; ten may always be.
const BAD_ROWS: u64 = 20;

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let header = header::read(input)?;
    let row = header.row();
    let mut out = match header.encoding {
        Encoding::Ascii => ascii(input, &header)?,
        Encoding::Binary => {
            let there = input.len.saturating_sub(header.end);
            let n = points_there(input, &header, there)?;
            let mut columns = plan(input, &header, n)?;
            let mut first = 0;
            input.blocks(header.end, n * row, BLOCK.saturating_mul(row), |rows| {
                columns.take_rows(first, rows, row);
                first += BLOCK;
            })?;
            columns.content
        }
        Encoding::Compressed => {
            let bytes = decompress(input, &header)?;
            let n = points_there(input, &header, bytes.len())?;
            let mut columns = plan(input, &header, n)?;
            columns.take_fields(&bytes, n);
            columns.content
        }
    };
    if let Some(viewpoint) = header.viewpoint {
        input.reserve(out.cloud.len(), 4)?;
        let of_point = vec![0; out.cloud.len()];
        out.cloud.scanners = Some(Scanners { positions: vec![viewpoint], of_point });
    }
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
    header::read(input).is_ok_and(|h| h.encoding == Encoding::Binary)
}

/// The number of points, if so many bytes hold them.
fn points_there(input: &Input<'_>, header: &Header, bytes: usize) -> Result<usize> {
    let row = header.row();
    let there = (bytes / row.max(1)) as u64;
    if there < header.points || row == 0 {
        return Err(input.malformed(
            Location::Byte(input.len as u64),
            format!("bytes for {there} points"),
            format!("{} points of {row} bytes, as the header says", header.points),
            "The file is cut off or its header is wrong: get it again",
        ));
    }
    Ok(header.points as usize)
}

/// Reads points as lines of text. A line that cannot be read becomes a point that is not finite.
fn ascii(input: &mut Input<'_>, header: &Header) -> Result<Content> {
    let numbers = header.numbers();
    let mut lines = input.lines(header.end, header.lines);
    let cut_off = |input: &Input<'_>, line: u64, points: u64| {
        input.malformed(
            Location::Line(line),
            format!("the end of the file after at most {points} points"),
            format!("{} points, as the header says", header.points),
            "The file is cut off: get it again",
        )
    };
    // A number takes two bytes with what separates it; up to half of the rows' bytes may be missing where
    // rows are damaged.
    let possible = (input.data.len().saturating_sub(header.end) / numbers.max(1)) as u64;
    if possible < header.points {
        return Err(cut_off(input, header.lines, possible));
    }
    let mut columns = plan(input, header, header.points as usize)?;
    let mut bad = BadLines::default();
    let mut row = vec![0.0; if header.points > 0 { numbers } else { 0 }];
    for point in 0..header.points {
        let Some(line) = lines.next_filled() else { return Err(cut_off(input, lines.number(), point)) };
        let mut words = text::tokens(line.text);
        let ok = row.iter_mut().all(|v| words.next().and_then(text::number).map(|w| *v = w).is_some());
        if !ok {
            bad.add(line);
            row.fill(f64::NAN);
        }
        take_row(&mut columns, point as usize, &row, ok);
        if bad.count > 10 && bad.count > header.points / BAD_ROWS {
            return Err(bad.error(
                input,
                format!("{numbers} numbers of a point"),
                "Too many rows are like this: the header and the rows do not agree",
            ));
        }
    }
    input.report.add("rows that cannot be read, kept as NaN", bad.count, bad.first());
    Ok(columns.content)
}

/// Takes the numbers of point `i`; `ok` is whether its line could be read.
fn take_row(columns: &mut Columns, i: usize, row: &[f64], ok: bool) {
    let cloud = &mut columns.content.cloud;
    let mut at = 0;
    for slot in &columns.slots {
        let values = &row[at..at + slot.count];
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
}

/// Unpacks the data. The size that the file claims is only a limit.
fn decompress(input: &mut Input<'_>, header: &Header) -> Result<Vec<u8>> {
    let rest = input.data.get(header.end..).unwrap_or_default();
    let word = |i: usize| rest.get(i..i + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let (Some(packed), Some(unpacked)) = (word(0), word(4)) else { return Err(broken(input, header, 0)) };
    let Some(data) = packed.checked_add(8).and_then(|end| rest.get(8..end)) else {
        return Err(broken(input, header, rest.len()));
    };
    input.reserve(lzf::most(data, unpacked), 1)?;
    lzf::unpack(data, unpacked).map_err(|at| broken(input, header, at))
}

fn broken(input: &Input<'_>, header: &Header, at: usize) -> Error {
    input.malformed(
        Location::Byte((header.end + at) as u64),
        "compressed data that do not unpack",
        "LZF data",
        "The file is damaged: get it again",
    )
}
