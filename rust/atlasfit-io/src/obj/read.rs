//! Reads OBJ.

use crate::error::{Place, Result};
use crate::faces::{Faces, NO_VERTEX};
use crate::load::{Content, Input};
use crate::text::{self, Lines};
use atlasfit::Vec3;
use std::borrow::Cow;

/// Unreadable lines per readable vertex or face (one in so many) before the file is refused.
const BAD_LINES: u64 = 20;

#[derive(Default)]
struct Reader {
    positions: Vec<[f64; 3]>,
    colors: Vec<[f32; 4]>,
    colored: u64,
    texture: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// The normal that a vertex got from its corners: sum and how often, and whether they differ.
    vertex_normal: Vec<u32>,
    faces: Faces,
    // Scratch for one face.
    corners: Vec<u32>,
    uv: Vec<[f32; 2]>,
    corner_normals: Vec<(u32, u32)>,
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let data = input.data;
    let mut lines = Lines::new(data);
    let mut r = Reader::default();
    let (mut bad, mut commas) = (0u64, 0u64);
    let mut first_bad: Option<(u64, String)> = None;
    let mut corner_normals: Vec<(u32, u32)> = Vec::new();
    let (mut materials, mut groups) = (0, 0);
    let mut library: Option<String> = None;
    while let Some(line) = lines.next() {
        let mut text = Cow::Borrowed(line.text);
        // A backslash at the end of a line joins the next one to it.
        while text.last() == Some(&b'\\') {
            let mut joined = text.into_owned();
            joined.pop();
            joined.push(b' ');
            let Some(next) = lines.next() else {
                text = Cow::Owned(joined);
                break;
            };
            joined.extend_from_slice(next.text);
            text = Cow::Owned(joined);
        }
        let content = text.split(|&b| b == b'#').next().unwrap_or(b"");
        let mut words = text::tokens(content);
        let Some(key) = words.next() else { continue };
        let ok = match key {
            b"v" => {
                input.reserve(1, 24)?;
                r.vertex(words, &mut commas)
            }
            b"vt" => {
                input.reserve(1, 8)?;
                let c: Vec<f64> = words.map_while(text::number).take(2).collect();
                let uv = [c.first(), c.get(1)].map(|v| v.map_or(0.0, |&v| v as f32));
                r.texture.push(uv);
                !c.is_empty()
            }
            b"vn" => {
                input.reserve(1, 12)?;
                let mut n = [0.0f32; 3];
                let mut ok = true;
                for c in &mut n {
                    match words.next().and_then(text::number_or_comma) {
                        Some((v, _)) => *c = v as f32,
                        None => ok = false,
                    }
                }
                r.normals.push(n);
                ok
            }
            b"f" | b"fo" => {
                let before = r.faces.triangles.len();
                let ok = r.face(words);
                input.reserve(r.faces.triangles.len() - before, 36)?;
                corner_normals.append(&mut r.corner_normals);
                ok
            }
            b"usemtl" => {
                materials += 1;
                true
            }
            b"g" | b"o" => {
                groups += 1;
                true
            }
            b"mtllib" => {
                library.get_or_insert_with(|| rest_of(content, key));
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
        if !ok {
            bad += 1;
            first_bad.get_or_insert_with(|| (line.number, text::quote(line.text)));
        }
    }
    let read = r.positions.len() as u64 + r.faces.triangles.len() as u64;
    if bad > 10 && bad > read / BAD_LINES {
        let (number, found) = first_bad.unwrap_or_default();
        return Err(input.malformed(
            Place::Line(number),
            found,
            "an OBJ statement such as \"v 0 0 0\" or \"f 1 2 3\"",
            format!("{bad} lines are like this: check that this is an OBJ file and not damaged"),
        ));
    }
    input.report.add(
        "lines that cannot be read, repaired or left out",
        bad,
        first_bad.map(|f| format!("line {}", f.0)),
    );
    input.report.add("numbers with a decimal comma, read as a point", commas, None);
    input.report.add("changes of material, which are not kept", materials, None);
    input.report.add("groups and objects, joined into one mesh", groups, None);
    let texture = library.and_then(|name| texture(input, &name));
    Ok(Content { texture, ..r.finish(input, &corner_normals)? })
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
    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>, commas: &mut u64) -> bool {
        let mut c = [0.0f64; 7];
        let mut n = 0;
        let mut ok = true;
        for word in words.take(7) {
            match text::number_or_comma(word) {
                Some((v, comma)) => {
                    c[n] = v;
                    *commas += u64::from(comma);
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

    /// Reads a face; a corner is v, v/vt, v//vn or v/vt/vn, counted from 1, or from the end if negative.
    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> bool {
        self.corners.clear();
        self.uv.clear();
        self.corner_normals.clear();
        let mut ok = true;
        for word in words {
            let mut parts = word.split(|&b| b == b'/');
            let mut part = |len: usize| -> Option<u32> {
                let text = parts.next()?;
                let value: i64 = std::str::from_utf8(text).ok()?.parse().ok()?;
                let value = if value < 0 { len as i64 + value } else { value - 1 };
                Some(crate::faces::index(value))
            };
            let Some(v) = part(self.positions.len()) else {
                // Programs write "f a b c" with a stray word now and then: the corner counts as wrong.
                ok = false;
                break;
            };
            self.corners.push(v);
            if let Some(t) = part(self.texture.len())
                && let Some(&uv) = self.texture.get(t as usize)
            {
                self.uv.push(uv);
            }
            if let Some(n) = part(self.normals.len()) {
                self.corner_normals.push((v, n));
            }
        }
        self.faces.push(&self.corners, &self.uv);
        ok
    }

    fn finish(mut self, input: &mut Input<'_>, corner_normals: &[(u32, u32)]) -> Result<Content> {
        let n = self.positions.len();
        if n >= NO_VERTEX as usize {
            return Err(
                input.unsupported(format!("{n} vertices, and indices have 32 bits"), "Split the file")
            );
        }
        let mut content = Content::default();
        let faces = self.faces.finish(&self.positions, &mut input.report);
        content.faces = faces.triangles;
        content.corner_uv = faces.corner_uv;
        content.polygons = faces.polygons;
        if self.colored > 0 {
            self.colors.resize(n, [1.0; 4]);
            input.report.add(
                "vertices without a colour among coloured ones, made white",
                n as u64 - self.colored,
                None,
            );
            if self.colors.iter().any(|c| c[..3].iter().any(|&v| v > 1.0)) {
                input.report.add("colours above 1, read as 0 to 255", n as u64, None);
                for v in self.colors.iter_mut().flat_map(|c| &mut c[..3]) {
                    *v /= 255.0;
                }
            }
            content.cloud.colors = Some(self.colors);
        }
        input.reserve(n, 16)?;
        self.vertex_normal.resize(n, NO_VERTEX);
        if corner_normals.is_empty() && self.normals.len() == n && n > 0 {
            // A cloud: one normal per point, in order.
            content.cloud.normals = Some(self.normals);
        } else if !corner_normals.is_empty() {
            let mut sum = vec![[0.0f64; 3]; n];
            let mut mixed = vec![false; n];
            for &(v, k) in corner_normals {
                let (Some(slot), Some(normal)) =
                    (self.vertex_normal.get_mut(v as usize), self.normals.get(k as usize))
                else {
                    continue;
                };
                let v = v as usize;
                if *slot == NO_VERTEX {
                    *slot = k;
                } else if self.normals[*slot as usize] != *normal {
                    mixed[v] = true;
                }
                for c in 0..3 {
                    sum[v][c] += f64::from(normal[c]);
                }
            }
            let covered = self.vertex_normal.iter().filter(|&&k| k != NO_VERTEX).count();
            input.report.add(
                "vertices with different normals at different corners, averaged",
                mixed.iter().filter(|&&m| m).count() as u64,
                None,
            );
            if covered == n {
                let normal = |v: usize| {
                    if mixed[v] {
                        Vec3(sum[v]).normalized().to_f32()
                    } else {
                        self.normals[self.vertex_normal[v] as usize]
                    }
                };
                content.cloud.normals = Some((0..n).map(normal).collect());
            } else {
                input.report.add("normals, left out because not every vertex has one", covered as u64, None);
            }
        }
        content.cloud.positions = self.positions;
        Ok(content)
    }
}
