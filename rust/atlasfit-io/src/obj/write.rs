//! Writes OBJ, and the MTL that names its texture.

use crate::job::{FileBeside, Job, Written};
use std::collections::HashMap;
use std::io::{Result, Write};

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> Result<Written> {
    let mut written = Written::default();
    if !job.attributes.is_empty() {
        written.lost.push(format!("attributes, which OBJ cannot hold: {}", job.attribute_names()));
    }
    if job.has_alpha() {
        written.lost.push("opacity of the colours".into());
    }
    if job.face_chart.is_some() {
        written.lost.push("chart numbers of the faces".into());
    }
    writeln!(out, "# written by atlasfit")?;
    let material = &job.stem;
    if let Some(image) = job.texture_file(&mut written) {
        let mtl = format!("{material}.mtl");
        writeln!(out, "mtllib {mtl}")?;
        let text = format!(
            "# written by atlasfit\nnewmtl {material}\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nd 1\nillum 1\n\
             map_Kd {image}\n"
        );
        written.beside.push(FileBeside { name: mtl, bytes: text.into_bytes() });
    }
    for (i, [x, y, z]) in job.positions.iter().enumerate() {
        match job.colors {
            Some(c) => writeln!(out, "v {x} {y} {z} {} {} {}", c[i][0], c[i][1], c[i][2])?,
            None => writeln!(out, "v {x} {y} {z}")?,
        }
    }
    let at_corners = corner_normals(job, out)?;
    if at_corners.is_none() {
        for [x, y, z] in job.normals.unwrap_or_default() {
            writeln!(out, "vn {x} {y} {z}")?;
        }
    }
    // Equal texture coordinates are written once, in the order of their first use.
    let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
    for uv in job.corner_uv.unwrap_or_default().as_flattened() {
        let next = numbers.len() as u32 + 1;
        if *numbers.entry(uv.map(f32::to_bits)).or_insert(next) == next {
            writeln!(out, "vt {} {}", uv[0], uv[1])?;
        }
    }
    if job.texture.is_some() {
        writeln!(out, "usemtl {material}")?;
    }
    job.each_face(|face| {
        write!(out, "f")?;
        for (k, v) in face.corners.iter().map(|&v| u64::from(v) + 1).enumerate() {
            let vt = face.uv.get(k).and_then(|uv| numbers.get(&uv.map(f32::to_bits)));
            let vn = match &at_corners {
                Some(numbers) => face.normals.get(k).and_then(|n| numbers.get(&n.map(f32::to_bits)).copied()),
                None => job.normals.map(|_| v),
            };
            match (vt, vn) {
                (Some(vt), Some(vn)) => write!(out, " {v}/{vt}/{vn}")?,
                (Some(vt), None) => write!(out, " {v}/{vt}")?,
                (None, Some(vn)) => write!(out, " {v}//{vn}")?,
                (None, None) => write!(out, " {v}")?,
            }
        }
        writeln!(out)
    })?;
    // Vertices that no face uses still have their normals: a cloud's are matched by order.
    if job.normals.is_some() && !job.triangles.is_empty() {
        let mut used = vec![false; job.positions.len()];
        job.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        if used.contains(&false) {
            written.lost.push("normals of vertices that no face uses".into());
        }
    }
    Ok(written)
}

/// Writes the normals of the corners, equal ones once, in the order of their first use; gives their numbers.
/// None where the vertices' normals hold.
fn corner_normals(job: &Job<'_>, out: &mut impl Write) -> Result<Option<HashMap<[u32; 3], u64>>> {
    let Some(normals) = job.corner_normals.filter(|n| !n.is_empty()) else { return Ok(None) };
    let mut numbers = HashMap::new();
    for n in normals.as_flattened() {
        let next = numbers.len() as u64 + 1;
        if *numbers.entry(n.map(f32::to_bits)).or_insert(next) == next {
            writeln!(out, "vn {} {} {}", n[0], n[1], n[2])?;
        }
    }
    Ok(Some(numbers))
}
