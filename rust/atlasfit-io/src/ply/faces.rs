//! Reads the rows of faces and of triangle strips.

use super::body::Body;
use super::header::{Element, Encoding};
use crate::error::Result;
use crate::faces::{Faces, index};
use crate::text;
use atlasfit::geometry::ScalarKind;

/// The properties of a face that are kept: their places in the row.
struct Kept {
    /// The list of vertices.
    indices: usize,
    /// The list of texture coordinates, two per corner.
    texcoord: Option<usize>,
    /// Our UV chart.
    chart: Option<usize>,
}

impl Kept {
    /// `None` for faces without a list of vertices.
    fn find(element: &Element) -> Option<Self> {
        let list = |ok: &dyn Fn(&str) -> bool| {
            element.properties.iter().position(|p| p.list.is_some() && ok(&p.name.to_ascii_lowercase()))
        };
        let indices = list(&|n| n == "vertex_indices" || n == "vertex_index")
            .or_else(|| list(&|n| n.contains("vert") || n.contains("ind")))
            .or_else(|| list(&|n| !n.contains("tex")))?;
        let texcoord = list(&|n| n == "texcoord" || n == "texcoords");
        let chart = element.properties.iter().position(|p| {
            p.list.is_none() && p.name == "chart" && matches!(p.kind, ScalarKind::I32 | ScalarKind::U32)
        });
        Some(Self { indices, texcoord, chart })
    }

    fn has(&self, i: usize) -> bool {
        i == self.indices || Some(i) == self.texcoord || Some(i) == self.chart
    }
}

/// One face while it is read.
#[derive(Default)]
struct Row {
    corners: Vec<u32>,
    uv: Vec<[f32; 2]>,
    chart: f64,
}

impl Row {
    fn clear(&mut self) {
        self.corners.clear();
        self.uv.clear();
        self.chart = f64::from(u32::MAX);
    }

    /// Takes property `i`: its value, or the entries of its list.
    fn put(&mut self, kept: &Kept, i: usize, value: f64, list: &[f64]) {
        if i == kept.indices {
            self.corners.extend(list.iter().map(|&v| index(v as i64)));
        } else if Some(i) == kept.texcoord {
            self.uv.extend(list.chunks_exact(2).map(|c| [c[0] as f32, c[1] as f32]));
        } else if Some(i) == kept.chart {
            self.chart = value;
        }
    }

    fn push_to(&self, kept: &Kept, faces: &mut Faces) {
        let triangles = faces.push(&self.corners, &self.uv, &[]);
        if kept.chart.is_some() {
            let chart = if self.chart < 0.0 { u32::MAX } else { self.chart as u32 };
            faces.chart.extend(std::iter::repeat_n(chart, triangles));
        }
    }
}

/// What came of reading a row.
enum Outcome {
    Read,
    /// The line of this number is no face.
    Unreadable(u64),
    /// The file ends in front of the row or inside of it.
    CutOff,
}

/// Reads face rows. A file that ends among them gives the faces that are whole: the points are all there.
pub(super) fn read(body: &mut Body<'_, '_>, element: &Element, faces: &mut Faces) -> Result<()> {
    if element.count == 0 {
        return Ok(());
    }
    let Some(kept) = Kept::find(element) else {
        body.input.report.add("faces without a list of vertices, left out", element.count, None);
        return body.skip(element);
    };
    for (_, p) in element.properties.iter().enumerate().filter(|p| !kept.has(p.0)) {
        let what = format!("values of the face property \"{}\", which is not kept", p.name);
        body.input.report.add(what, element.count, None);
    }
    let possible = body.rows_possible(element) as usize;
    body.input.reserve(possible, 12 + if kept.texcoord.is_some() { 24 } else { 0 })?;
    faces.triangles.reserve(possible);
    let common = body.encoding != Encoding::Ascii && is_common(element);
    let mut row = Row::default();
    let mut done = element.count;
    let (mut bad, mut first_bad) = (0, None);
    for i in body.input.watched(0..element.count) {
        if common && let Some(corners) = take_triangle(body) {
            faces.push(&corners, &[], &[]);
            continue;
        }
        row.clear();
        let outcome = match body.encoding {
            Encoding::Ascii => ascii_row(body, element, &kept, &mut row),
            _ => binary_row(body, element, &kept, &mut row),
        };
        match outcome {
            Outcome::Read => row.push_to(&kept, faces),
            Outcome::Unreadable(line) => {
                bad += 1;
                first_bad.get_or_insert(line);
            }
            Outcome::CutOff => {
                done = i;
                break;
            }
        }
    }
    let report = &mut body.input.report;
    report.add("face rows that cannot be read, left out", bad, first_bad.map(|l| format!("line {l}")));
    report.add(
        "faces announced by the header but not in the file (it is cut off)",
        element.count - done,
        Some(format!("face {done}")),
    );
    Ok(())
}

/// Whether the rows are only a list of 32-bit indices with a count of one byte: so are those of nearly every
/// file.
fn is_common(element: &Element) -> bool {
    let [p] = element.properties.as_slice() else { return false };
    p.list == Some(ScalarKind::U8) && matches!(p.kind, ScalarKind::I32 | ScalarKind::U32)
}

/// Reads a row of [`is_common`] kind if it has three corners.
fn take_triangle(body: &mut Body<'_, '_>) -> Option<[u32; 3]> {
    const ROW: usize = 13;
    let Some(&[3, a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3]) =
        body.input.data.get(body.at..body.at + ROW)
    else {
        return None;
    };
    let big_endian = body.big_endian();
    let word = |b| if big_endian { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) };
    body.at += ROW;
    Some([word([a0, a1, a2, a3]), word([b0, b1, b2, b3]), word([c0, c1, c2, c3])])
}

fn ascii_row(body: &mut Body<'_, '_>, element: &Element, kept: &Kept, row: &mut Row) -> Outcome {
    let Some(line) = body.next_line() else { return Outcome::CutOff };
    let mut words = text::tokens(line.text);
    let mut ok = true;
    for (i, p) in element.properties.iter().enumerate() {
        body.list.clear();
        let Some(first) = words.next().and_then(text::number) else {
            return Outcome::Unreadable(line.number);
        };
        if p.list.is_some() {
            let entries = (0..first.max(0.0) as u64).map_while(|_| words.next().and_then(text::number));
            body.list.extend(entries);
            ok &= body.list.len() as f64 == first;
        }
        row.put(kept, i, first, &body.list);
    }
    if ok { Outcome::Read } else { Outcome::Unreadable(line.number) }
}

fn binary_row(body: &mut Body<'_, '_>, element: &Element, kept: &Kept, row: &mut Row) -> Outcome {
    let from = body.at;
    for (i, p) in element.properties.iter().enumerate() {
        body.list.clear();
        let Some(value) = body.take(p.list, p.kind) else {
            body.at = from;
            return Outcome::CutOff;
        };
        row.put(kept, i, value, &body.list);
    }
    Outcome::Read
}

/// Reads triangle strips (Stanford): indices with -1 between strips, every second triangle turned over.
pub(super) fn read_strips(body: &mut Body<'_, '_>, element: &Element, faces: &mut Faces) -> Result<()> {
    for row in body.input.watched(0..element.count) {
        for p in &element.properties {
            body.list.clear();
            if body.encoding == Encoding::Ascii {
                let Some(line) = body.next_line() else { return Err(body.cut_off(element, row)) };
                body.list.extend(text::tokens(line.text).skip(1).map_while(text::number));
            } else if body.take(p.list, p.kind).is_none() {
                return Err(body.cut_off(element, row));
            }
            body.input.reserve(body.list.len(), 12)?;
            for strip in body.list.split(|&v| v < 0.0) {
                for (i, t) in strip.windows(3).enumerate() {
                    let [a, b, c] = [0, 1, 2].map(|k| index(t[k] as i64));
                    faces.push(&if i % 2 == 0 { [a, b, c] } else { [b, a, c] }, &[], &[]);
                }
            }
        }
    }
    Ok(())
}
