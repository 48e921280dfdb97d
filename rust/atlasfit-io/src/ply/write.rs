//! Writes PLY.

use super::header::type_name;
use crate::job::{Face, Job, Written, to_u8};
use atlasfit::geometry::{Attribute, ScalarKind};
use std::io::{Result, Write};

/// Names that mean something else at a vertex: an attribute called so gets an underscore.
const TAKEN: [&str; 14] =
    ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha", "r", "g", "b", "a"];

/// Names that are texture coordinates where there are faces.
const UV_NAMES: [&str; 6] = ["s", "t", "u", "v", "texture_u", "texture_v"];

/// Writes one number, binary (little endian) or as text with a space behind it.
fn put(out: &mut impl Write, ascii: bool, kind: ScalarKind, v: f64) -> Result<()> {
    if ascii {
        return match kind {
            ScalarKind::F32 | ScalarKind::F64 => write!(out, "{v} "),
            _ => write!(out, "{} ", v as i64),
        };
    }
    match kind {
        ScalarKind::U8 => out.write_all(&(v as u8).to_le_bytes()),
        ScalarKind::I8 => out.write_all(&(v as i8).to_le_bytes()),
        ScalarKind::U16 => out.write_all(&(v as u16).to_le_bytes()),
        ScalarKind::I16 => out.write_all(&(v as i16).to_le_bytes()),
        ScalarKind::U32 => out.write_all(&(v as u32).to_le_bytes()),
        ScalarKind::I32 => out.write_all(&(v as i32).to_le_bytes()),
        ScalarKind::F32 => out.write_all(&(v as f32).to_le_bytes()),
        ScalarKind::F64 => out.write_all(&v.to_le_bytes()),
    }
}

/// What the header says of the rows, besides what the job says.
struct Plan {
    position: ScalarKind,
    alpha: bool,
    /// The type of the counts in front of a face's lists.
    count: ScalarKind,
}

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> Result<Written> {
    let mut written = Written::default();
    written.note_rounded(job.colors);
    job.note_corner_normals(&mut written);
    // 8 bits count the corners, and twice as many texture coordinates, of all but very large polygons.
    let largest = job.polygons.and_then(|p| p.sizes.iter().max()).copied().unwrap_or(3);
    let plan = Plan {
        position: if job.needs_f64() { ScalarKind::F64 } else { ScalarKind::F32 },
        alpha: job.has_alpha(),
        count: if largest < 128 { ScalarKind::U8 } else { ScalarKind::I32 },
    };
    header(job, &plan, &mut written, out)?;
    for i in 0..job.positions.len() {
        vertex(job, &plan, i, out)?;
    }
    job.each_face(|f| face(job, &plan, &f, out))?;
    Ok(written)
}

fn header(job: &Job<'_>, plan: &Plan, written: &mut Written, out: &mut impl Write) -> Result<()> {
    let texture = job.texture_file(written);
    writeln!(out, "ply\nformat {} 1.0", if job.ascii { "ascii" } else { "binary_little_endian" })?;
    writeln!(out, "comment written by atlasfit")?;
    if let Some(name) = texture {
        writeln!(out, "comment TextureFile {name}")?;
    }
    writeln!(out, "element vertex {}", job.positions.len())?;
    for c in ["x", "y", "z"] {
        writeln!(out, "property {} {c}", type_name(plan.position))?;
    }
    if job.normals.is_some() {
        writeln!(out, "property float nx\nproperty float ny\nproperty float nz")?;
    }
    if job.colors.is_some() {
        writeln!(out, "property uchar red\nproperty uchar green\nproperty uchar blue")?;
        if plan.alpha {
            writeln!(out, "property uchar alpha")?;
        }
    }
    let mut names: Vec<String> = Vec::new();
    for a in job.attributes {
        let name = free_name(&a.name, &names, !job.triangles.is_empty());
        if name != a.name {
            written.lost.push(format!("attribute \"{}\" renamed to \"{name}\"", a.name));
        }
        if a.width == 1 {
            writeln!(out, "property {} {name}", type_name(a.kind))?;
        } else {
            writeln!(out, "property list {} {} {name}", type_name(list_count(a)), type_name(a.kind))?;
        }
        names.push(name);
    }
    if !job.triangles.is_empty() {
        let count = type_name(plan.count);
        writeln!(out, "element face {}\nproperty list {count} int vertex_indices", job.face_count())?;
        if job.corner_uv.is_some() {
            writeln!(out, "property list {count} float texcoord")?;
        }
        if job.face_chart.is_some() {
            writeln!(out, "property int chart")?;
        }
    }
    writeln!(out, "end_header")
}

/// The type of the count in front of an attribute of several numbers per vertex.
fn list_count(attribute: &Attribute) -> ScalarKind {
    if attribute.width < 256 { ScalarKind::U8 } else { ScalarKind::I32 }
}

/// The name of an attribute, changed where it could not be read back or means something else.
fn free_name(name: &str, names: &[String], has_faces: bool) -> String {
    let mut name: String =
        name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect();
    let is_taken = |name: &str| {
        let is = |t: &&str| t.eq_ignore_ascii_case(name);
        TAKEN.iter().any(is) || has_faces && UV_NAMES.iter().any(is)
    };
    while name.is_empty() || is_taken(&name) || names.iter().any(|n| n.eq_ignore_ascii_case(&name)) {
        name.push('_');
    }
    name
}

fn vertex(job: &Job<'_>, plan: &Plan, i: usize, out: &mut impl Write) -> Result<()> {
    let ascii = job.ascii;
    for &c in &job.positions[i] {
        put(out, ascii, plan.position, c)?;
    }
    if let Some(normals) = job.normals {
        for c in normals[i] {
            put(out, ascii, ScalarKind::F32, f64::from(c))?;
        }
    }
    if let Some(colors) = job.colors {
        for &c in &colors[i][..if plan.alpha { 4 } else { 3 }] {
            put(out, ascii, ScalarKind::U8, f64::from(to_u8(c)))?;
        }
    }
    for a in job.attributes {
        if a.width > 1 {
            put(out, ascii, list_count(a), a.width as f64)?;
        }
        for &v in &a.values[i * a.width..(i + 1) * a.width] {
            put(out, ascii, a.kind, v)?;
        }
    }
    if ascii { writeln!(out) } else { Ok(()) }
}

fn face(job: &Job<'_>, plan: &Plan, face: &Face<'_>, out: &mut impl Write) -> Result<()> {
    let ascii = job.ascii;
    put(out, ascii, plan.count, face.corners.len() as f64)?;
    for &v in face.corners {
        put(out, ascii, ScalarKind::U32, f64::from(v))?;
    }
    if job.corner_uv.is_some() {
        put(out, ascii, plan.count, 2.0 * face.uv.len() as f64)?;
        for &c in face.uv.as_flattened() {
            put(out, ascii, ScalarKind::F32, f64::from(c))?;
        }
    }
    if let Some(chart) = job.face_chart {
        // "No chart" is u32::MAX here and -1 in the file: the same bits.
        put(out, ascii, ScalarKind::I32, f64::from(chart[face.triangle] as i32))?;
    }
    if ascii { writeln!(out) } else { Ok(()) }
}
