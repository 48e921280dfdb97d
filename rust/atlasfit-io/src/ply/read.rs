//! Reads the body of a PLY file.

use super::header::{self, Element, Encoding};
use crate::bytes::{self, column, scalar, size, zeros};
use crate::error::{Place, Result};
use crate::faces::{self, Faces};
use crate::load::{Content, Input};
use crate::text::{self, Lines};
use atlasfit::geometry::{Attribute, ScalarKind};

/// Rows per block of the column-wise fast path: small enough for the cache, long enough to amortise the
/// dispatch on types.
const BLOCK: usize = 2048;
/// In an ASCII file, this share of the vertex rows may be unreadable before the file is refused.
const BAD_ROWS: u64 = 100;

/// Where a vertex property goes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Target {
    Position(usize),
    Normal(usize),
    Color(usize),
    Uv(usize),
    Scalar(usize),
    List(usize),
}

/// The vertex columns while they fill.
struct Columns {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f32; 3]>,
    colors: Vec<[f32; 4]>,
    uv: Vec<[f32; 2]>,
    scalars: Vec<Attribute>,
    lists: Vec<List>,
    color_scale: [f64; 4],
    /// What each property became, in the file's order.
    order: Vec<Target>,
}

/// What stands in the place of an attribute that was taken out.
const EMPTY: Attribute =
    Attribute { name: String::new(), width: 1, kind: ScalarKind::F64, values: Vec::new() };

/// A list property of the vertices: an attribute if all lists have one length.
struct List {
    name: String,
    kind: ScalarKind,
    width: Option<usize>,
    ragged: bool,
    values: Vec<f64>,
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let header = header::read(input)?;
    let vertex = vertex_element(input, &header.elements)?;
    let mut reader = Reader {
        at: header.end,
        lines: Lines::from(input.data, header.end, header.lines),
        row: Vec::new(),
        input,
        encoding: header.encoding,
    };
    let has_faces =
        header.elements.iter().any(|e| matches!(e.name.as_str(), "face" | "tristrips") && e.count > 0);
    let mut columns = None;
    let mut faces = Faces::default();
    for (i, element) in header.elements.iter().enumerate() {
        if i == vertex {
            columns = Some(reader.vertices(element, has_faces)?);
        } else if element.name == "face" {
            reader.faces(element, &mut faces)?;
        } else if element.name == "tristrips" {
            reader.strips(element, &mut faces)?;
        } else {
            // What follows the last element of use need not be looked at.
            let needed = header.elements[i..]
                .iter()
                .enumerate()
                .any(|(k, e)| i + k == vertex || e.name == "face" || e.name == "tristrips");
            let what = format!("rows of the element \"{}\", which is not used", element.name);
            reader.input.report.add(what, element.count, None);
            if needed {
                reader.skip(element)?;
            }
        }
    }
    let Some(columns) = columns else { return Ok(Content::default()) };
    let texture = header.texture.filter(|_| has_faces).and_then(|name| input.beside(&name));
    Ok(Content { texture, ..finish(input, columns, faces)? })
}

/// Whether the file is rows of points behind the header and nothing else that is used: then it can be read block by block.
pub(crate) fn is_rows(input: &Input<'_>) -> bool {
    header::read(input).is_ok_and(|h| {
        h.encoding != Encoding::Ascii
            && vertex_element(input, &h.elements).is_ok_and(|v| v == 0 && h.elements[v].stride().is_some())
            && (h.elements[1..].iter().all(|e| e.count == 0)
                || !h.elements.iter().any(|e| matches!(e.name.as_str(), "face" | "tristrips")))
    })
}

fn finish(input: &mut Input<'_>, mut columns: Columns, faces: Faces) -> Result<Content> {
    let mut content = Content::default();
    let faces = faces.finish(&columns.positions, &mut input.report);
    content.faces = faces.triangles;
    content.corner_uv = faces.corner_uv;
    content.face_chart = faces.chart;
    content.polygons = faces.polygons;
    let n = columns.positions.len();
    let mut attributes = Vec::new();
    for target in &columns.order {
        match *target {
            Target::Scalar(k) => attributes.push(std::mem::replace(&mut columns.scalars[k], EMPTY)),
            Target::List(k) => {
                let list = &mut columns.lists[k];
                match list.width {
                    Some(width) if width > 0 && list.values.len() == n * width => {
                        let (name, values) =
                            (std::mem::take(&mut list.name), std::mem::take(&mut list.values));
                        attributes.push(Attribute { name, width, kind: list.kind, values });
                    }
                    Some(0) | None => {}
                    _ => {
                        let what =
                            format!("lists \"{}\" of differing length at vertices, left out", list.name);
                        input.report.add(what, n as u64, None);
                    }
                }
            }
            _ => {}
        }
    }
    if !columns.uv.is_empty() && content.corner_uv.is_none() {
        input.reserve(content.faces.len(), 24)?;
        let uv = |v: u32| columns.uv[v as usize];
        content.corner_uv = Some(content.faces.iter().map(|t| t.map(uv)).collect());
    }
    // Floating-point colours are in [0, 1] by convention; some programs write 0 to 255.
    if columns.color_scale[0] == 1.0 && columns.colors.iter().any(|c| c[..3].iter().any(|&v| v > 1.0)) {
        input.report.add("floating-point colours above 1, read as 0 to 255", n as u64, None);
        let alpha = columns.colors.iter().any(|c| c[3] > 1.0);
        for c in &mut columns.colors {
            for v in &mut c[..if alpha { 4 } else { 3 }] {
                *v /= 255.0;
            }
        }
    }
    content.cloud.positions = columns.positions;
    content.cloud.normals = (!columns.normals.is_empty()).then_some(columns.normals);
    content.cloud.colors = (!columns.colors.is_empty()).then_some(columns.colors);
    content.cloud.attributes = attributes;
    Ok(content)
}

/// Which element holds the points: "vertex", or the first that has x, y and z.
fn vertex_element(input: &Input<'_>, elements: &[Element]) -> Result<usize> {
    let has_xyz = |e: &Element| {
        ["x", "y", "z"]
            .iter()
            .all(|c| e.properties.iter().any(|p| p.list.is_none() && p.name.eq_ignore_ascii_case(c)))
    };
    let named = elements.iter().position(|e| e.name == "vertex" && (has_xyz(e) || e.count == 0));
    named.or_else(|| elements.iter().position(has_xyz)).ok_or_else(|| {
        let names: Vec<&str> = elements.iter().map(|e| e.name.as_str()).collect();
        input.malformed(
            Place::Whole,
            format!("only the elements: {}", if names.is_empty() { "none".into() } else { names.join(", ") }),
            "an element \"vertex\" with the properties x, y and z",
            "This file holds no points",
        )
    })
}

/// The role of each vertex property, and empty columns for them.
fn plan(element: &Element, has_faces: bool) -> (Vec<Target>, Columns) {
    let scalar = |name: &str| {
        element.properties.iter().position(|p| p.list.is_none() && p.name.eq_ignore_ascii_case(name))
    };
    let mut targets: Vec<Option<Target>> = vec![None; element.properties.len()];
    let mut take = |names: &[&str], target: fn(usize) -> Target| -> Option<usize> {
        let found: Option<Vec<usize>> = names.iter().map(|n| scalar(n)).collect();
        let found = found.filter(|f| f.iter().all(|&i| targets[i].is_none()))?;
        for (k, &i) in found.iter().enumerate() {
            targets[i] = Some(target(k));
        }
        found.first().copied()
    };
    take(&["x", "y", "z"], Target::Position);
    let normals = take(&["nx", "ny", "nz"], Target::Normal).is_some();
    let mut color = None;
    for prefix in ["", "diffuse_"] {
        if color.is_none() {
            let name = |c: &str| format!("{prefix}{c}");
            let (r, g, b, a) = (name("red"), name("green"), name("blue"), name("alpha"));
            color = take(&[&r, &g, &b, &a], Target::Color).or_else(|| take(&[&r, &g, &b], Target::Color));
        }
    }
    color = color
        .or_else(|| take(&["r", "g", "b", "a"], Target::Color))
        .or_else(|| take(&["r", "g", "b"], Target::Color));
    // Texture coordinates belong to faces: without any, "u" and "v" are numbers like others.
    let names = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
    let uv = has_faces && names.iter().any(|n| take(n, Target::Uv).is_some());
    let mut columns = Columns {
        positions: Vec::new(),
        normals: Vec::new(),
        colors: Vec::new(),
        uv: Vec::new(),
        scalars: Vec::new(),
        lists: Vec::new(),
        color_scale: [1.0; 4],
        order: Vec::new(),
    };
    let mut out = Vec::with_capacity(targets.len());
    for (p, target) in element.properties.iter().zip(targets) {
        out.push(match target {
            Some(Target::Color(k)) => {
                columns.color_scale[k] = match p.kind {
                    ScalarKind::F32 | ScalarKind::F64 => 1.0,
                    ScalarKind::U16 | ScalarKind::I16 => 65535.0,
                    _ => 255.0,
                };
                Target::Color(k)
            }
            Some(target) => target,
            None if p.list.is_some() => {
                columns.lists.push(List {
                    name: p.name.clone(),
                    kind: p.kind,
                    width: None,
                    ragged: false,
                    values: Vec::new(),
                });
                Target::List(columns.lists.len() - 1)
            }
            None => {
                let values = Vec::new();
                columns.scalars.push(Attribute { name: p.name.clone(), width: 1, kind: p.kind, values });
                Target::Scalar(columns.scalars.len() - 1)
            }
        });
    }
    columns.order.clone_from(&out);
    // Marks which columns exist: they are sized once the rows are known to be there.
    if normals {
        columns.normals.reserve(1);
    }
    if color.is_some() {
        columns.colors.reserve(1);
    }
    if uv {
        columns.uv.reserve(1);
    }
    (out, columns)
}

impl Columns {
    /// Makes room for `n` rows in every column that exists.
    fn size(&mut self, n: usize, input: &mut Input<'_>) -> Result<()> {
        let optional = [(self.normals.capacity(), 12), (self.colors.capacity(), 16), (self.uv.capacity(), 8)];
        let optional: usize = optional.iter().filter(|o| o.0 > 0).map(|o| o.1).sum();
        input.reserve(n, 24 + 8 * self.scalars.len() + optional)?;
        self.positions = zeros([0.0; 3], n);
        if self.normals.capacity() > 0 {
            self.normals = zeros([0.0; 3], n);
        }
        if self.colors.capacity() > 0 {
            self.colors = zeros([0.0; 4], n);
            if !self.order.contains(&Target::Color(3)) {
                self.colors.iter_mut().for_each(|c| c[3] = 1.0);
            }
        }
        if self.uv.capacity() > 0 {
            self.uv = zeros([0.0; 2], n);
        }
        for a in &mut self.scalars {
            a.values = zeros(0.0, n);
        }
        Ok(())
    }
    #[inline]
    fn set(&mut self, target: Target, row: usize, value: f64) {
        match target {
            Target::Position(k) => self.positions[row][k] = value,
            Target::Normal(k) => self.normals[row][k] = value as f32,
            Target::Color(k) => self.colors[row][k] = (value / self.color_scale[k]) as f32,
            Target::Uv(k) => self.uv[row][k] = value as f32,
            Target::Scalar(k) => self.scalars[k].values[row] = value,
            Target::List(_) => {}
        }
    }
    fn list(&mut self, k: usize, items: &[f64]) {
        let list = &mut self.lists[k];
        match list.width {
            None => list.width = Some(items.len()),
            Some(w) if w != items.len() => {
                list.ragged = true;
                list.values = Vec::new();
            }
            _ => {}
        }
        if !list.ragged {
            list.values.extend_from_slice(items);
        }
    }
}

struct Reader<'i, 'd> {
    input: &'i mut Input<'d>,
    encoding: Encoding,
    /// Next byte of a binary body.
    at: usize,
    /// Next line of an ASCII body.
    lines: Lines<'d>,
    row: Vec<f64>,
}

impl Reader<'_, '_> {
    fn big(&self) -> bool {
        self.encoding == Encoding::Big
    }

    /// Rows that the rest of the file can hold at most.
    fn rows_possible(&self, element: &Element) -> u64 {
        let rest = match self.encoding {
            Encoding::Ascii => (self.input.data.len().saturating_sub(self.lines.offset()) as u64).div_ceil(2),
            _ => {
                let least = element.least_bytes().max(1);
                (self.input.len.saturating_sub(self.at) / least) as u64
            }
        };
        element.count.min(rest)
    }

    fn cut_off(&self, element: &Element, whole: u64) -> crate::Error {
        let (at, advice) = match self.encoding {
            Encoding::Ascii => (Place::Line(self.lines.number()), "lines"),
            _ => (Place::Byte(self.input.len as u64), "bytes"),
        };
        self.input.malformed(
            at,
            format!("the end of the file after at most {whole} rows of the element \"{}\"", element.name),
            format!("{} rows, as the header says", element.count),
            format!("The file is cut off, or its header is wrong: get it again, or correct the count if the {advice} are all there"),
        )
    }

    fn vertices(&mut self, element: &Element, has_faces: bool) -> Result<Columns> {
        let (targets, mut columns) = plan(element, has_faces);
        let possible = self.rows_possible(element);
        if possible < element.count {
            return Err(self.cut_off(element, possible));
        }
        let n = element.count as usize;
        if n >= u32::MAX as usize {
            return Err(self.input.unsupported(
                format!("{n} vertices, and indices have 32 bits"),
                "Split the file into parts of fewer than 4 thousand million points",
            ));
        }
        columns.size(n, self.input)?;
        match (self.encoding, element.stride()) {
            (Encoding::Ascii, _) => self.ascii_vertices(element, &targets, &mut columns)?,
            (_, Some(stride)) => {
                // rows_possible has checked that the bytes are there.
                let (parts, mut first) = (parts(element, &targets, stride, self.big()), 0);
                self.input.blocks(self.at, n * stride, BLOCK * stride, |rows| {
                    for &(target, at) in &parts {
                        block_column(&mut columns, target, first, rows, at);
                    }
                    first += BLOCK;
                })?;
                self.at += n * stride;
            }
            (_, None) => {
                for row in 0..n {
                    for (p, &target) in element.properties.iter().zip(&targets) {
                        let Some(single) = self.take(p.list, p.kind) else {
                            return Err(self.cut_off(element, row as u64));
                        };
                        match target {
                            Target::List(k) => {
                                self.input.reserve(self.row.len(), 8)?;
                                columns.list(k, &self.row);
                            }
                            _ => columns.set(target, row, single),
                        }
                    }
                }
            }
        }
        Ok(columns)
    }

    /// Reads one binary property: a scalar is returned, a list goes to `self.row`.
    fn take(&mut self, list: Option<ScalarKind>, kind: ScalarKind) -> Option<f64> {
        let big = self.big();
        let rest = self.input.data.get(self.at..)?;
        let Some(count_kind) = list else {
            let bytes = rest.get(..size(kind))?;
            self.at += size(kind);
            return Some(scalar(bytes, kind, big));
        };
        let count = scalar(rest.get(..size(count_kind))?, count_kind, big);
        if !(0.0..=f64::from(u32::MAX)).contains(&count) {
            return None;
        }
        let from = size(count_kind);
        let items = rest.get(from..from.checked_add((count as usize).checked_mul(size(kind))?)?)?;
        self.row.clear();
        let row = &mut self.row;
        column(items, size(kind), 0, kind, big, |_, v| row.push(v));
        self.at += from + items.len();
        Some(count)
    }

    fn ascii_vertices(&mut self, element: &Element, targets: &[Target], columns: &mut Columns) -> Result<()> {
        let mut bad = 0u64;
        let mut first_bad = None;
        let mut items = Vec::new();
        for row in 0..element.count as usize {
            let Some(line) = next_row(&mut self.lines) else { return Err(self.cut_off(element, row as u64)) };
            let mut words = text::tokens(line.text);
            let mut ok = true;
            for (p, &target) in element.properties.iter().zip(targets) {
                if p.list.is_some() {
                    items.clear();
                    // A row that ends before its list has an empty one.
                    let count = words.next().map_or(Some(0.0), text::number).unwrap_or(-1.0);
                    ok &= count >= 0.0;
                    for _ in 0..count.max(0.0) as u64 {
                        match words.next().and_then(text::number) {
                            Some(v) => items.push(v),
                            None => {
                                ok = false;
                                break;
                            }
                        }
                    }
                    if let Target::List(k) = target {
                        self.input.reserve(items.len(), 8)?;
                        columns.list(k, &items);
                    }
                } else {
                    match words.next().and_then(value) {
                        Some(v) => columns.set(target, row, v),
                        None => {
                            ok = false;
                            break;
                        }
                    }
                }
            }
            if !ok {
                bad += 1;
                first_bad.get_or_insert((line.number, text::quote(line.text)));
                columns.positions[row] = [f64::NAN; 3];
                if bad > (element.count / BAD_ROWS).max(10).min(element.count / 2) {
                    let (number, found) = first_bad.unwrap_or_default();
                    return Err(self.input.malformed(
                        Place::Line(number),
                        found,
                        format!("{} numbers of a vertex", element.properties.len()),
                        "Too many rows are like this: the header and the rows do not agree",
                    ));
                }
            }
        }
        let first = first_bad.map(|(n, _)| format!("line {n}"));
        self.input.report.add("vertex rows that cannot be read, kept as NaN", bad, first);
        Ok(())
    }

    fn skip(&mut self, element: &Element) -> Result<()> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let possible = self.rows_possible(element);
        if possible < element.count {
            return Err(self.cut_off(element, possible));
        }
        match (self.encoding, element.stride()) {
            (Encoding::Ascii, _) => {
                for row in 0..element.count {
                    if next_row(&mut self.lines).is_none() {
                        return Err(self.cut_off(element, row));
                    }
                }
            }
            (_, Some(stride)) => self.at += element.count as usize * stride,
            (_, None) => {
                for row in 0..element.count {
                    for p in &element.properties {
                        if self.take(p.list, p.kind).is_none() {
                            return Err(self.cut_off(element, row));
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Reads face rows: the index list, texture coordinates, our chart numbers. A file that ends among them
    /// gives what is whole: the points are all there.
    fn faces(&mut self, element: &Element, faces: &mut Faces) -> Result<()> {
        if element.count == 0 {
            return Ok(());
        }
        let list = |ok: &dyn Fn(&str) -> bool| {
            element.properties.iter().position(|p| p.list.is_some() && ok(&p.name.to_ascii_lowercase()))
        };
        let indices = list(&|n| n == "vertex_indices" || n == "vertex_index")
            .or_else(|| list(&|n| n.contains("vert") || n.contains("ind")))
            .or_else(|| list(&|n| !n.contains("tex")));
        let Some(indices) = indices else {
            self.input.report.add("faces without a list of vertices, left out", element.count, None);
            return self.skip(element);
        };
        let texcoord = list(&|n| n == "texcoord" || n == "texcoords");
        let chart = element.properties.iter().position(|p| {
            p.list.is_none() && p.name == "chart" && matches!(p.kind, ScalarKind::I32 | ScalarKind::U32)
        });
        for (i, p) in element.properties.iter().enumerate() {
            if i != indices && Some(i) != texcoord && Some(i) != chart {
                let what = format!("values of the face property \"{}\", which is not kept", p.name);
                self.input.report.add(what, element.count, None);
            }
        }
        let possible = self.rows_possible(element) as usize;
        self.input.reserve(possible, 12 + if texcoord.is_some() { 24 } else { 0 })?;
        faces.triangles.reserve(possible);
        let mut corners: Vec<u32> = Vec::new();
        let mut uv: Vec<[f32; 2]> = Vec::new();
        let mut done = element.count;
        let mut bad = 0;
        let mut first_bad = None;
        let plain = element.properties.len() == 1 && self.encoding != Encoding::Ascii;
        let kinds = (element.properties[indices].list, element.properties[indices].kind);
        let common =
            plain && kinds.0 == Some(ScalarKind::U8) && matches!(kinds.1, ScalarKind::I32 | ScalarKind::U32);
        for row in 0..element.count {
            // Nearly every file: uchar 3, then three 32-bit indices.
            if common
                && let Some(&[3, a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3]) =
                    self.input.data.get(self.at..self.at + 13)
            {
                let word = |b| {
                    if self.encoding == Encoding::Big { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) }
                };
                faces.push(&[word([a0, a1, a2, a3]), word([b0, b1, b2, b3]), word([c0, c1, c2, c3])], &[]);
                self.at += 13;
                continue;
            }
            corners.clear();
            uv.clear();
            let mut chart_value = f64::from(u32::MAX);
            let mut ok = true;
            if self.encoding == Encoding::Ascii {
                let Some(line) = next_row(&mut self.lines) else {
                    done = row;
                    break;
                };
                let mut words = text::tokens(line.text);
                for (i, p) in element.properties.iter().enumerate() {
                    self.row.clear();
                    let Some(first) = words.next().and_then(text::number) else {
                        ok = false;
                        break;
                    };
                    if p.list.is_some() {
                        self.row.extend(
                            (0..first.max(0.0) as u64).map_while(|_| words.next().and_then(text::number)),
                        );
                        ok &= self.row.len() as f64 == first;
                    } else if Some(i) == chart {
                        chart_value = first;
                    }
                    collect(i, indices, texcoord, &self.row, &mut corners, &mut uv);
                }
                if !ok {
                    bad += 1;
                    first_bad.get_or_insert(format!("line {}", line.number));
                    continue;
                }
            } else {
                let from = self.at;
                for (i, p) in element.properties.iter().enumerate() {
                    self.row.clear();
                    let Some(single) = self.take(p.list, p.kind) else {
                        ok = false;
                        break;
                    };
                    if Some(i) == chart {
                        chart_value = single;
                    }
                    collect(i, indices, texcoord, &self.row, &mut corners, &mut uv);
                }
                if !ok {
                    self.at = from;
                    done = row;
                    break;
                }
            }
            let triangles = faces.push(&corners, &uv);
            if chart.is_some() {
                let chart = if chart_value < 0.0 { u32::MAX } else { chart_value as u32 };
                faces.chart.extend(std::iter::repeat_n(chart, triangles));
            }
        }
        self.input.report.add("face rows that cannot be read, left out", bad, first_bad);
        let missing = element.count - done;
        let first = Some(format!("face {done}"));
        self.input.report.add(
            "faces announced by the header but not in the file (it is cut off)",
            missing,
            first,
        );
        Ok(())
    }

    /// Triangle strips (Stanford): indices with -1 between strips, every second triangle turned over.
    fn strips(&mut self, element: &Element, faces: &mut Faces) -> Result<()> {
        for row in 0..element.count {
            for p in &element.properties {
                self.row.clear();
                if self.encoding == Encoding::Ascii {
                    let Some(line) = next_row(&mut self.lines) else {
                        return Err(self.cut_off(element, row));
                    };
                    self.row.extend(text::tokens(line.text).skip(1).map_while(text::number));
                } else if self.take(p.list, p.kind).is_none() {
                    return Err(self.cut_off(element, row));
                }
                self.input.reserve(self.row.len(), 12)?;
                for strip in self.row.split(|&v| v < 0.0) {
                    for (i, t) in strip.windows(3).enumerate() {
                        let [a, b, c] = [0, 1, 2].map(|k| faces::index(t[k] as i64));
                        faces.push(&if i % 2 == 0 { [a, b, c] } else { [b, a, c] }, &[]);
                    }
                }
            }
        }
        Ok(())
    }
}

/// Sorts one face property's list into corners or texture coordinates.
fn collect(
    i: usize,
    indices: usize,
    texcoord: Option<usize>,
    row: &[f64],
    corners: &mut Vec<u32>,
    uv: &mut Vec<[f32; 2]>,
) {
    if i == indices {
        corners.extend(row.iter().map(|&v| faces::index(v as i64)));
    } else if Some(i) == texcoord {
        uv.extend(row.chunks_exact(2).map(|c| [c[0] as f32, c[1] as f32]));
    }
}

/// The next line of an ASCII body that is neither blank nor a comment.
fn next_row<'d>(lines: &mut Lines<'d>) -> Option<text::Line<'d>> {
    loop {
        let line = lines.next_filled()?;
        if !line.text.starts_with(b"comment") {
            return Some(line);
        }
    }
}

/// A scalar of an ASCII body; truth values are written out by some programs.
fn value(word: &[u8]) -> Option<f64> {
    text::number(word).or(match word {
        b"true" | b"True" => Some(1.0),
        b"false" | b"False" => Some(0.0),
        _ => None,
    })
}

/// Where the vertex columns stand in the rows. Three properties of one kind that stand together, as nearly always, are one part.
fn parts(element: &Element, targets: &[Target], stride: usize, big: bool) -> Vec<(Target, At)> {
    let properties = &element.properties;
    let together = |i: usize, target: fn(usize) -> Target| {
        (0..3).all(|k| targets.get(i + k) == Some(&target(k)) && properties[i + k].kind == properties[i].kind)
    };
    let mut out = Vec::new();
    let (mut i, mut offset) = (0, 0);
    while i < properties.len() {
        let three = [Target::Position, Target::Normal, Target::Color].iter().any(|&t| together(i, t));
        out.push((targets[i], At { stride, offset, kind: properties[i].kind, big, three }));
        let next = if three { i + 3 } else { i + 1 };
        offset += properties[i..next].iter().map(|p| size(p.kind)).sum::<usize>();
        i = next;
    }
    out
}

/// Fills one column of one block, or three that stand together: dispatches on the target outside the loop over rows.
fn block_column(columns: &mut Columns, target: Target, first: usize, rows: &[u8], at: At) {
    let At { stride, offset, kind, big, three } = at;
    match target {
        Target::Position(k) => {
            let out = &mut columns.positions[first..];
            if three {
                bytes::columns(rows, stride, offset, kind, big, |i, v| out[i] = v);
            } else {
                column(rows, stride, offset, kind, big, |i, v| out[i][k] = v);
            }
        }
        Target::Normal(k) => {
            let out = &mut columns.normals[first..];
            if three {
                bytes::columns(rows, stride, offset, kind, big, |i, v| out[i] = v.map(|v| v as f32));
            } else {
                column(rows, stride, offset, kind, big, |i, v| out[i][k] = v as f32);
            }
        }
        Target::Color(k) => {
            let (scale, all) = (columns.color_scale[k], columns.color_scale);
            let out = &mut columns.colors[first..];
            if three {
                bytes::columns(rows, stride, offset, kind, big, |i, v: [f64; 3]| {
                    out[i][..3].copy_from_slice(&[0, 1, 2].map(|c| (v[c] / all[c]) as f32));
                });
            } else {
                column(rows, stride, offset, kind, big, |i, v| out[i][k] = (v / scale) as f32);
            }
        }
        Target::Uv(k) => {
            let out = &mut columns.uv[first..];
            column(rows, stride, offset, kind, big, |i, v| out[i][k] = v as f32);
        }
        Target::Scalar(k) => {
            let out = &mut columns.scalars[k].values[first..];
            column(rows, stride, offset, kind, big, |i, v| out[i] = v);
        }
        Target::List(_) => {}
    }
}

/// Where a column's numbers stand in the rows.
#[derive(Clone, Copy)]
struct At {
    stride: usize,
    offset: usize,
    kind: ScalarKind,
    big: bool,
    /// Whether three columns of the target stand here, one behind the other.
    three: bool,
}
