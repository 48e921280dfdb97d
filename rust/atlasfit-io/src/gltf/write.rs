//! Writes GLB.

use super::to_linear;
use crate::save::{Job, Texture, Written};
use std::fmt::Write as _;
use std::io::{Result, Write};

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
    fn view(&mut self, from: usize, target: Option<u32>) -> usize {
        let target = target.map_or(String::new(), |t| format!(",\"target\":{t}"));
        let length = self.bytes.len() - from;
        self.views.push(format!("{{\"buffer\":0,\"byteOffset\":{from},\"byteLength\":{length}{target}}}"));
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        self.views.len() - 1
    }
    fn accessor(
        &mut self,
        from: usize,
        target: u32,
        component: u32,
        count: usize,
        kind: &str,
        more: &str,
    ) -> usize {
        let view = self.view(from, Some(target));
        self.accessors.push(format!(
            "{{\"bufferView\":{view},\"componentType\":{component},\"count\":{count},\"type\":\"{kind}\"{more}}}"
        ));
        self.accessors.len() - 1
    }
    fn floats<const N: usize>(&mut self, rows: impl Iterator<Item = [f32; N]>, more: &str) -> usize {
        let from = self.bytes.len();
        let mut count = 0;
        for row in rows {
            row.iter().for_each(|c| self.bytes.extend_from_slice(&c.to_le_bytes()));
            count += 1;
        }
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        self.accessor(from, ARRAY_BUFFER, FLOAT, count, kind, more)
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

/// One output vertex per distinct (vertex, texture coordinate), by vertex number, so that readers which weld
/// them again get the vertices in their old order. Gives the old vertex and uv of each, and the corners.
#[expect(clippy::type_complexity, reason = "the two tables of a split")]
fn split(job: &Job<'_>, uv: &[[[f32; 2]; 3]]) -> (Vec<(u32, [f32; 2])>, Vec<[u32; 3]>) {
    let key = |t: usize, k: usize| (job.triangles[t][k], uv[t][k].map(f32::to_bits));
    let mut keys: Vec<(u32, [u32; 2])> =
        (0..job.triangles.len()).flat_map(|t| (0..3).map(move |k| key(t, k))).collect();
    let mut used = vec![false; job.positions.len()];
    job.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    keys.extend(used.iter().enumerate().filter(|u| !u.1).map(|(v, _)| (v as u32, [0; 2])));
    keys.sort_unstable();
    keys.dedup();
    let id = |k: (u32, [u32; 2])| keys.partition_point(|&x| x < k) as u32;
    let triangles = (0..job.triangles.len()).map(|t| [0, 1, 2].map(|k| id(key(t, k)))).collect();
    (keys.into_iter().map(|(v, uv)| (v, uv.map(f32::from_bits))).collect(), triangles)
}

pub(crate) fn write(job: &Job<'_>, out: &mut impl Write) -> Result<Written> {
    let mut written = Written::default();
    if job.positions.is_empty() {
        return Err(std::io::Error::other("glTF cannot hold an empty cloud"));
    }
    if job.face_chart.is_some() {
        written.lost.push("chart numbers of the faces".into());
    }
    let mut buffer = Buffer::default();
    let (vertices, triangles) = match job.corner_uv {
        Some(uv) if !job.triangles.is_empty() => split(job, uv),
        _ => ((0..job.positions.len() as u32).map(|v| (v, [0.0; 2])).collect(), job.triangles.to_vec()),
    };
    let finite = || job.positions.iter().filter(|p| p.iter().all(|c| c.is_finite()));
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in finite() {
        for k in 0..3 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    let extent = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let furthest = (0..3).map(|k| high[k].abs().max(low[k].abs())).fold(0.0, f64::max);
    // Shifted only where it pays: a float keeps 24 bits of the distance from the origin.
    let centre = if job.needs_f64() && extent > 0.0 && furthest > 2.0 * extent {
        [0, 1, 2].map(|k| ((low[k] + high[k]) / 2.0).round())
    } else {
        [0.0; 3]
    };
    let position = |v: u32| -> [f32; 3] {
        let p = job.positions[v as usize];
        [0, 1, 2].map(|k| (p[k] - centre[k]) as f32)
    };
    let error = (0..job.positions.len() as u32)
        .flat_map(|v| {
            [0, 1, 2].map(|k| (f64::from(position(v)[k]) + centre[k] - job.positions[v as usize][k]).abs())
        })
        .fold(0.0, f64::max);
    if error > 0.0 {
        written.lost.push(format!("digits of the positions beyond 32-bit floats (errors up to {error:.1e})"));
    }
    if finite().count() < job.positions.len() {
        written
            .lost
            .push("validity: glTF forbids coordinates that are not finite, readers may refuse it".into());
    }
    let mut least = [f32::INFINITY; 3];
    let mut most = [f32::NEG_INFINITY; 3];
    for (v, _) in &vertices {
        for (k, c) in position(*v).into_iter().enumerate() {
            least[k] = least[k].min(c);
            most[k] = most[k].max(c);
        }
    }
    let bounds = if least.iter().chain(&most).all(|c| c.is_finite()) {
        format!(",\"min\":{least:?},\"max\":{most:?}")
    } else {
        String::new()
    };
    let mut names =
        vec![("POSITION".to_owned(), buffer.floats(vertices.iter().map(|v| position(v.0)), &bounds))];
    if let Some(normals) = job.normals {
        names.push(("NORMAL".into(), buffer.floats(vertices.iter().map(|v| normals[v.0 as usize]), "")));
    }
    if let Some(colors) = job.colors {
        let linear = |c: [f32; 4]| [to_linear(c[0]), to_linear(c[1]), to_linear(c[2]), c[3]];
        names.push((
            "COLOR_0".into(),
            buffer.floats(vertices.iter().map(|v| linear(colors[v.0 as usize])), ""),
        ));
    }
    if job.corner_uv.is_some() && !job.triangles.is_empty() {
        // v is down in glTF.
        names.push(("TEXCOORD_0".into(), buffer.floats(vertices.iter().map(|v| [v.1[0], 1.0 - v.1[1]]), "")));
    }
    for a in job.attributes {
        // Names of one's own begin with an underscore and are upper case.
        let clean: String = a.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let mut name = format!("_{}", clean.to_ascii_uppercase());
        while names.iter().any(|n| n.0 == name) {
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
        let rows = vertices.iter().map(|v| v.0);
        let accessor = match a.width {
            1 => buffer.floats(rows.map(|v| [row(v, 0)]), ""),
            2 => buffer.floats(rows.map(|v| [row(v, 0), row(v, 1)]), ""),
            3 => buffer.floats(rows.map(|v| [row(v, 0), row(v, 1), row(v, 2)]), ""),
            _ => buffer.floats(rows.map(|v| [row(v, 0), row(v, 1), row(v, 2), row(v, 3)]), ""),
        };
        names.push((name, accessor));
    }
    let attributes: Vec<String> = names.iter().map(|(n, a)| format!("{}:{a}", quoted(n))).collect();
    let mut primitive = format!("\"attributes\":{{{}}}", attributes.join(","));
    if triangles.is_empty() {
        primitive.push_str(",\"mode\":0");
    } else {
        let from = buffer.bytes.len();
        triangles.iter().flatten().for_each(|v| buffer.bytes.extend_from_slice(&v.to_le_bytes()));
        let accessor =
            buffer.accessor(from, ELEMENT_ARRAY_BUFFER, UNSIGNED_INT, 3 * triangles.len(), "SCALAR", "");
        let _ = write!(primitive, ",\"indices\":{accessor},\"material\":0");
    }
    let mut json = String::from("{\"asset\":{\"version\":\"2.0\",\"generator\":\"atlasfit\"},\"scene\":0,");
    let _ = write!(json, "\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0");
    if centre != [0.0; 3] {
        let _ = write!(json, ",\"translation\":{centre:?}");
    }
    let _ = write!(json, "}}],\"meshes\":[{{\"primitives\":[{{{primitive}}}]}}],");
    if !triangles.is_empty() {
        let mut base = String::new();
        if let Some(texture) = job.texture {
            let image = match texture {
                Texture::Png(bytes) => {
                    let from = buffer.bytes.len();
                    buffer.bytes.extend_from_slice(bytes);
                    format!("{{\"bufferView\":{},\"mimeType\":\"image/png\"}}", buffer.view(from, None))
                }
                Texture::File(name) => format!("{{\"uri\":{}}}", quoted(name)),
            };
            let _ = write!(json, "\"images\":[{image}],\"textures\":[{{\"source\":0}}],");
            base.push_str("\"baseColorTexture\":{\"index\":0},");
        }
        let _ = write!(
            json,
            "\"materials\":[{{\"doubleSided\":true,\"pbrMetallicRoughness\":{{{base}\"metallicFactor\":0,\"roughnessFactor\":1}}}}],"
        );
    }
    let _ = write!(
        json,
        "\"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{}}}]}}",
        buffer.accessors.join(","),
        buffer.views.join(","),
        buffer.bytes.len()
    );
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let total = 12 + 8 + json.len() + 8 + buffer.bytes.len();
    let size = |n: usize| {
        u32::try_from(n)
            .map(u32::to_le_bytes)
            .map_err(|_| std::io::Error::other("GLB files end at 4 GiB: write PLY"))
    };
    out.write_all(b"glTF")?;
    out.write_all(&2u32.to_le_bytes())?;
    out.write_all(&size(total)?)?;
    out.write_all(&size(json.len())?)?;
    out.write_all(b"JSON")?;
    out.write_all(json.as_bytes())?;
    out.write_all(&size(buffer.bytes.len())?)?;
    out.write_all(b"BIN\0")?;
    out.write_all(&buffer.bytes)?;
    Ok(written)
}
