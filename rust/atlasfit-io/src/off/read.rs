//! Reads OFF.

use crate::content::Content;
use crate::error::{Error, Location, Result};
use crate::faces::{Faces, index};
use crate::input::Input;
use crate::text::{self, Line, Lines};

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

/// The words of a line, without its comment.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    text::tokens(line.split(|&b| b == b'#').next().unwrap_or(b""))
}

/// Words one after the other; where rows are lines, what a row does not need of its line is passed over.
struct Rows<'d> {
    lines: Lines<'d>,
    /// The words of the running line that are still to come, the last one first.
    rest: Vec<&'d [u8]>,
    /// Whether every row has a line of its own.
    by_line: bool,
}

impl<'d> Rows<'d> {
    /// The next line with words on it.
    fn line(&mut self) -> Option<Line<'d>> {
        self.lines.find(|l| words(l.text).next().is_some())
    }

    /// The next word, of whatever line.
    fn word(&mut self) -> Option<&'d [u8]> {
        while self.rest.is_empty() {
            let line = self.line()?;
            self.rest = words(line.text).collect();
            self.rest.reverse();
        }
        self.rest.pop()
    }

    /// The next word as a count.
    fn count(&mut self) -> std::result::Result<u64, &'d [u8]> {
        let word = self.word().unwrap_or_default();
        std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or(word)
    }

    /// Passes over the rest of a line.
    fn end_row(&mut self) {
        if self.by_line {
            self.rest.clear();
        }
    }
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let mut rows = Rows { lines: input.lines(0, 0), rest: Vec::new(), by_line: false };
    let kind = read_keyword(input, &mut rows)?;
    let mut counts = [0u64; 2];
    for (count, expected) in counts.iter_mut().zip(["the number of vertices", "the number of faces"]) {
        *count = rows.count().map_err(|word| {
            input.malformed(
                Location::Line(rows.lines.number()),
                if word.is_empty() { "the end of the file".into() } else { text::quote(word) },
                expected,
                "The file is damaged: get it again",
            )
        })?;
    }
    let layout = layout(input, &mut rows, kind)?;
    let mut vertices = vertices(input, &mut rows, counts[0], layout)?;
    let faces = faces(input, &mut rows, counts[1], kind.texture.then_some(&vertices.texture))?;
    let mut content = std::mem::take(&mut vertices.content);
    content.faces = faces.finish(&content.cloud.positions, &mut input.report);
    content.cloud.colors = vertices.colors_as_floats(layout);
    Ok(content)
}

/// The keyword in front of the counts, which may be missing.
fn read_keyword<'d>(input: &Input<'d>, rows: &mut Rows<'d>) -> Result<Keyword> {
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
    Ok(kind)
}

/// How many words of a vertex stand where.
#[derive(Clone, Copy)]
struct Layout {
    /// The position, and the normal if there is one: 3 or 6.
    in_front: usize,
    /// The colour, which some programs write without saying so.
    between: usize,
    /// The texture coordinates: 0 or 2.
    behind: usize,
}

impl Layout {
    fn has_color(self) -> bool {
        self.between >= 3
    }
    fn has_alpha(self) -> bool {
        self.between >= 4
    }
}

/// Passes over the number of edges, and finds the layout of the vertices and whether they are lines.
fn layout<'d>(input: &Input<'d>, rows: &mut Rows<'d>, kind: Keyword) -> Result<Layout> {
    // Nobody uses the number of edges, and some programs leave it out.
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
    Ok(Layout { in_front, between, behind })
}

/// Reads the faces. `texture` holds the texture coordinates of the vertices, if they have some.
fn faces(
    input: &mut Input<'_>,
    rows: &mut Rows<'_>,
    announced: u64,
    texture: Option<&Vec<[f32; 2]>>,
) -> Result<Faces> {
    let mut faces = Faces::default();
    let mut corners = Vec::new();
    let mut uv = Vec::new();
    let (mut bad, mut first_bad) = (0, None);
    let mut done = announced;
    for face in 0..announced {
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
        if let Some(texture) = texture {
            uv.extend(corners.iter().map(|&v| texture.get(v as usize).copied().unwrap_or_default()));
        }
        faces.push(&corners, &uv, &[]);
    }
    input.report.add("faces that cannot be read, left out", bad, first_bad);
    let first = Some(format!("face {done}"));
    let missing = announced - done;
    input.report.add("faces announced by the header but not in the file (it is cut off)", missing, first);
    if done == announced {
        let rest = rows.lines.by_ref().filter(|l| words(l.text).next().is_some()).count();
        input.report.add("lines after the last announced face, left out", rest as u64, None);
    }
    Ok(faces)
}

/// The vertices read.
struct Vertices {
    /// Positions and normals.
    content: Content,
    /// The numbers of the colours as the file has them.
    colors: Vec<[f64; 4]>,
    texture: Vec<[f32; 2]>,
}

impl Vertices {
    /// The colours in [0, 1]. Whole numbers are 0 to 255, fractions 0 to 1; the whole file tells which.
    fn colors_as_floats(&self, layout: Layout) -> Option<Vec<[f32; 4]>> {
        if !layout.has_color() {
            return None;
        }
        let scale = if self.colors.iter().flatten().any(|&c| c > 1.0) { 255.0 } else { 1.0 };
        let color = |c: &[f64; 4]| {
            let [r, g, b, a] = c.map(|v| (v / scale) as f32);
            [r, g, b, if layout.has_alpha() { a } else { 1.0 }]
        };
        Some(self.colors.iter().map(color).collect())
    }
}

/// Reads the vertices.
fn vertices(input: &mut Input<'_>, rows: &mut Rows<'_>, count: u64, layout: Layout) -> Result<Vertices> {
    let Layout { in_front, between, behind } = layout;
    let mut content = Content::default();
    let (mut normals, mut colors, mut texture) = (Vec::new(), Vec::new(), Vec::new());
    let (mut bad, mut first_bad) = (0u64, None);
    let width = in_front + between + behind;
    let mut values = [0.0f64; 16];
    for vertex in 0..count {
        let Some(first) = rows.word() else {
            return Err(input.malformed(
                Location::Line(rows.lines.number()),
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
        if layout.has_color() {
            let c = in_front;
            colors.push([v[c], v[c + 1], v[c + 2], if layout.has_alpha() { v[c + 3] } else { 1.0 }]);
        }
        if behind == 2 {
            let t = in_front + between;
            texture.push([v[t] as f32, v[t + 1] as f32]);
        }
        if bad > 10 && bad > vertex / 20 {
            return Err(too_many_bad(input, rows, bad, in_front));
        }
    }
    input.report.add("vertices that cannot be read, kept as NaN", bad, first_bad);
    content.cloud.normals = (in_front == 6).then_some(normals);
    Ok(Vertices { content, colors, texture })
}

/// The error of a file of which too many vertices cannot be read.
fn too_many_bad(input: &Input<'_>, rows: &Rows<'_>, bad: u64, numbers: usize) -> Error {
    input.malformed(
        Location::Line(rows.lines.number()),
        format!("{bad} vertices that are not {numbers} numbers"),
        "lines such as \"0 0 1\"",
        "The file is damaged: get it again",
    )
}
