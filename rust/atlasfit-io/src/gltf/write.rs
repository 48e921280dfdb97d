//! Writes GLB, and glTF as text with its buffer and its image beside it.

use super::color::to_linear;
use crate::job::{FileBeside, Job, Texture, Written};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{Error, Result, Write};

/// Numbers of the format for types of components and uses of buffers.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The binary chunk and the JSON that describes it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Buffer {
    /// Makes a view of the bytes from `from` on; its number.
    fn view(&mut self, from: usize, target: Option<u32>) -> usize {
        let target = target.map_or(String::new(), |t| format!(",\"target\":{t}"));
        let length = self.bytes.len() - from;
        self.views.push(format!("{{\"buffer\":0,\"byteOffset\":{from},\"byteLength\":{length}{target}}}"));
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        self.views.len() - 1
    }

    /// Describes a view; `description` is what the JSON says of it after its number. The number of the
    /// accessor.
    fn accessor(&mut self, view: usize, description: &str) -> usize {
        self.accessors.push(format!("{{\"bufferView\":{view},{description}}}"));
        self.accessors.len() - 1
    }

    /// Adds rows of floats. `more` is put behind their description. The number of the accessor.
    fn floats<const N: usize>(&mut self, rows: impl Iterator<Item = [f32; N]>, more: &str) -> usize {
        let from = self.bytes.len();
        let mut count = 0;
        // A buffer that doubles would hold up to twice the file.
        self.bytes.reserve_exact(size_of::<[f32; N]>() * rows.size_hint().0);
        for row in rows {
            row.iter().for_each(|c| self.bytes.extend_from_slice(&c.to_le_bytes()));
            count += 1;
        }
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        let view = self.view(from, Some(ARRAY_BUFFER));
        self.accessor(view, &format!("\"componentType\":{FLOAT},\"count\":{count},\"type\":\"{kind}\"{more}"))
    }

    /// Adds indices. The number of the accessor.
    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let from = self.bytes.len();
        self.bytes.reserve_exact(size_of_val(triangles));
        triangles.iter().flatten().for_each(|v| self.bytes.extend_from_slice(&v.to_le_bytes()));
        let view = self.view(from, Some(ELEMENT_ARRAY_BUFFER));
        let count = 3 * triangles.len();
        self.accessor(
            view,
            &format!("\"componentType\":{UNSIGNED_INT},\"count\":{count},\"type\":\"SCALAR\""),
        )
    }
}

/// A string as JSON.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if (c as u32) < 32 => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A vertex as it is written.
#[derive(Clone, Copy)]
struct Vertex {
    /// Its number in the mesh.
    old: u32,
    /// A triangle and which of its corners has the vertex's texture coordinate and normal; none where no
    /// triangle uses it.
    corner: Option<(u32, u8)>,
}

impl Vertex {
    /// The value of a column of corners at it.
    fn at<T: Copy + Default>(self, column: &[[T; 3]]) -> T {
        self.corner.map_or_else(T::default, |(t, k)| column[t as usize][k as usize])
    }
}

/// The mesh with vertices split where texture coordinates or normals differ between corners.
struct Split<'a> {
    vertices: Vec<Vertex>,
    triangles: Cow<'a, [[u32; 3]]>,
}

impl<'a> Split<'a> {
    fn of(job: &Job<'a>) -> Result<Self> {
        match (job.corner_uv, job.corner_normals) {
            _ if job.triangles.is_empty() => Ok(Self::whole(job)),
            (None, None) => Ok(Self::whole(job)),
            (Some(uv), None) => Self::by(job, |t, k| uv[t][k].map(f32::to_bits)),
            (None, Some(n)) => Self::by(job, |t, k| n[t][k].map(f32::to_bits)),
            (Some(uv), Some(n)) => {
                Self::by(job, |t, k| (uv[t][k].map(f32::to_bits), n[t][k].map(f32::to_bits)))
            }
        }
    }

    /// The vertices as they are.
    fn whole(job: &Job<'a>) -> Self {
        let vertices = (0..job.positions.len() as u32).map(|old| Vertex { old, corner: None }).collect();
        Self { vertices, triangles: job.triangles.into() }
    }

    /// One vertex per distinct pair of vertex and value at a triangle's corner, ordered by vertex, so that
    /// readers which weld them again get the vertices in their old order.
    fn by<T: Ord + Copy>(job: &Job<'_>, value: impl Fn(usize, usize) -> T) -> Result<Self> {
        let corners = (0..job.triangles.len()).flat_map(|t| (0..3).map(move |k| (t, k)));
        let mut keys: Vec<(u32, Option<T>)> =
            corners.clone().map(|(t, k)| (job.triangles[t][k], Some(value(t, k)))).collect();
        let mut used = vec![false; job.positions.len()];
        job.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        keys.extend(used.iter().enumerate().filter(|u| !u.1).map(|(v, _)| (v as u32, None)));
        job.check()?;
        keys.sort_unstable();
        keys.dedup();
        let mut vertices: Vec<Vertex> = keys.iter().map(|&(old, _)| Vertex { old, corner: None }).collect();
        let mut triangles = vec![[0; 3]; job.triangles.len()];
        for (t, k) in job.watched(corners) {
            let key = (job.triangles[t][k], Some(value(t, k)));
            let id = keys.partition_point(|&x| x < key);
            triangles[t][k] = id as u32;
            vertices[id].corner = Some((t as u32, k as u8));
        }
        job.check()?;
        Ok(Self { vertices, triangles: Cow::Owned(triangles) })
    }
}

/// Smallest and largest of each coordinate; infinite without points.
struct Bounds<T> {
    low: [T; 3],
    high: [T; 3],
}

/// What the positions are stored relative to, so that 32-bit floats hold their digits.
fn centre(job: &Job<'_>) -> [f64; 3] {
    let mut bounds = Bounds { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
    for p in job.positions.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
        for (k, &c) in p.iter().enumerate() {
            bounds.low[k] = bounds.low[k].min(c);
            bounds.high[k] = bounds.high[k].max(c);
        }
    }
    let Bounds { low, high } = bounds;
    let extent = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let furthest = (0..3).map(|k| high[k].abs().max(low[k].abs())).fold(0.0, f64::max);
    // Shifted only where it pays: a float keeps 24 bits of the distance from the origin.
    if job.needs_f64() && extent > 0.0 && furthest > 2.0 * extent {
        [0, 1, 2].map(|k| ((low[k] + high[k]) / 2.0).round())
    } else {
        [0.0; 3]
    }
}

/// The bounds of the positions as JSON, which the format asks for; empty where some are not finite.
fn bounds_json(positions: impl Iterator<Item = [f32; 3]>) -> String {
    let mut bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };
    for p in positions {
        for (k, c) in p.into_iter().enumerate() {
            bounds.low[k] = bounds.low[k].min(c);
            bounds.high[k] = bounds.high[k].max(c);
        }
    }
    let Bounds { low, high } = bounds;
    if low.iter().chain(&high).all(|c| c.is_finite()) {
        format!(",\"min\":{low:?},\"max\":{high:?}")
    } else {
        String::new()
    }
}

/// Says what the positions lose as 32-bit floats about `centre`.
fn note_lost_positions(job: &Job<'_>, centre: [f64; 3], written: &mut Written) {
    let error = job
        .positions
        .iter()
        .flat_map(|p| [0, 1, 2].map(|k| (f64::from((p[k] - centre[k]) as f32) + centre[k] - p[k]).abs()))
        .fold(0.0, f64::max);
    if error > 0.0 {
        written.lost.push(format!("digits of the positions beyond 32-bit floats (errors up to {error:.1e})"));
    }
    if !job.positions.iter().flatten().all(|c| c.is_finite()) {
        let what = "validity: glTF forbids coordinates that are not finite, readers may refuse it";
        written.lost.push(what.into());
    }
}

/// A column of the vertices: its name in the format and its accessor.
struct Column {
    name: String,
    accessor: usize,
}

/// Adds the columns of the vertices to the buffer.
fn columns(
    job: &Job<'_>,
    vertices: &[Vertex],
    centre: [f64; 3],
    buffer: &mut Buffer,
    written: &mut Written,
) -> Vec<Column> {
    let position = |v: &Vertex| -> [f32; 3] {
        let p = job.positions[v.old as usize];
        [0, 1, 2].map(|k| (p[k] - centre[k]) as f32)
    };
    let bounds = bounds_json(vertices.iter().map(position));
    let column = |name: &str, accessor: usize| Column { name: name.to_owned(), accessor };
    let mut out = vec![column("POSITION", buffer.floats(vertices.iter().map(position), &bounds))];
    if let Some(normals) = job.corner_normals.filter(|_| !job.triangles.is_empty()) {
        let of_vertex = |v: u32| job.normals.map_or([0.0; 3], |n| n[v as usize]);
        let rows = vertices.iter().map(|v| if v.corner.is_some() { v.at(normals) } else { of_vertex(v.old) });
        out.push(column("NORMAL", buffer.floats(rows, "")));
    } else if let Some(normals) = job.normals {
        let rows = vertices.iter().map(|v| normals[v.old as usize]);
        out.push(column("NORMAL", buffer.floats(rows, "")));
    }
    if let Some(colors) = job.colors {
        let linear = |c: [f32; 4]| [to_linear(c[0]), to_linear(c[1]), to_linear(c[2]), c[3]];
        let rows = job.watched(vertices.iter()).map(|v| linear(colors[v.old as usize]));
        out.push(column("COLOR_0", buffer.floats(rows, "")));
    }
    if let Some(uv) = job.corner_uv.filter(|_| !job.triangles.is_empty()) {
        // v is down in glTF.
        let rows = vertices.iter().map(|v| v.at(uv)).map(|[u, v]| [u, 1.0 - v]);
        out.push(column("TEXCOORD_0", buffer.floats(rows, "")));
    }
    for a in job.attributes {
        // Names of one's own begin with an underscore and are upper case.
        let clean: String = a.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let mut name = format!("_{}", clean.to_ascii_uppercase());
        while out.iter().any(|n| n.name == name) {
            name.push('_');
        }
        if a.width > 4 {
            written.lost.push(format!("attribute \"{}\" of {} numbers per point", a.name, a.width));
            continue;
        }
        if a.values.iter().any(|&v| f64::from(v as f32) != v && !v.is_nan()) {
            written.lost.push(format!("digits of \"{}\" beyond a 32-bit float", a.name));
        }
        let row = |v: u32, k: usize| a.values[v as usize * a.width + k] as f32;
        let rows = vertices.iter().map(|v| v.old);
        let accessor = match a.width {
            1 => buffer.floats(rows.map(|v| [row(v, 0)]), ""),
            2 => buffer.floats(rows.map(|v| [row(v, 0), row(v, 1)]), ""),
            3 => buffer.floats(rows.map(|v| [row(v, 0), row(v, 1), row(v, 2)]), ""),
            _ => buffer.floats(rows.map(|v| [row(v, 0), row(v, 1), row(v, 2), row(v, 3)]), ""),
        };
        out.push(Column { name, accessor });
    }
    out
}

/// Whether the file is JSON: its buffer and its image lie beside it then.
fn is_text(job: &Job<'_>) -> bool {
    job.extension == "gltf"
}

/// The material of a mesh as JSON, and in front of it the texture, whose bytes go to the buffer of a GLB.
fn material(job: &Job<'_>, buffer: &mut Buffer, written: &mut Written) -> String {
    let mut json = String::new();
    let mut base = "";
    let image = match job.texture {
        Some(Texture::Png(bytes)) if !is_text(job) => {
            let from = buffer.bytes.len();
            buffer.bytes.extend_from_slice(bytes);
            Some(format!("{{\"bufferView\":{},\"mimeType\":\"image/png\"}}", buffer.view(from, None)))
        }
        _ => job.texture_file(written).map(|name| format!("{{\"uri\":{}}}", quoted(&name))),
    };
    if let Some(image) = image {
        let _ = write!(json, "\"images\":[{image}],\"textures\":[{{\"source\":0}}],");
        base = "\"baseColorTexture\":{\"index\":0},";
    }
    let _ = write!(
        json,
        "\"materials\":[{{\"doubleSided\":true,\"pbrMetallicRoughness\":\
         {{{base}\"metallicFactor\":0,\"roughnessFactor\":1}}}}],"
    );
    json
}

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> Result<Written> {
    let mut written = Written::default();
    if job.positions.is_empty() {
        return Err(Error::other("glTF cannot hold an empty cloud"));
    }
    if job.face_chart.is_some() {
        written.lost.push("chart numbers of the faces".into());
    }
    let mut buffer = Buffer::default();
    let Split { vertices, triangles } = Split::of(job)?;
    let centre = centre(job);
    note_lost_positions(job, centre, &mut written);
    job.check()?;
    let columns = columns(job, &vertices, centre, &mut buffer, &mut written);
    job.check()?;
    let attributes: Vec<String> =
        columns.iter().map(|c| format!("{}:{}", quoted(&c.name), c.accessor)).collect();
    let mut primitive = format!("\"attributes\":{{{}}}", attributes.join(","));
    if triangles.is_empty() {
        primitive.push_str(",\"mode\":0");
    } else {
        let _ = write!(primitive, ",\"indices\":{},\"material\":0", buffer.indices(&triangles));
    }
    let mut json = String::from("{\"asset\":{\"version\":\"2.0\",\"generator\":\"atlasfit\"},\"scene\":0,");
    let _ = write!(json, "\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0");
    if centre != [0.0; 3] {
        let _ = write!(json, ",\"translation\":{centre:?}");
    }
    let _ = write!(json, "}}],\"meshes\":[{{\"primitives\":[{{{primitive}}}]}}],");
    if !triangles.is_empty() {
        json.push_str(&material(job, &mut buffer, &mut written));
    }
    let name = format!("{}.bin", job.stem);
    let uri = if is_text(job) { format!("\"uri\":{},", quoted(&name)) } else { String::new() };
    let _ = write!(
        json,
        "\"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{{uri}\"byteLength\":{}}}]}}",
        buffer.accessors.join(","),
        buffer.views.join(","),
        buffer.bytes.len()
    );
    if is_text(job) {
        out.write_all(json.as_bytes())?;
        written.beside.push(FileBeside { name, bytes: buffer.bytes });
        return Ok(written);
    }
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    glb(json.as_bytes(), &buffer.bytes, out)?;
    Ok(written)
}

/// Writes the two chunks of a GLB, whose lengths are multiples of four.
fn glb(json: &[u8], binary: &[u8], out: &mut impl Write) -> Result<()> {
    glb_until_binary(json, binary.len(), out)?;
    out.write_all(binary)
}

/// Writes a GLB up to the bytes of its binary chunk.
pub(super) fn glb_until_binary(json: &[u8], binary: usize, out: &mut impl Write) -> Result<()> {
    let size = |n: usize| {
        let size = u32::try_from(n).map_err(|_| Error::other("GLB files end at 4 GiB: write PLY"));
        size.map(u32::to_le_bytes)
    };
    out.write_all(b"glTF")?;
    out.write_all(&2u32.to_le_bytes())?;
    out.write_all(&size(12 + 8 + json.len() + 8 + binary)?)?;
    out.write_all(&size(json.len())?)?;
    out.write_all(b"JSON")?;
    out.write_all(json)?;
    out.write_all(&size(binary)?)?;
    out.write_all(b"BIN\0")
}
