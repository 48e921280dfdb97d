//! Reads LAS, and LAZ through `laz`.

use super::header::{Header, RECORDS, parse};
#[cfg(feature = "laz")]
use super::laz::unpack;
use super::points::{BLOCK, Points};
use crate::content::Content;
use crate::error::{Location, Result};
use crate::input::Input;

/// Whether the file is rows of bytes from some place on: then it can be read block by block.
pub(crate) fn is_rows(input: &Input<'_>) -> bool {
    parse(input.data).is_some_and(|h| !h.compressed && h.start <= input.data.len())
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let header = checked_header(input)?;
    let mut points = Points::new(header);
    if points.header.compressed {
        unpack(input, &mut points)?;
    } else {
        rows(input, &mut points)?;
    }
    Ok(points.finish(input))
}

/// The header, if points of its format can be read.
pub(super) fn checked_header(input: &Input<'_>) -> Result<Header> {
    let damaged = |at: usize, found: String, expected: &str| {
        let advice = "The file is cut off or damaged: get it again";
        input.malformed(Location::Byte(at as u64), found, expected, advice)
    };
    let Some(header) = parse(input.data) else {
        return Err(damaged(input.len, "the end of the file".into(), "a LAS header"));
    };
    let Some(&least) = RECORDS.get(usize::from(header.format)) else {
        return Err(input.unsupported(
            format!("LAS point format {}", header.format),
            "Write it in one of the formats 0 to 10",
        ));
    };
    if header.record < least {
        let found = format!("records of {} bytes", header.record);
        let expected = format!("at least {least} bytes for point format {}", header.format);
        return Err(damaged(105, found, &expected));
    }
    Ok(header)
}

/// Reads records that are not compressed. A file that ends among them gives the points that are whole.
fn rows(input: &mut Input<'_>, reader: &mut Points) -> Result<()> {
    let Header { start, record, points, .. } = reader.header;
    let there = (input.len.saturating_sub(start) / record) as u64;
    let n = points.min(there) as usize;
    if there < points {
        if n == 0 {
            return Err(input.malformed(
                Location::Byte(input.len as u64),
                "the end of the file",
                format!("{points} points"),
                "The file is cut off or damaged: get it again",
            ));
        }
        input.report.add(
            "points announced by the header but not in the file (it is cut off)",
            points - there,
            Some(format!("byte {}", input.len)),
        );
    }
    input.reserve(n, reader.bytes_per_point())?;
    reader.expected = n;
    input.blocks(start.min(input.len), n * record, BLOCK * record, |records| reader.take(records))
}

#[cfg(not(feature = "laz"))]
fn unpack(input: &mut Input<'_>, _: &mut Points) -> Result<()> {
    Err(input.unsupported(
        "this is LAZ, and this build reads LAS only",
        "Build with the feature \"laz\", or convert to LAS",
    ))
}
