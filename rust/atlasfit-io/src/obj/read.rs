//! Reads OBJ.

use crate::bad_lines::BadLines;
use crate::content::Content;
use crate::error::Result;
use crate::faces::{Faces, NO_VERTEX, index};
use crate::input::Input;
use crate::text::{self, Line, Lines};
use atlasfit::Vec3;
use std::borrow::Cow;

/// Unreadable lines per readable vertex or face (one in so many) before the file is refused; ten may always
/// be.
const BAD_LINES: u64 = 20;

/// A corner of a face that names a normal.
struct CornerNormal {
    vertex: u32,
    normal: u32,
}

/// What the statements read so far say.
#[derive(Default)]
struct Reader {
    positions: Vec<[f64; 3]>,
    colors: Vec<[f32; 4]>,
    /// How many vertices have a colour.
    colored: u64,
    texture: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    faces: Faces,
    corner_normals: Vec<CornerNormal>,
    /// Numbers with a decimal comma.
    commas: u64,
    /// Changes of material.
    materials: u64,
    /// Groups and objects.
    groups: u64,
    /// The first material library named.
    library: Option<String>,
    // Scratch for one face.
    corners: Vec<u32>,
    uv: Vec<[f32; 2]>,
    corner_normal: Vec<u32>,
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let mut lines = input.lines(0, 0);
    let mut r = Reader::default();
    let mut bad = BadLines::default();
    while let Some(line) = lines.next() {
        let text = joined(&mut lines, line);
        let content = text.split(|&b| b == b'#').next().unwrap_or(b"");
        if !r.statement(input, content)? {
            bad.add(line);
        }
    }
    let read = r.positions.len() as u64 + r.faces.triangles.len() as u64;
    if bad.count > 10 && bad.count > read / BAD_LINES {
        let count = bad.count;
        return Err(bad.error(
            input,
            "an OBJ statement such as \"v 0 0 0\" or \"f 1 2 3\"",
            format!("{count} lines are like this: check that this is an OBJ file and not damaged"),
        ));
    }
    input.report.add("lines that cannot be read, repaired or left out", bad.count, bad.first());
    input.report.add("numbers with a decimal comma, read as a point", r.commas, None);
    input.report.add("changes of material, which are not kept", r.materials, None);
    input.report.add("groups and objects, joined into one mesh", r.groups, None);
    let texture = r.library.take().and_then(|name| texture(input, &name));
    Ok(Content { texture, ..r.finish(input)? })
}

/// A line with all that follow it by a backslash at the end.
pub(super) fn joined<'d>(lines: &mut Lines<'d>, line: Line<'d>) -> Cow<'d, [u8]> {
    let mut text = Cow::Borrowed(line.text);
    while text.last() == Some(&b'\\') {
        let mut joined = text.into_owned();
        joined.pop();
        joined.push(b' ');
        let next = lines.next();
        joined.extend_from_slice(next.map_or(b"", |l| l.text));
        text = Cow::Owned(joined);
        if next.is_none() {
            break;
        }
    }
    text
}

/// What stands behind the keyword of a line.
fn rest_of(line: &[u8], key: &[u8]) -> String {
    let line = line.trim_ascii();
    String::from_utf8_lossy(line.get(key.len()..).unwrap_or_default().trim_ascii()).into_owned()
}

/// The first image of a material library beside the file.
fn texture(input: &mut Input<'_>, library: &str) -> Option<Vec<u8>> {
    let library = input.beside(library)?;
    let mut lines = Lines::new(&library);
    let image = std::iter::from_fn(|| lines.next())
        .map(|l| l.text.trim_ascii().to_vec())
        .find(|l| l.to_ascii_lowercase().starts_with(b"map_kd"))?;
    input.beside(&rest_of(&image, b"map_Kd"))
}

impl Reader {
    /// Takes a statement; whether that was possible. An empty line is none.
    fn statement(&mut self, input: &mut Input<'_>, content: &[u8]) -> Result<bool> {
        let mut words = text::tokens(content);
        let Some(key) = words.next() else { return Ok(true) };
        let ok = match key {
            b"v" => {
                let before = self.colors.len();
                let ok = self.vertex(words);
                input.reserve(1, 24)?;
                input.reserve(self.colors.len() - before, 16)?;
                ok
            }
            b"vt" => {
                input.reserve(1, 8)?;
                let c: Vec<f64> = words.map_while(text::number).take(2).collect();
                let uv = [c.first(), c.get(1)].map(|v| v.map_or(0.0, |&v| v as f32));
                self.texture.push(uv);
                !c.is_empty()
            }
            b"vn" => {
                input.reserve(1, 12)?;
                self.normal(words)
            }
            b"f" | b"fo" => {
                let before = [self.faces.triangles.len(), self.corner_normals.len()];
                let ok = self.face(words);
                input.reserve(self.faces.triangles.len() - before[0], 48)?;
                input.reserve(self.corner_normals.len() - before[1], 8)?;
                if self.corners.len() > 3 {
                    // The polygon, its corners, their texture coordinates and normals.
                    input.reserve(1, 24 + 16 * self.corners.len())?;
                }
                ok
            }
            b"usemtl" => {
                self.materials += 1;
                true
            }
            b"g" | b"o" => {
                self.groups += 1;
                true
            }
            b"mtllib" => {
                self.library.get_or_insert_with(|| rest_of(content, key));
                true
            }
            b"s" | b"usemap" | b"mg" | b"maplib" | b"lod" | b"bevel" | b"c_interp" | b"d_interp"
            | b"shadow_obj" | b"trace_obj" => true,
            b"l" | b"p" => {
                input.report.add("line and point elements, left out (their vertices are kept)", 1, None);
                true
            }
            b"vp" | b"cstype" | b"deg" | b"curv" | b"curv2" | b"surf" | b"parm" | b"trim" | b"hole"
            | b"scrv" | b"sp" | b"end" | b"con" | b"bmat" | b"step" | b"ctech" | b"stech" => {
                input.report.add("statements of free-form geometry, left out", 1, None);
                true
            }
            _ => false,
        };
        Ok(ok)
    }

    /// Reads a vertex: x y z, and maybe red green blue, and maybe alpha.
    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> bool {
        let mut c = [0.0f64; 7];
        let mut n = 0;
        let mut ok = true;
        for word in words.take(7) {
            match text::number_or_comma(word) {
                Some((v, comma)) => {
                    c[n] = v;
                    self.commas += u64::from(comma);
                    n += 1;
                }
                None => {
                    ok = n >= 3;
                    break;
                }
            }
        }
        // The vertex must exist whatever its line says, or all later indices would shift.
        ok &= n >= 3;
        self.positions.push(if n >= 3 { [c[0], c[1], c[2]] } else { [f64::NAN; 3] });
        if n >= 6 {
            // White for the vertices before the first coloured one.
            self.colors.resize(self.positions.len() - 1, [1.0; 4]);
            let alpha = if n == 7 { c[6] } else { 1.0 };
            self.colors.push([c[3] as f32, c[4] as f32, c[5] as f32, alpha as f32]);
            self.colored += 1;
        }
        ok
    }

    /// Reads a normal. It must exist whatever its line says, as a vertex must.
    fn normal<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]>) -> bool {
        let mut normal = [0.0f32; 3];
        let mut ok = true;
        for c in &mut normal {
            match words.next().and_then(text::number_or_comma) {
                Some((v, _)) => *c = v as f32,
                None => ok = false,
            }
        }
        self.normals.push(normal);
        ok
    }

    /// Reads a face; a corner is v, v/vt, v//vn or v/vt/vn, counted from 1, or from the end if negative.
    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> bool {
        self.corners.clear();
        self.uv.clear();
        self.corner_normal.clear();
        let mut ok = true;
        for word in words {
            let mut parts = word.split(|&b| b == b'/');
            let mut part = |len: usize| -> Option<u32> {
                let text = parts.next()?;
                let value: i64 = std::str::from_utf8(text).ok()?.parse().ok()?;
                let value = if value < 0 { len as i64 + value } else { value - 1 };
                Some(index(value))
            };
            let Some(vertex) = part(self.positions.len()) else {
                // Programs write "f a b c" with a stray word now and then: the corner counts as wrong.
                ok = false;
                break;
            };
            self.corners.push(vertex);
            if let Some(t) = part(self.texture.len())
                && let Some(&uv) = self.texture.get(t as usize)
            {
                self.uv.push(uv);
            }
            let normal = part(self.normals.len());
            self.corner_normal.push(normal.filter(|&n| n != NO_VERTEX).map_or(0, |n| n + 1));
            if let Some(normal) = normal {
                self.corner_normals.push(CornerNormal { vertex, normal });
            }
        }
        let normal = if self.corner_normals.is_empty() { &[][..] } else { &self.corner_normal };
        self.faces.push(&self.corners, &self.uv, normal);
        ok
    }

    fn finish(mut self, input: &mut Input<'_>) -> Result<Content> {
        let n = self.positions.len();
        if n >= NO_VERTEX as usize {
            return Err(
                input.unsupported(format!("{n} vertices, and indices have 32 bits"), "Split the file")
            );
        }
        let faces = std::mem::take(&mut self.faces).finish(&self.positions, &mut input.report);
        let mut content = Content { faces, ..Content::default() };
        if self.colored > 0 {
            content.cloud.colors = Some(self.take_colors(input));
        }
        if self.corner_normals.is_empty() && self.normals.len() == n && n > 0 {
            // A cloud: one normal per point, in order.
            content.cloud.normals = Some(self.normals);
        } else if !self.corner_normals.is_empty() {
            input.reserve(n, 41)?;
            let (normals, mixed) = self.vertex_normals(input);
            if let Some(normals) = normals.as_deref().filter(|_| mixed) {
                content.faces.look_up_normals(&self.normals, normals);
            }
            content.cloud.normals = normals;
        }
        content.cloud.positions = self.positions;
        Ok(content)
    }

    fn take_colors(&mut self, input: &mut Input<'_>) -> Vec<[f32; 4]> {
        let n = self.positions.len();
        let mut colors = std::mem::take(&mut self.colors);
        colors.resize(n, [1.0; 4]);
        let white = n as u64 - self.colored;
        input.report.add("vertices without a colour among coloured ones, made white", white, None);
        if colors.iter().any(|c| c[..3].iter().any(|&v| v > 1.0)) {
            input.report.add("colours above 1, read as 0 to 255", n as u64, None);
            for v in colors.iter_mut().flat_map(|c| &mut c[..3]) {
                *v /= 255.0;
            }
        }
        colors
    }

    /// One normal per vertex from those of its corners, the mean where they differ; `None` where some vertex
    /// has none. And whether they differ somewhere.
    fn vertex_normals(&self, input: &mut Input<'_>) -> (Option<Vec<[f32; 3]>>, bool) {
        let n = self.positions.len();
        // Per vertex: the first normal of a corner, the sum of all, and whether they differ.
        let mut first = vec![NO_VERTEX; n];
        let mut sum = vec![[0.0f64; 3]; n];
        let mut mixed = vec![false; n];
        for corner in &self.corner_normals {
            let v = corner.vertex as usize;
            let (Some(first), Some(normal)) = (first.get_mut(v), self.normals.get(corner.normal as usize))
            else {
                continue;
            };
            if *first == NO_VERTEX {
                *first = corner.normal;
            } else if self.normals[*first as usize] != *normal {
                mixed[v] = true;
            }
            for c in 0..3 {
                sum[v][c] += f64::from(normal[c]);
            }
        }
        let covered = first.iter().filter(|&&k| k != NO_VERTEX).count();
        if covered < n {
            input.report.add("normals, left out because not every vertex has one", covered as u64, None);
            return (None, false);
        }
        let normal = |v: usize| {
            if mixed[v] { Vec3(sum[v]).normalized().to_f32() } else { self.normals[first[v] as usize] }
        };
        (Some((0..n).map(normal).collect()), mixed.contains(&true))
    }
}
