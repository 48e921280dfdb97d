//! Writes OFF.

use crate::job::{Job, Written, to_u8};
use std::io::{Result, Write};

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> Result<Written> {
    let mut written = Written::default();
    if !job.attributes.is_empty() {
        written.lost.push(format!("attributes, which OFF cannot hold: {}", job.attribute_names()));
    }
    if job.corner_uv.is_some() {
        written.lost.push("texture coordinates".into());
    }
    job.note_corner_normals(&mut written);
    if job.face_chart.is_some() {
        written.lost.push("chart numbers of the faces".into());
    }
    written.note_rounded(job.colors);
    let color = if job.colors.is_some() { "C" } else { "" };
    let normal = if job.normals.is_some() { "N" } else { "" };
    writeln!(out, "{color}{normal}OFF\n{} {} 0", job.positions.len(), job.face_count())?;
    for (i, [x, y, z]) in job.positions.iter().enumerate() {
        write!(out, "{x} {y} {z}")?;
        for c in job.normals.map(|n| n[i]).into_iter().flatten() {
            write!(out, " {c}")?;
        }
        for c in job.colors.map(|c| c[i]).into_iter().flatten() {
            write!(out, " {}", to_u8(c))?;
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
