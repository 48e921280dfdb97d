//! STL, binary and ASCII (3D Systems 1989).
//!
//! Read: triangles, whose equal corners become one vertex (the format repeats every corner). Facet normals
//! and the two bytes of attributes are left out. Written: binary unless asked otherwise; positions become
//! 32-bit floats.

use crate::content::Content;
use crate::error::{Location, Result};
use crate::faces::Faces;
use crate::input::Input;
use crate::job::{Job, Written};
use crate::text;
use crate::weld::{bits, weld};
use atlasfit::Vec3;
use atlasfit::geometry::PointCloud;
use std::io::Write;

/// Bytes in front of the first triangle: 80 of any text, then the count.
const HEADER: usize = 84;
/// Bytes of a triangle: a normal and three corners as 32-bit floats, and two bytes of attributes.
const RECORD: usize = 50;

/// Whether these bytes are an STL file. Less is asked of a file that its name calls so.
pub(crate) fn is_stl(data: &[u8], called_so: bool) -> bool {
    if let Some(count) = binary_count(data)
        && HEADER as u64 + RECORD as u64 * u64::from(count) == data.len() as u64
        && (count > 0 || called_so)
    {
        return true;
    }
    is_ascii(data) || called_so && data.len() > HEADER && data.iter().take(4096).any(|&b| b == 0)
}

fn is_ascii(data: &[u8]) -> bool {
    const HEAD: usize = 2000;
    let head = data[..data.len().min(HEAD)].to_ascii_lowercase();
    let has = |word: &[u8]| head.windows(word.len()).any(|w| w == word);
    head.trim_ascii_start().starts_with(b"solid") && !head.contains(&0) && (has(b"facet") || has(b"endsolid"))
}

/// The number of triangles that a binary file announces.
fn binary_count(data: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(data.get(80..HEADER)?.try_into().ok()?))
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let whole = binary_count(input.data)
        .is_some_and(|n| HEADER as u64 + RECORD as u64 * u64::from(n) == input.data.len() as u64);
    let corners = if !whole && is_ascii(input.data) { ascii(input)? } else { binary(input)? };
    input.reserve(corners.len(), 60)?;
    let welded = weld(input.watched(corners.iter().map(|&p| bits(p))));
    let positions: Vec<[f64; 3]> = welded.first.iter().map(|&i| corners[i as usize]).collect();
    let joined = corners.len() - positions.len();
    input.report.add("repeated corners of triangles, joined where exactly equal", joined as u64, None);
    let mut faces = Faces::default();
    for t in welded.ids.chunks_exact(3) {
        faces.push(t, &[], &[]);
    }
    let faces = faces.finish(&positions, &mut input.report);
    let cloud = PointCloud::from_positions(positions);
    Ok(Content { cloud, faces, ..Content::default() })
}

/// The corners of a binary file's triangles.
fn binary(input: &mut Input<'_>) -> Result<Vec<[f64; 3]>> {
    let announced = binary_count(input.data).unwrap_or(0) as usize;
    let body = input.data.get(HEADER..).unwrap_or_default();
    let there = body.len() / RECORD;
    let read = there.min(announced);
    input.reserve(there, 72)?;
    let mut corners = Vec::with_capacity(3 * read);
    let mut implausible = 0;
    for record in input.watched(body.chunks_exact(RECORD).take(read)) {
        let mut v = [0.0f64; 12];
        for (v, b) in v.iter_mut().zip(record.chunks_exact(4)) {
            *v = f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        }
        let length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        implausible += usize::from(!(length2 == 0.0 || (0.25..4.0).contains(&length2)));
        corners.extend([[v[3], v[4], v[5]], [v[6], v[7], v[8]], [v[9], v[10], v[11]]]);
    }
    if read < announced {
        // Facet normals are unit vectors: bytes that were never STL do not look so.
        if read == 0 || 2 * implausible > read {
            return Err(input.malformed(
                Location::Byte(80),
                format!("{announced} triangles announced and {} bytes behind", body.len()),
                format!("{RECORD} bytes for each triangle"),
                "This is no STL file, or it is damaged: get it again",
            ));
        }
        let first = Some(format!("byte {}", input.data.len()));
        let missing = (announced - read) as u64;
        input.report.add(
            "triangles announced by the header but not in the file (it is cut off)",
            missing,
            first,
        );
    }
    let rest = (body.len() - read * RECORD) as u64;
    input.report.add(
        "bytes after the last triangle, left out",
        if read == announced { rest } else { 0 },
        None,
    );
    Ok(corners)
}

/// The corners of a text file's triangles.
fn ascii(input: &mut Input<'_>) -> Result<Vec<[f64; 3]>> {
    let mut corners = Vec::new();
    let mut facet: Vec<[f64; 3]> = Vec::new();
    let (mut bad, mut first_bad) = (0, None);
    let (mut odd, mut first_odd) = (0, None);
    for line in input.lines(0, 0) {
        let mut words = text::tokens(line.text);
        while let Some(word) = words.next() {
            if word.eq_ignore_ascii_case(b"vertex") {
                let mut p = [f64::NAN; 3];
                let ok = p.iter_mut().all(|c| words.next().and_then(text::number).map(|v| *c = v).is_some());
                if !ok {
                    bad += 1;
                    first_bad.get_or_insert(format!("line {}", line.number));
                }
                facet.push(p);
            } else if word.eq_ignore_ascii_case(b"endloop") || word.eq_ignore_ascii_case(b"endfacet") {
                if facet.len() == 3 {
                    input.reserve(3, 24)?;
                    corners.append(&mut facet);
                } else if !facet.is_empty() {
                    odd += 1;
                    first_odd.get_or_insert(format!("line {}", line.number));
                    facet.clear();
                }
            } else if word.eq_ignore_ascii_case(b"solid") || word.eq_ignore_ascii_case(b"endsolid") {
                // What follows is a name, which may be any word.
                break;
            }
        }
    }
    if bad > 10 && bad > corners.len() as u64 / 20 {
        return Err(input.malformed(
            Location::Line(1),
            format!("{bad} corners that are not three numbers"),
            "lines such as \"vertex 0 0 1\"",
            "The file is damaged: get it again",
        ));
    }
    input.report.add("corners that cannot be read, kept as NaN", bad, first_bad);
    input.report.add("facets without exactly three corners, left out", odd, first_odd);
    let open = u64::from(!facet.is_empty());
    input.report.add("facets cut off by the end of the file, left out", open, None);
    Ok(corners)
}

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> std::io::Result<Written> {
    let mut written = Written::default();
    let lost = &mut written.lost;
    if job.triangles.is_empty() && !job.positions.is_empty() {
        lost.push("all points: STL holds triangles only".into());
    }
    if job.normals.is_some() || job.colors.is_some() || !job.attributes.is_empty() {
        lost.push("normals, colours and attributes of the vertices".into());
    }
    if job.corner_uv.is_some() {
        lost.push("texture coordinates".into());
    }
    if job.face_chart.is_some() {
        lost.push("chart numbers of the faces".into());
    }
    if !job.ascii && job.needs_f64() {
        lost.push("digits of the positions beyond 32-bit floats".into());
    }
    let count = u32::try_from(job.triangles.len())
        .map_err(|_| std::io::Error::other("too many triangles for STL"))?;
    if job.ascii {
        writeln!(out, "solid atlasfit")?;
    } else {
        let mut header = [b' '; 80];
        header[..19].copy_from_slice(b"written by atlasfit");
        out.write_all(&header)?;
        out.write_all(&count.to_le_bytes())?;
    }
    for t in job.triangles {
        let [a, b, c] = t.map(|v| Vec3(job.positions[v as usize]));
        let n = (b - a).cross(c - a).normalized();
        if job.ascii {
            writeln!(out, "facet normal {} {} {}\nouter loop", n[0], n[1], n[2])?;
            for Vec3([x, y, z]) in [a, b, c] {
                writeln!(out, "vertex {x} {y} {z}")?;
            }
            writeln!(out, "endloop\nendfacet")?;
        } else {
            for v in [n, a, b, c].iter().flat_map(|p| p.iter()) {
                out.write_all(&(*v as f32).to_le_bytes())?;
            }
            out.write_all(&[0, 0])?;
        }
    }
    if job.ascii {
        writeln!(out, "endsolid atlasfit")?;
    }
    Ok(written)
}
