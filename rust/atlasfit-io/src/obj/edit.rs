//! An OBJ file with other texture coordinates, and all else as it is.
//!
//! In: the file's bytes, its material library, a mesh read from it with new UVs. Out: the same statements
//! (groups, objects, smoothing, materials, normals of corners, comments) with new `vt` lines and faces that
//! name them; the library with other images.

use super::read::joined;
use crate::faces::{NO_VERTEX, index};
use crate::job::Job;
use crate::text::{self, Lines};
use std::collections::HashMap;
use std::io::{Error, Result, Write};

/// A face statement: each corner's vertex, and its normal as a number from 1.
#[derive(Default)]
struct Corners {
    vertex: Vec<u32>,
    normal: Vec<Option<u32>>,
}

/// How many vertices, texture coordinates and normals came before a statement.
#[derive(Default)]
struct Counts([usize; 3]);

impl Counts {
    fn add(&mut self, key: &[u8]) {
        let keys: [&[u8]; 3] = [b"v", b"vt", b"vn"];
        if let Some(k) = keys.iter().position(|k| *k == key) {
            self.0[k] += 1;
        }
    }

    /// The corners of a face, as the reader takes them.
    fn corners<'a>(&self, words: impl Iterator<Item = &'a [u8]>) -> Corners {
        let mut out = Corners::default();
        for word in words {
            let mut parts = word.split(|&b| b == b'/');
            let mut part = |len: usize| -> Option<u32> {
                let value: i64 = std::str::from_utf8(parts.next()?).ok()?.parse().ok()?;
                Some(index(if value < 0 { len as i64 + value } else { value - 1 }))
            };
            let Some(vertex) = part(self.0[0]) else { break };
            part(self.0[1]);
            out.vertex.push(vertex);
            out.normal.push(part(self.0[2]).filter(|&n| n != NO_VERTEX).map(|n| n + 1));
        }
        out
    }
}

/// The first word of a statement.
fn key(statement: &[u8]) -> &[u8] {
    text::tokens(statement).next().unwrap_or_default()
}

/// A statement without its comment.
fn content(text: &[u8]) -> &[u8] {
    text.split(|&b| b == b'#').next().unwrap_or_default()
}

/// What stands behind the first word.
pub(crate) fn argument(statement: &[u8]) -> String {
    let statement = statement.trim_ascii();
    String::from_utf8_lossy(statement[key(statement).len()..].trim_ascii()).into_owned()
}

/// Names of the materials, and which one each triangle has; `None` before the first `usemtl`.
pub(crate) struct Materials {
    pub names: Vec<String>,
    pub of_triangle: Vec<Option<u32>>,
    /// The libraries that the file names.
    pub libraries: Vec<String>,
}

/// Reads which materials the triangles of a file with so many vertices have.
pub(crate) fn materials(data: &[u8], vertices: usize) -> Materials {
    let mut out = Materials { names: Vec::new(), of_triangle: Vec::new(), libraries: Vec::new() };
    let (mut counts, mut now) = (Counts::default(), None);
    let mut lines = Lines::new(data);
    while let Some(line) = lines.next() {
        let text = joined(&mut lines, line);
        let statement = content(&text);
        match key(statement) {
            b"usemtl" => {
                let name = argument(statement);
                let at = out.names.iter().position(|n| *n == name).unwrap_or_else(|| {
                    out.names.push(name);
                    out.names.len() - 1
                });
                now = Some(at as u32);
            }
            b"mtllib" => out.libraries.push(argument(statement)),
            b"f" | b"fo" => {
                let face = counts.corners(text::tokens(statement).skip(1)).vertex;
                if face.len() >= 3 && face.iter().all(|&v| (v as usize) < vertices) {
                    out.of_triangle.resize(out.of_triangle.len() + face.len() - 2, now);
                }
            }
            other => counts.add(other),
        }
    }
    out
}

/// The faces that are to be written, as the writer of meshes has them.
#[derive(Default)]
struct NewFaces {
    sizes: Vec<u32>,
    vertices: Vec<u32>,
    /// Numbers of texture coordinates, from 1.
    texture: Vec<u32>,
}

/// Writes `data` with the texture coordinates of `job`, whose faces were read from it. `library` replaces the
/// libraries that the file names; `None` keeps their names.
pub(crate) fn write(job: &Job<'_>, data: &[u8], library: Option<&str>, out: &mut impl Write) -> Result<()> {
    let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
    let mut coordinates: Vec<[f32; 2]> = Vec::new();
    let mut faces = NewFaces::default();
    job.each_face(|face| {
        faces.sizes.push(face.corners.len() as u32);
        faces.vertices.extend_from_slice(face.corners);
        for uv in face.uv {
            let next = coordinates.len() as u32 + 1;
            let number = *numbers.entry(uv.map(f32::to_bits)).or_insert(next);
            if number == next {
                coordinates.push(*uv);
            }
            faces.texture.push(number);
        }
        Ok(())
    })?;
    if faces.texture.len() != faces.vertices.len() {
        return Err(Error::other("a face has no texture coordinates"));
    }
    let (mut counts, mut next) = (Counts::default(), Next::default());
    let (mut library, mut listed) = (library, false);
    let mut lines = Lines::new(data);
    while let Some(line) = lines.next() {
        let text = joined(&mut lines, line);
        let statement = content(&text);
        match key(statement) {
            b"vt" => counts.add(b"vt"),
            b"mtllib" if listed || library.is_some() => {
                listed = true;
                if let Some(name) = library.take() {
                    writeln!(out, "mtllib {name}")?;
                }
            }
            b"f" | b"fo" => {
                if !coordinates.is_empty() {
                    // Before the first face: a face may only name what came before it.
                    coordinates.drain(..).try_for_each(|[u, v]| writeln!(out, "vt {u} {v}"))?;
                }
                let face = counts.corners(text::tokens(statement).skip(1));
                if face.vertex.len() >= 3 && face.vertex.iter().all(|&v| (v as usize) < job.positions.len()) {
                    next.write(&faces, &face, out)?;
                }
            }
            other => {
                counts.add(other);
                out.write_all(&text)?;
                writeln!(out)?;
            }
        }
    }
    job.check()
}

/// How many faces and corners are written.
#[derive(Default)]
struct Next {
    face: usize,
    corner: usize,
}

impl Next {
    /// Writes the next face, or the triangles that it was cut into.
    fn write(&mut self, faces: &NewFaces, old: &Corners, out: &mut impl Write) -> Result<()> {
        let mut triangles = 0;
        while triangles < old.vertex.len() - 2 {
            let Some(&size) = faces.sizes.get(self.face) else {
                return Err(Error::other("the file has more faces than were read from it"));
            };
            write!(out, "f")?;
            for at in self.corner..self.corner + size as usize {
                let vertex = faces.vertices[at];
                let same = old.vertex.iter().position(|&v| v == vertex);
                write!(out, " {}/{}", u64::from(vertex) + 1, faces.texture[at])?;
                if let Some(normal) = same.and_then(|k| old.normal[k]) {
                    write!(out, "/{normal}")?;
                }
            }
            writeln!(out)?;
            triangles += size as usize - 2;
            self.face += 1;
            self.corner += size as usize;
        }
        Ok(())
    }
}
