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
    for [x, y, z] in job.normals.unwrap_or_default() {
        writeln!(out, "vn {x} {y} {z}")?;
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
            match (vt, job.normals.is_some()) {
                (Some(vt), true) => write!(out, " {v}/{vt}/{v}")?,
                (Some(vt), false) => write!(out, " {v}/{vt}")?,
                (None, true) => write!(out, " {v}//{v}")?,
                (None, false) => write!(out, " {v}")?,
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
