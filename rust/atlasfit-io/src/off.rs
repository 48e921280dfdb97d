//! OFF with its prefixes for texture coordinates, colours and normals (Geomview): OFF, COFF, NOFF, STOFF and
//! their combinations, text only.

use crate::error::{Place, Result};
use crate::faces::{Faces, index};
use crate::load::{Content, Input};
use crate::save::{Job, Written};
use crate::text::{self, Line, Lines};
use std::io::Write;

/// More words on the first vertex's line than any vertex has: the file is not written in lines.
const MOST_WORDS: usize = 12;

/// What the keyword promises of each vertex.
#[derive(Clone, Copy, Default)]
struct Keyword {
    texture: bool,
    color: bool,
    normal: bool,
    homogeneous: bool,
    dimensions: bool,
}

/// A keyword, and the digits of the first count where no blank stands between.
fn keyword(word: &[u8]) -> Option<(Keyword, &[u8])> {
    let digits = word.iter().rposition(|b| !b.is_ascii_digit()).map_or(0, |i| i + 1);
    let (word, count) = word.split_at(digits);
    let word = word.to_ascii_uppercase();
    let mut rest = word.strip_suffix(b"OFF")?;
    let mut k = Keyword::default();
    if let Some(r) = rest.strip_prefix(b"ST") {
        k.texture = true;
        rest = r;
    }
    if let Some(r) = rest.strip_prefix(b"C") {
        k.color = true;
        rest = r;
    }
    if let Some(r) = rest.strip_prefix(b"N") {
        k.normal = true;
        rest = r;
    }
    if let Some(r) = rest.strip_prefix(b"4") {
        k.homogeneous = true;
        rest = r;
    }
    if let Some(r) = rest.strip_prefix(b"N") {
        k.dimensions = true;
        rest = r;
    }
    rest.is_empty().then_some((k, count))
}

/// Whether these bytes are an OFF file.
pub(crate) fn is_off(data: &[u8]) -> bool {
    Lines::new(data)
        .take(100)
        .find_map(|l| words(l.text).next().map(|w| keyword(w).is_some()))
        .unwrap_or(false)
}

fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    text::tokens(line.split(|&b| b == b'#').next().unwrap_or(b""))
}

/// Words one after the other, with the rest of a line skipped where rows are lines.
struct Rows<'d> {
    lines: Lines<'d>,
    /// The words of the running line that are still to come.
    rest: Vec<&'d [u8]>,
    by_line: bool,
}

impl<'d> Rows<'d> {
    fn line(&mut self) -> Option<Line<'d>> {
        self.lines.find(|l| words(l.text).next().is_some())
    }
    /// The words of the next row: those of a line, or all up to `need` words however they are broken.
    fn word(&mut self) -> Option<&'d [u8]> {
        while self.rest.is_empty() {
            let line = self.line()?;
            self.rest = words(line.text).collect();
            self.rest.reverse();
        }
        self.rest.pop()
    }
    fn end_row(&mut self) {
        if self.by_line {
            self.rest.clear();
        }
    }
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let mut rows = Rows { lines: Lines::new(input.data), rest: Vec::new(), by_line: false };
    let first = rows.word().unwrap_or_default();
    let kind = match keyword(first) {
        Some((k, count)) => {
            if !count.is_empty() {
                rows.rest.push(count);
            }
            k
        }
        None => {
            rows.rest.push(first);
            Keyword::default()
        }
    };
    if kind.homogeneous || kind.dimensions {
        return Err(input.unsupported("this OFF file is not three-dimensional", "Write it as plain OFF"));
    }
    if rows.rest.last().is_some_and(|w| w.eq_ignore_ascii_case(b"BINARY")) {
        return Err(input.unsupported("this is binary OFF", "Write it as text OFF or as PLY"));
    }
    let mut counts = [0u64; 2];
    for (k, count) in counts.iter_mut().enumerate() {
        let word = rows.word().unwrap_or_default();
        *count = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
            input.malformed(
                Place::Line(rows.lines.number()),
                if word.is_empty() { "the end of the file".into() } else { text::quote(word) },
                ["the number of vertices", "the number of faces"][k],
                "The file is damaged: get it again",
            )
        })?;
    }
    // The number of edges, which nobody uses and some leave out.
    let mut probe = Rows { lines: rows.lines.clone(), rest: rows.rest.clone(), by_line: false };
    if !rows.rest.is_empty() {
        rows.word();
        probe.word();
    }
    let first_line =
        if probe.rest.is_empty() { probe.line().map_or(0, |l| words(l.text).count()) } else { usize::MAX };
    rows.by_line = first_line <= MOST_WORDS;
    let in_front = if kind.normal { 6 } else { 3 };
    let behind = if kind.texture { 2 } else { 0 };
    // Words between: a colour, which some write without saying so.
    let between = if rows.by_line {
        first_line.saturating_sub(in_front + behind)
    } else if kind.color {
        return Err(input.unsupported(
            "this OFF file has colours and no line breaks, so that the length of a colour is unknown",
            "Write it with one vertex per line",
        ));
    } else {
        0
    };
    let colored = between >= 3;
    let n = vertices(input, &mut rows, counts[0], [in_front, between, behind])?;
    let (mut content, colors, texture) = n;
    let mut faces = Faces::default();
    let mut corners = Vec::new();
    let mut uv = Vec::new();
    let (mut bad, mut first_bad) = (0, None);
    let mut done = counts[1];
    for face in 0..counts[1] {
        let Some(word) = rows.word() else {
            done = face;
            break;
        };
        let count: u64 = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).unwrap_or(0);
        corners.clear();
        for _ in 0..count {
            if rows.by_line && rows.rest.is_empty() {
                break;
            }
            match rows.word().and_then(text::number) {
                Some(v) => corners.push(index(v as i64)),
                None => break,
            }
        }
        rows.end_row();
        if corners.len() as u64 != count {
            bad += 1;
            first_bad.get_or_insert(format!("line {}", rows.lines.number()));
            continue;
        }
        input.reserve(corners.len(), 16)?;
        uv.clear();
        if kind.texture {
            uv.extend(corners.iter().map(|&v| texture.get(v as usize).copied().unwrap_or_default()));
        }
        faces.push(&corners, &uv);
    }
    input.report.add("faces that cannot be read, left out", bad, first_bad);
    let first = Some(format!("face {done}"));
    let missing = counts[1] - done;
    input.report.add("faces announced by the header but not in the file (it is cut off)", missing, first);
    if done == counts[1] {
        let rest = rows.lines.filter(|l| words(l.text).next().is_some()).count();
        input.report.add("lines after the last announced face, left out", rest as u64, None);
    }
    let faces = faces.finish(&content.cloud.positions, &mut input.report);
    content.faces = faces.triangles;
    content.corner_uv = faces.corner_uv;
    content.polygons = faces.polygons;
    if colored {
        // Whole numbers are 0 to 255, fractions 0 to 1; the whole file tells which.
        let scale = if colors.iter().flatten().any(|&c| c > 1.0) { 255.0 } else { 1.0 };
        let opaque = between < 4;
        let color = |c: &[f64; 4]| {
            let [r, g, b, a] = c.map(|v| (v / scale) as f32);
            [r, g, b, if opaque { 1.0 } else { a }]
        };
        content.cloud.colors = Some(colors.iter().map(color).collect());
    }
    Ok(content)
}

/// Reads the vertices: positions and normals into the content; raw colours; texture coordinates.
#[expect(clippy::type_complexity, reason = "the content and the two columns that need a second look")]
fn vertices(
    input: &mut Input<'_>,
    rows: &mut Rows<'_>,
    count: u64,
    [in_front, between, behind]: [usize; 3],
) -> Result<(Content, Vec<[f64; 4]>, Vec<[f32; 2]>)> {
    let mut content = Content::default();
    let (mut normals, mut colors, mut texture) = (Vec::new(), Vec::new(), Vec::new());
    let (mut bad, mut first_bad) = (0u64, None);
    let width = in_front + between + behind;
    let mut values = [0.0f64; 16];
    for vertex in 0..count {
        let Some(first) = rows.word() else {
            return Err(input.malformed(
                Place::Line(rows.lines.number()),
                format!("the end of the file after {vertex} vertices"),
                format!("{count} vertices, as the file says in front"),
                "The file is cut off: get it again",
            ));
        };
        input.reserve(1, 8 * width)?;
        values.fill(0.0);
        let mut read = 0;
        let mut word = Some(first);
        while let Some(number) = word.and_then(text::number) {
            values[read] = number;
            read += 1;
            if read == width.min(values.len()) || rows.by_line && rows.rest.is_empty() {
                break;
            }
            word = rows.word();
        }
        if read < in_front {
            bad += 1;
            first_bad.get_or_insert(format!("line {}", rows.lines.number()));
            values[..3].fill(f64::NAN);
        }
        rows.end_row();
        let v = &values;
        content.cloud.positions.push([v[0], v[1], v[2]]);
        if in_front == 6 {
            normals.push([v[3] as f32, v[4] as f32, v[5] as f32]);
        }
        if between >= 3 {
            let c = in_front;
            let alpha = if between >= 4 { v[c + 3] } else { 1.0 };
            colors.push([v[c], v[c + 1], v[c + 2], alpha]);
        }
        if behind == 2 {
            let t = in_front + between;
            texture.push([v[t] as f32, v[t + 1] as f32]);
        }
        if bad > 10 && bad > vertex / 20 {
            return Err(input.malformed(
                Place::Line(rows.lines.number()),
                format!("{bad} vertices that are not {in_front} numbers"),
                "lines such as \"0 0 1\"",
                "The file is damaged: get it again",
            ));
        }
    }
    input.report.add("vertices that cannot be read, kept as NaN", bad, first_bad);
    content.cloud.normals = (in_front == 6).then_some(normals);
    Ok((content, colors, texture))
}

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> std::io::Result<Written> {
    let mut written = Written::default();
    if !job.attributes.is_empty() {
        written.lost.push(format!("attributes, which OFF cannot hold: {}", job.attribute_names()));
    }
    if job.corner_uv.is_some() {
        written.lost.push("texture coordinates".into());
    }
    if job.face_chart.is_some() {
        written.lost.push("chart numbers of the faces".into());
    }
    crate::save::colors_lost(job.colors, &mut written);
    let color = if job.colors.is_some() { "C" } else { "" };
    let normal = if job.normals.is_some() { "N" } else { "" };
    writeln!(out, "{color}{normal}OFF\n{} {} 0", job.positions.len(), job.face_count())?;
    for (i, [x, y, z]) in job.positions.iter().enumerate() {
        write!(out, "{x} {y} {z}")?;
        for c in job.normals.map(|n| n[i]).into_iter().flatten() {
            write!(out, " {c}")?;
        }
        for c in job.colors.map(|c| c[i]).into_iter().flatten() {
            write!(out, " {}", crate::save::to_u8(c))?;
        }
        writeln!(out)?;
    }
    job.each_face(|face| {
        write!(out, "{}", face.corners.len())?;
        for v in face.corners {
            write!(out, " {v}")?;
        }
        writeln!(out)
    })?;
    Ok(written)
}
