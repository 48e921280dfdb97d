//! LAS and LAZ row by row: where things stand, what packs and unpacks the rows, and what the header says of
//! the points when these have moved.

use super::header::Fixed;
use super::read::checked_header;
use crate::bytes::ColumnLayout;
use crate::error::Result;
use crate::input::Input;
use crate::row_layout::RowLayout;
use atlasfit::geometry::ScalarKind;
#[cfg(feature = "laz")]
pub(crate) use packed::{Packer, Unpacker, packer, unpacker};
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Points of a chunk that is written.
#[cfg(feature = "laz")]
const CHUNK: u32 = 50_000;
/// Who a COPC file's own records are of.
const COPC: &[u8] = b"copc";

/// Where the points of a LAS file begin; nothing where this is none.
pub(crate) fn start_of_points(head: &[u8]) -> Option<u64> {
    super::is_las(head).then(|| Fixed(head).u32(96).map(u64::from)).flatten()
}

/// Where things stand. `input.data` holds all before the points.
pub(crate) fn row_layout(input: &Input<'_>) -> Result<RowLayout> {
    let header = checked_header(input)?;
    let layout = |offset, kind| ColumnLayout { stride: header.record, offset, kind, big_endian: false };
    let colors = match header.format {
        2 => Some(20),
        3 | 5 => Some(28),
        7 | 8 | 10 => Some(30),
        _ => None,
    };
    Ok(RowLayout {
        start: header.start as u64,
        count: header.points,
        stride: header.record,
        axes: [0, 4, 8].map(|at| layout(at, ScalarKind::I32)),
        scale: header.scale,
        offset: header.offset,
        colors: colors.map(|at| ([at, at + 2, at + 4].map(|at| layout(at, ScalarKind::U16)), 65535.0)),
        crs: crs(input.data),
        packing: header.compressed.then(|| header.laszip.unwrap_or_default()),
    })
}

/// A record of the header: where it starts, and its length with its own header.
struct Vlr {
    at: usize,
    length: usize,
}

/// The records of the header.
fn records(head: &[u8]) -> Vec<Vlr> {
    let numbers = Fixed(head);
    let mut at = usize::from(numbers.u16(94).unwrap_or(0));
    let mut found = Vec::new();
    for _ in 0..numbers.u32(100).unwrap_or(0) {
        let Some(body) = numbers.u16(at + 20) else { break };
        let length = 54 + usize::from(body);
        if at + length > head.len() {
            break;
        }
        found.push(Vlr { at, length });
        at += length;
    }
    found
}

/// The bodies of the records that say what the coordinates mean.
fn crs(head: &[u8]) -> Option<Vec<u8>> {
    let projection = |v: &Vlr| head[v.at + 2..].starts_with(b"LASF_Projection");
    let found: Vec<u8> = (records(head).iter().filter(|v| projection(v)))
        .flat_map(|v| &head[v.at + 18..v.at + v.length])
        .copied()
        .collect();
    (!found.is_empty()).then_some(found)
}

/// Says in the header that the points are packed in chunks of one size, and in the order of the file: what
/// COPC files say of theirs is taken out.
#[cfg(feature = "laz")]
pub(crate) fn fixed_chunks(head: &mut [u8]) {
    for v in records(head) {
        let user = &mut head[v.at + 2..v.at + 18];
        if user.starts_with(COPC) {
            user.fill(0);
        } else if user.starts_with(b"laszip encoded") && v.length >= 54 + 16 {
            head[v.at + 54 + 12..v.at + 54 + 16].copy_from_slice(&CHUNK.to_le_bytes());
        }
    }
}

/// Ends a file of moved points: the records that stand behind the points of `from` are copied, and the header
/// says where they are and how far the points reach.
pub(crate) fn finish(from: &Path, out: &mut BufWriter<File>, extent: [[f64; 3]; 2]) -> std::io::Result<()> {
    let mut source = File::open(from)?;
    let mut head = [0; 375];
    let there = source.read(&mut head)?;
    let numbers = Fixed(&head[..there]);
    let (mut first, mut kept) = (0u64, 0u32);
    // LAS 1.4.
    let extended = there == 375 && head[25] >= 4 && numbers.u16(94).is_some_and(|size| size >= 375);
    if extended {
        let mut at = numbers.u64(235).unwrap_or(0);
        for _ in 0..numbers.u32(243).unwrap_or(0) {
            let mut record = [0; 60];
            source.seek(SeekFrom::Start(at))?;
            source.read_exact(&mut record)?;
            let length = Fixed(&record).u64(20).unwrap_or(0);
            at = at.saturating_add(60).saturating_add(length);
            if record[2..].starts_with(COPC) {
                continue;
            }
            if kept == 0 {
                first = out.stream_position()?;
            }
            kept += 1;
            out.write_all(&record)?;
            std::io::copy(&mut (&source).take(length), out)?;
        }
    }
    if extended {
        out.seek(SeekFrom::Start(235))?;
        out.write_all(&first.to_le_bytes())?;
        out.write_all(&kept.to_le_bytes())?;
    }
    if extent[0][0] <= extent[1][0] {
        out.seek(SeekFrom::Start(179))?;
        for (least, greatest) in extent[0].iter().zip(&extent[1]) {
            out.write_all(&greatest.to_le_bytes())?;
            out.write_all(&least.to_le_bytes())?;
        }
    }
    out.flush()
}

#[cfg(feature = "laz")]
mod packed {
    use crate::foreign::guarded;
    use laz::{LasZipCompressor, LasZipDecompressor, LazVlr, LazVlrBuilder};
    use std::fs::File;
    use std::io::{BufReader, BufWriter};

    /// Unpacks rows.
    pub(crate) type Unpacker = LasZipDecompressor<'static, BufReader<File>>;
    /// Packs rows.
    pub(crate) type Packer = LasZipCompressor<'static, BufWriter<File>>;

    /// What unpacks a file's rows, from where these begin; nothing where the file does not say how.
    pub(crate) fn unpacker(file: File, packing: &[u8], stride: usize) -> Option<Unpacker> {
        let vlr = LazVlr::from_buffer(packing).ok()?;
        // The crate's own sum of the sizes is of 16 bits.
        let bytes: usize = vlr.items().iter().map(|i| usize::from(i.size())).sum();
        if vlr.items().is_empty() || bytes != stride {
            return None;
        }
        guarded(|| LasZipDecompressor::new(BufReader::with_capacity(1 << 20, file), vlr))?.ok()
    }

    /// What packs rows as another file's are packed.
    pub(crate) fn packer(file: BufWriter<File>, packing: &[u8]) -> Option<Packer> {
        let vlr = LazVlr::from_buffer(packing).ok()?;
        let vlr = LazVlrBuilder::new(vlr.items().clone()).with_fixed_chunk_size(super::CHUNK).build();
        LasZipCompressor::new(file, vlr).ok()
    }
}
