//! Reads the rows of the vertices into columns.

use super::body::Body;
use super::columns::{Columns, Target};
use super::header::{Element, Encoding};
use crate::bad_lines::BadLines;
use crate::bytes::{self, ColumnLayout, column, size};
use crate::error::Result;
use crate::text;

/// Rows per block where columns are taken one by one: small enough for the cache, long enough to amortise the
/// dispatch on types.
const BLOCK: usize = 2048;

/// In an ASCII file, one in so many vertex rows may be unreadable before the file is refused; ten may always
/// be.
const BAD_ROWS: u64 = 100;

/// Reads the vertices. Where the file has no faces, texture coordinates are attributes like others.
pub(super) fn read(body: &mut Body<'_, '_>, element: &Element, has_faces: bool) -> Result<Columns> {
    let mut columns = Columns::plan(element, has_faces);
    let possible = body.rows_possible(element);
    if possible < element.count {
        return Err(body.cut_off(element, possible));
    }
    let n = element.count as usize;
    if n >= u32::MAX as usize {
        return Err(body.input.unsupported(
            format!("{n} vertices, and indices have 32 bits"),
            "Split the file into parts of fewer than 4 thousand million points",
        ));
    }
    columns.size(n, body.input)?;
    match (body.encoding, element.stride()) {
        (Encoding::Ascii, _) => ascii(body, element, &mut columns)?,
        (_, Some(stride)) => {
            // rows_possible has checked that the bytes are there.
            let (parts, mut first) = (parts(element, &columns.targets, stride, body.big_endian()), 0);
            body.input.blocks(body.at, n * stride, BLOCK * stride, |rows| {
                parts.iter().for_each(|part| take_part(&mut columns, part, first, rows));
                first += BLOCK;
            })?;
            body.at += n * stride;
        }
        (_, None) => with_lists(body, element, &mut columns)?,
    }
    Ok(columns)
}

/// Binary rows of differing length.
fn with_lists(body: &mut Body<'_, '_>, element: &Element, columns: &mut Columns) -> Result<()> {
    let targets = columns.targets.clone();
    for row in body.input.watched(0..element.count) {
        for (p, &target) in element.properties.iter().zip(&targets) {
            let Some(single) = body.take(p.list, p.kind) else { return Err(body.cut_off(element, row)) };
            match target {
                Target::List(k) => {
                    body.input.reserve(body.list.len(), 8)?;
                    columns.push_list(k, &body.list);
                }
                _ => columns.set(target, row as usize, single),
            }
        }
    }
    Ok(())
}

/// Rows as lines of text. A line that cannot be read becomes a vertex that is not finite.
fn ascii(body: &mut Body<'_, '_>, element: &Element, columns: &mut Columns) -> Result<()> {
    let mut bad = BadLines::default();
    for row in body.input.watched(0..element.count) {
        let Some(line) = body.next_line() else { return Err(body.cut_off(element, row)) };
        if ascii_row(body, element, columns, row as usize, line.text)? {
            continue;
        }
        bad.add(line);
        columns.positions[row as usize] = [f64::NAN; 3];
        if bad.count > (element.count / BAD_ROWS).max(10).min(element.count / 2) {
            return Err(bad.error(
                body.input,
                format!("{} numbers of a vertex", element.properties.len()),
                "Too many rows are like this: the header and the rows do not agree",
            ));
        }
    }
    body.input.report.add("vertex rows that cannot be read, kept as NaN", bad.count, bad.first());
    Ok(())
}

/// Reads one line; whether that was possible.
fn ascii_row(
    body: &mut Body<'_, '_>,
    element: &Element,
    columns: &mut Columns,
    row: usize,
    line: &[u8],
) -> Result<bool> {
    let mut words = text::tokens(line);
    let mut ok = true;
    for (i, p) in element.properties.iter().enumerate() {
        if p.list.is_none() {
            let Some(value) = words.next().and_then(value) else { return Ok(false) };
            columns.set(columns.targets[i], row, value);
            continue;
        }
        // A row that ends before its list has an empty one.
        let count = words.next().map_or(Some(0.0), text::number).unwrap_or(-1.0);
        let wanted = count.max(0.0) as u64;
        body.list.clear();
        body.list.extend((0..wanted).map_while(|_| words.next().and_then(text::number)));
        ok &= count >= 0.0 && body.list.len() as u64 == wanted;
        if let Target::List(k) = columns.targets[i] {
            body.input.reserve(body.list.len(), 8)?;
            columns.push_list(k, &body.list);
        }
    }
    Ok(ok)
}

/// A scalar of an ASCII body; some programs write truth values as words.
fn value(word: &[u8]) -> Option<f64> {
    text::number(word).or(match word {
        b"true" | b"True" => Some(1.0),
        b"false" | b"False" => Some(0.0),
        _ => None,
    })
}

/// What is taken from the rows of a block in one go: one column, or three of one target that stand together.
struct Part {
    target: Target,
    layout: ColumnLayout,
    three: bool,
}

/// Which parts a row consists of. Three properties of one type that stand together, as nearly always, are
/// one.
fn parts(element: &Element, targets: &[Target], stride: usize, big_endian: bool) -> Vec<Part> {
    let properties = &element.properties;
    let together = |i: usize, target: fn(usize) -> Target| {
        (0..3).all(|k| targets.get(i + k) == Some(&target(k)) && properties[i + k].kind == properties[i].kind)
    };
    let mut out = Vec::new();
    let (mut i, mut offset) = (0, 0);
    while i < properties.len() {
        let three = [Target::Position, Target::Normal, Target::Color].iter().any(|&t| together(i, t));
        let layout = ColumnLayout { stride, offset, kind: properties[i].kind, big_endian };
        out.push(Part { target: targets[i], layout, three });
        let next = if three { i + 3 } else { i + 1 };
        offset += properties[i..next].iter().map(|p| size(p.kind)).sum::<usize>();
        i = next;
    }
    out
}

/// Takes one part of a block of rows, of which `first` is the first: dispatches on the target outside of the
/// loop over rows.
fn take_part(columns: &mut Columns, part: &Part, first: usize, rows: &[u8]) {
    let Part { layout, three, .. } = *part;
    match part.target {
        Target::Position(k) => {
            let out = &mut columns.positions[first..];
            if three {
                bytes::columns(rows, layout, |i, v| out[i] = v);
            } else {
                column(rows, layout, |i, v| out[i][k] = v);
            }
        }
        Target::Normal(k) => {
            let out = &mut columns.normals[first..];
            if three {
                bytes::columns(rows, layout, |i, v| out[i] = v.map(|v| v as f32));
            } else {
                column(rows, layout, |i, v| out[i][k] = v as f32);
            }
        }
        Target::Color(k) => {
            let scale = columns.color_scale;
            let out = &mut columns.colors[first..];
            if three {
                bytes::columns(rows, layout, |i, v: [f64; 3]| {
                    out[i][..3].copy_from_slice(&[0, 1, 2].map(|c| (v[c] / scale[c]) as f32));
                });
            } else {
                let scale = scale[k];
                column(rows, layout, |i, v| out[i][k] = (v / scale) as f32);
            }
        }
        Target::Uv(k) => {
            let out = &mut columns.uv[first..];
            column(rows, layout, |i, v| out[i][k] = v as f32);
        }
        Target::Scalar(k) => {
            let out = &mut columns.scalars[k].values[first..];
            column(rows, layout, |i, v| out[i] = v);
        }
        Target::List(_) => {}
    }
}
