//! Unpacks LAZ through the `laz` crate, which is not hardened against damaged files: the sizes that it would
//! allocate by are checked first, and its panics become errors.

use super::header::{Fixed, Header};
use super::points::{BLOCK, Points};
use crate::error::{Error, Location, Result};
use crate::foreign::guarded;
use crate::input::Input;
use laz::{LasZipDecompressor, LazItemType as Item, LazVlr};

/// Unpacks the records into the columns. A file that ends among them gives the points in front.
pub(super) fn unpack(input: &mut Input<'_>, reader: &mut Points) -> Result<()> {
    let Header { start, record, points, .. } = reader.header;
    let damaged = |input: &Input<'_>, found: String| damaged(input, start, found);
    let vlr = reader.header.laszip.as_ref().and_then(|b| LazVlr::from_buffer(b).ok());
    // The crate's own sum of the sizes is of 16 bits.
    let bytes = |v: &LazVlr| v.items().iter().map(|i| usize::from(i.size())).sum::<usize>();
    let Some(vlr) = vlr.filter(|v| !v.items().is_empty() && bytes(v) == record) else {
        return Err(damaged(input, "no LASzip record that fits the point format".into()));
    };
    check_chunks(input.data, &reader.header, &vlr).map_err(|found| damaged(input, found))?;
    let mut source = std::io::Cursor::new(input.data);
    source.set_position(start as u64);
    // The crate indexes its tables with numbers from the file.
    let mut unpacker = match guarded(|| LasZipDecompressor::new(source, vlr)) {
        Some(Ok(u)) => u,
        Some(Err(e)) => return Err(damaged(input, format!("data that do not unpack ({e})"))),
        None => return Err(damaged(input, "data that do not unpack".into())),
    };
    let per_point = reader.bytes_per_point();
    let mut block = vec![0u8; BLOCK * record];
    let mut left = points;
    while left > 0 {
        let mut n = left.min(BLOCK as u64) as usize;
        input.check()?;
        input.reserve(n, per_point)?;
        let mut whole = 0;
        let result = guarded(|| {
            for point in block[..n * record].chunks_exact_mut(record) {
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
            let done = reader.content.cloud.positions.len();
            if done == 0 {
                return Err(damaged(input, "data that do not unpack".into()));
            }
            let what = "points announced by the header that cannot be unpacked (cut off or damaged)";
            input.report.add(what, left, Some(format!("point {done}")));
            break;
        }
    }
    Ok(())
}

fn damaged(input: &Input<'_>, start: usize, found: String) -> Error {
    let advice = "The file is cut off or damaged: get it again";
    input.malformed(Location::Byte(start as u64), found, "LAZ data", advice)
}

/// Checks the sizes that the unpacker would allocate by: the chunk table, and the layers of each chunk of
/// formats 6 and up (a chunk is: one raw point, a count, the size of each layer, the layers).
fn check_chunks(data: &[u8], header: &Header, vlr: &LazVlr) -> std::result::Result<(), String> {
    let &Header { start, points, record, .. } = header;
    let numbers = Fixed(data);
    let Some(table) = numbers.u64(start) else { return Err("the end of the file".into()) };
    // A repeated point costs next to nothing, but every chunk holds a raw point, and chunks have limits.
    const POINTS_PER_BYTE: u64 = 4096;
    if points / POINTS_PER_BYTE > data.len() as u64 {
        return Err(format!("{points} points announced in {} bytes", data.len()));
    }
    let table = if (table as i64) <= start as i64 {
        // Written to a stream: the place of the table is at the end.
        data.len().checked_sub(8).and_then(|end| numbers.u64(end)).unwrap_or(u64::MAX)
    } else {
        table
    };
    if let Some(chunks) = usize::try_from(table).ok().and_then(|t| numbers.u32(t.checked_add(4)?))
        && chunks as usize > data.len() / record + 1
    {
        return Err(format!("{chunks} chunks announced in {} bytes", data.len()));
    }
    let layers = layers(vlr);
    if layers == 0 {
        return Ok(());
    }
    let mut chunk = start + 8;
    let mut left = points;
    while left > 0 {
        let Some(count) = numbers.u32(chunk + record) else { break };
        let sizes = chunk + record + 4;
        let mut end = sizes + 4 * layers;
        for k in 0..layers {
            // A chunk that is cut off is found when it is read; its layers must not be larger than the file.
            end = end.saturating_add(numbers.u32(sizes + 4 * k).unwrap_or(0) as usize);
        }
        if end > data.len() {
            return Err(format!("a chunk at byte {chunk} that ends behind the file"));
        }
        if count == 0 {
            break;
        }
        left = left.saturating_sub(u64::from(count));
        chunk = end;
    }
    Ok(())
}

/// How many layers a chunk has: only formats 6 and up have some.
fn layers(vlr: &LazVlr) -> usize {
    vlr.items()
        .iter()
        .map(|i| match i.item_type() {
            Item::Point14 => 9,
            Item::RGB14 | Item::WavePacket14 => 1,
            Item::RGBNIR14 => 2,
            Item::Byte14(n) => usize::from(n),
            _ => 0,
        })
        .sum()
}
