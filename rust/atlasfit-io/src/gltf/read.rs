//! Reads glTF and GLB: the scene's meshes and point sets, moved by their nodes (in f64), joined into one.
//!
//! Vertices that were split for texture coordinates or normals are joined again where their positions, colours and
//! other attributes are exactly equal. Materials, images, skins, morph targets and animations are left out.

use super::to_srgb;
use crate::bytes::{column, size};
use crate::error::{Place, Result};
use crate::faces::{Faces, index};
use crate::load::{Content, Input};
use crate::weld::{bits, weld};
use atlasfit::Vec3;
use atlasfit::geometry::{Attribute, ScalarKind};
use serde_json::Value;
use std::borrow::Cow;

/// Vertices, and corners of triangles, that instances of one mesh may multiply to.
const MOST: usize = 1 << 27;

type Matrix = [[f64; 4]; 3];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// What all nodes gave together; the optional columns as long as the positions or empty.
#[derive(Default)]
struct Scene {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f32; 3]>,
    colors: Vec<[f32; 4]>,
    uv: Vec<[f32; 2]>,
    attributes: Vec<Attribute>,
    triangles: Vec<[u32; 3]>,
    skipped: u64,
    normalless: bool,
}

struct File<'d> {
    json: Value,
    buffers: Vec<Cow<'d, [u8]>>,
}

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let data = input.data;
    let (json, binary) = if data.starts_with(b"glTF") { chunks(input)? } else { (data, None) };
    let json: Value = serde_json::from_slice(json).map_err(|e| {
        input.malformed(
            if data.starts_with(b"{") { Place::Line(e.line() as u64) } else { Place::Byte(20) },
            format!("JSON that cannot be read ({e})"),
            "the JSON of a glTF file",
            "The file is damaged: get it again",
        )
    })?;
    if !json["asset"]["version"].as_str().is_some_and(|v| v.starts_with('2')) {
        return Err(input.unsupported("this is not glTF 2", "Write it again as glTF 2.0"));
    }
    for extension in list(&json, "extensionsRequired").iter().filter_map(Value::as_str) {
        if matches!(extension, "KHR_draco_mesh_compression" | "EXT_meshopt_compression") {
            return Err(input.unsupported(
                format!("the meshes are compressed ({extension})"),
                "Write the file again without compression",
            ));
        }
    }
    let buffers = buffers(input, &json, binary)?;
    let file = File { json, buffers };
    let mut scene = Scene::default();
    walk(input, &file, &mut scene)?;
    let texture = texture(input, &file);
    Ok(Content { texture, ..finish(input, scene)? })
}

/// The image of the first material that has a base colour texture.
fn texture(input: &mut Input<'_>, file: &File<'_>) -> Option<Vec<u8>> {
    let of = |m: &Value| number(&m["pbrMetallicRoughness"]["baseColorTexture"]["index"]);
    let id = list(&file.json, "materials").iter().find_map(of)?;
    let image = list(&file.json, "textures").get(id).and_then(|t| number(&t["source"]))?;
    let image = list(&file.json, "images").get(image)?;
    match image["uri"].as_str() {
        Some(uri) => match uri.strip_prefix("data:") {
            Some(data) => base64(data.split_once(',')?.1.as_bytes()),
            None => input.beside(&unescape(uri)),
        },
        None => {
            let view = list(&file.json, "bufferViews").get(number(&image["bufferView"])?)?;
            let from = number(&view["byteOffset"]).unwrap_or(0);
            let bytes = file.buffers.get(number(&view["buffer"])?)?;
            let bytes = bytes.get(from..from.checked_add(number(&view["byteLength"])?)?)?;
            input.reserve(bytes.len(), 1).ok()?;
            Some(bytes.to_vec())
        }
    }
}

fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

fn number(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|v| usize::try_from(v).ok())
}

/// The JSON and the binary chunk of a GLB.
fn chunks<'d>(input: &Input<'d>) -> Result<(&'d [u8], Option<&'d [u8]>)> {
    let data = input.data;
    let word =
        |at: usize| data.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let cut = |at: usize, expected: &str| {
        input.malformed(
            Place::Byte(at as u64),
            "a chunk longer than the file",
            expected,
            "The file is cut off: get it again",
        )
    };
    let chunk = |at: usize| -> Option<(&[u8], &[u8])> {
        let body = data.get(at + 8..(at + 8).checked_add(word(at)?)?)?;
        Some((data.get(at + 4..at + 8)?, body))
    };
    let Some((b"JSON", json)) = chunk(12) else { return Err(cut(12, "a JSON chunk")) };
    let next = 20 + json.len().next_multiple_of(4);
    let binary = match chunk(next) {
        Some((b"BIN\0", body)) => Some(body),
        None if next + 8 <= data.len() => return Err(cut(next, "a binary chunk")),
        _ => None,
    };
    Ok((json, binary))
}

fn buffers<'d>(input: &mut Input<'d>, json: &Value, binary: Option<&'d [u8]>) -> Result<Vec<Cow<'d, [u8]>>> {
    let mut out = Vec::new();
    for (i, buffer) in list(json, "buffers").iter().enumerate() {
        let place = format!("buffer {i}");
        let Some(uri) = buffer["uri"].as_str() else {
            out.push(Cow::Borrowed(if i == 0 { binary.unwrap_or_default() } else { &[] }));
            continue;
        };
        let bytes = if let Some(rest) = uri.strip_prefix("data:") {
            rest.split_once(',').and_then(|(_, text)| base64(text.as_bytes()))
        } else {
            // Files beside this one only: a model has no business anywhere else.
            let name = unescape(uri);
            let path = std::path::Path::new(&name);
            let inside = path.components().all(|c| matches!(c, std::path::Component::Normal(_)));
            if !inside {
                return Err(input.unsupported(
                    format!("{place} names a file outside of the folder ({name})"),
                    "Put the file beside the glTF file, or write a GLB",
                ));
            }
            let path = input.path.with_file_name("").join(path);
            if let Ok(about) = std::fs::metadata(&path) {
                input.reserve(about.len() as usize, 1)?;
            }
            std::fs::read(path).ok()
        };
        let Some(bytes) = bytes else {
            return Err(input.unsupported(
                format!("{place} cannot be read ({})", uri.chars().take(60).collect::<String>()),
                "Put the file that it names beside the glTF file, or write a GLB",
            ));
        };
        input.reserve(bytes.len(), 1)?;
        out.push(Cow::Owned(bytes));
    }
    Ok(out)
}

/// The bytes of a base64 text (RFC 4648).
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0);
    for &c in text.iter().filter(|c| !c.is_ascii_whitespace() && **c != b'=') {
        let six = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(six);
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    Some(out)
}

/// A URI's %-escapes as characters.
fn unescape(uri: &str) -> String {
    let mut bytes = Vec::new();
    let raw = uri.as_bytes();
    let mut i = 0;
    while i < raw.len() {
        let hex = (raw[i] == b'%').then(|| raw.get(i + 1..i + 3)).flatten();
        match hex.and_then(|h| std::str::from_utf8(h).ok()).and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(b) => {
                bytes.push(b);
                i += 3;
            }
            None => {
                bytes.push(raw[i]);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn walk(input: &mut Input<'_>, file: &File<'_>, scene: &mut Scene) -> Result<()> {
    let nodes = list(&file.json, "nodes");
    let scenes = list(&file.json, "scenes");
    let children = |v: &Value, key: &str| -> Vec<usize> { list(v, key).iter().filter_map(number).collect() };
    let roots = match scenes.get(number(&file.json["scene"]).unwrap_or(0)) {
        Some(s) => children(s, "nodes"),
        // Without a scene: every node that is nobody's child.
        None => {
            let mut is_child = vec![false; nodes.len()];
            for c in nodes.iter().flat_map(|n| children(n, "children")) {
                is_child.get_mut(c).into_iter().for_each(|b| *b = true);
            }
            (0..nodes.len()).filter(|&i| !is_child[i]).collect()
        }
    };
    // A library of meshes without nodes is shown as it is.
    if nodes.is_empty() {
        for mesh in 0..list(&file.json, "meshes").len() {
            add_mesh(input, file, scene, mesh, &IDENTITY)?;
        }
        return Ok(());
    }
    let mut visited = vec![false; nodes.len()];
    let mut stack: Vec<(usize, Matrix)> = roots.into_iter().rev().map(|n| (n, IDENTITY)).collect();
    while let Some((id, parent)) = stack.pop() {
        let Some(node) = nodes.get(id) else { continue };
        // Nodes form a tree: one met twice is an error of the file, and might be a circle.
        if std::mem::replace(&mut visited[id], true) {
            input.report.add("nodes with two parents, used once", 1, Some(format!("node {id}")));
            continue;
        }
        let world = multiply(&parent, &local(node));
        if let Some(mesh) = number(&node["mesh"]) {
            add_mesh(input, file, scene, mesh, &world)?;
        }
        if node.get("skin").is_some() {
            input.report.add("skinned meshes, read in their rest pose", 1, None);
        }
        stack.extend(children(node, "children").into_iter().rev().map(|c| (c, world)));
    }
    Ok(())
}

/// A node's own transform.
fn local(node: &Value) -> Matrix {
    let numbers = |key: &str, n: usize| -> Option<Vec<f64>> {
        let v: Vec<f64> = node[key].as_array()?.iter().filter_map(Value::as_f64).collect();
        (v.len() == n).then_some(v)
    };
    if let Some(m) = numbers("matrix", 16) {
        // Column after column.
        return [0, 1, 2].map(|r| [0, 1, 2, 3].map(|c| m[4 * c + r]));
    }
    let t = numbers("translation", 3).unwrap_or(vec![0.0; 3]);
    let s = numbers("scale", 3).unwrap_or(vec![1.0; 3]);
    let q = numbers("rotation", 4).unwrap_or(vec![0.0, 0.0, 0.0, 1.0]);
    let [x, y, z, w] = [q[0], q[1], q[2], q[3]];
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    [0, 1, 2].map(|i| [r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], t[i]])
}

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|r| {
        [0, 1, 2, 3].map(|c| {
            let last = if c == 3 { a[r][3] } else { 0.0 };
            a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c] + last
        })
    })
}

/// The numbers of an accessor, row after row, and how many a row has.
fn accessor(input: &mut Input<'_>, file: &File<'_>, id: usize) -> Result<(Vec<f64>, usize)> {
    let wrong = |input: &Input<'_>, found: &str| {
        input.malformed(
            Place::Whole,
            format!("accessor {id}: {found}"),
            "data within the buffers, as glTF 2.0 asks",
            "The file is cut off or damaged: get it again",
        )
    };
    let Some(a) = list(&file.json, "accessors").get(id) else { return Err(wrong(input, "it is not there")) };
    let width = match a["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        _ => return Err(wrong(input, "a type other than SCALAR, VEC2, VEC3, VEC4")),
    };
    let kind = |component: &Value| {
        Some(match component.as_u64()? {
            5120 => ScalarKind::I8,
            5121 => ScalarKind::U8,
            5122 => ScalarKind::I16,
            5123 => ScalarKind::U16,
            5125 => ScalarKind::U32,
            5126 => ScalarKind::F32,
            _ => return None,
        })
    };
    let Some(component) = kind(&a["componentType"]) else {
        return Err(wrong(input, "an unknown component type"));
    };
    let Some(count) = number(&a["count"]) else { return Err(wrong(input, "no count")) };
    // Rows of `kind` numbers from a view; `None` where they leave the buffer.
    let rows = |view: &Value,
                offset: &Value,
                kind: ScalarKind,
                width: usize,
                count: usize|
     -> Option<(&[u8], usize)> {
        let v = list(&file.json, "bufferViews").get(number(view)?)?;
        let buffer = file.buffers.get(number(&v["buffer"])?)?;
        let from = number(&v["byteOffset"]).unwrap_or(0);
        let bytes = buffer.get(from..from.checked_add(number(&v["byteLength"])?)?)?;
        let bytes = bytes.get(number(offset).unwrap_or(0)..)?;
        let row = width * size(kind);
        let stride = number(&v["byteStride"]).unwrap_or(row);
        if stride < row {
            return None;
        }
        if count == 0 {
            return Some((&[], stride));
        }
        let needed = (count - 1).checked_mul(stride)?.checked_add(row)?;
        Some((bytes.get(..needed)?, stride))
    };
    let scale = if a["normalized"].as_bool() == Some(true) {
        match component {
            ScalarKind::I8 => 127.0,
            ScalarKind::U8 => 255.0,
            ScalarKind::I16 => 32767.0,
            ScalarKind::U16 => 65535.0,
            _ => 1.0,
        }
    } else {
        1.0
    };
    let mut values = Vec::new();
    let fill = |values: &mut [f64], bytes: &[u8], stride: usize, width: usize, kind: ScalarKind| {
        for k in 0..width {
            // The last row may be shorter than the stride: rows are cut to start at their number.
            let from = k * size(kind);
            let n = values.len() / width;
            for (i, row) in bytes[from.min(bytes.len())..].chunks(stride).take(n).enumerate() {
                if row.len() >= size(kind) {
                    column(&row[..size(kind)], size(kind), 0, kind, false, |_, v| values[i * width + k] = v);
                }
            }
        }
    };
    if a.get("bufferView").is_some() {
        let Some((bytes, stride)) = rows(&a["bufferView"], &a["byteOffset"], component, width, count) else {
            return Err(wrong(input, "data outside of their buffer"));
        };
        input.reserve(count, 8 * width)?;
        values.resize(count * width, 0.0);
        fill(&mut values, bytes, stride, width, component);
    } else {
        if count > input.data.len() {
            return Err(wrong(input, "more zeros than the file has bytes"));
        }
        input.reserve(count, 8 * width)?;
        values.resize(count * width, 0.0);
    }
    if let Some(sparse) = a.get("sparse") {
        let n = number(&sparse["count"]).unwrap_or(0);
        let (i, v) = (&sparse["indices"], &sparse["values"]);
        let places = kind(&i["componentType"])
            .and_then(|k| rows(&i["bufferView"], &i["byteOffset"], k, 1, n).map(|r| (r, k)));
        let news = rows(&v["bufferView"], &v["byteOffset"], component, width, n);
        let (Some(((ib, is), ik)), Some((vb, vs))) = (places, news) else {
            return Err(wrong(input, "sparse data outside of their buffer"));
        };
        let mut at = vec![0.0; n];
        fill(&mut at, ib, is, 1, ik);
        let mut new = vec![0.0; n * width];
        fill(&mut new, vb, vs, width, component);
        for (at, new) in at.into_iter().zip(new.chunks_exact(width)) {
            if let Some(row) = values.chunks_exact_mut(width).nth(at as usize) {
                row.copy_from_slice(new);
            }
        }
    }
    if scale != 1.0 {
        values.iter_mut().for_each(|v| *v = (*v / scale).max(-1.0));
    }
    Ok((values, width))
}

fn add_mesh(
    input: &mut Input<'_>,
    file: &File<'_>,
    scene: &mut Scene,
    mesh: usize,
    world: &Matrix,
) -> Result<()> {
    let Some(mesh) = list(&file.json, "meshes").get(mesh) else {
        input.report.add("nodes that name a mesh that is not there", 1, None);
        return Ok(());
    };
    for primitive in list(mesh, "primitives") {
        let mode = primitive["mode"].as_u64().unwrap_or(4);
        if primitive["extensions"].get("KHR_draco_mesh_compression").is_some() {
            return Err(input.unsupported(
                "the meshes are compressed (KHR_draco_mesh_compression)",
                "Write the file again without compression",
            ));
        }
        let attributes = &primitive["attributes"];
        let Some(position) = number(&attributes["POSITION"]) else { continue };
        if !matches!(mode, 0 | 4 | 5 | 6) {
            input.report.add("sets of lines, whose points are kept", 1, None);
        }
        add_primitive(input, file, scene, primitive, position, mode, world)?;
        if primitive.get("targets").is_some() {
            input.report.add("meshes with morph targets, read in their rest shape", 1, None);
        }
    }
    Ok(())
}

fn add_primitive(
    input: &mut Input<'_>,
    file: &File<'_>,
    scene: &mut Scene,
    primitive: &Value,
    position: usize,
    mode: u64,
    world: &Matrix,
) -> Result<()> {
    let attributes = &primitive["attributes"];
    let count = |id: usize| number(&list(&file.json, "accessors").get(id).unwrap_or(&Value::Null)["count"]);
    let first = scene.positions.len();
    // What is claimed is checked again when it is read; here it only stops multiplication.
    let corners = number(&primitive["indices"]).and_then(count).unwrap_or(0);
    let claimed = count(position).unwrap_or(0);
    if first.saturating_add(claimed) > MOST || (3 * scene.triangles.len()).saturating_add(corners) > MOST {
        return Err(input.unsupported(
            format!("instances of its meshes make more than {MOST} vertices or corners"),
            "Give the meshes without instances",
        ));
    }
    let (p, width) = accessor(input, file, position)?;
    let n = if width == 3 { p.len() / 3 } else { 0 };
    input.reserve(n, 72)?;
    scene.positions.extend(p.chunks_exact(3).map(|p| {
        [0, 1, 2].map(|r| world[r][0] * p[0] + world[r][1] * p[1] + world[r][2] * p[2] + world[r][3])
    }));
    let mut get = |name: &str| -> Result<Option<(Vec<f64>, usize)>> {
        let Some(id) = number(&attributes[name]).filter(|&id| count(id) == Some(n)) else { return Ok(None) };
        accessor(input, file, id).map(|(v, w)| (v.len() / w == n).then_some((v, w)))
    };
    // Normals turn by the cofactors of the matrix (the inverse transposed, up to a factor).
    let [a, b, c] = [0, 1, 2].map(|r| Vec3([world[r][0], world[r][1], world[r][2]]));
    let cofactor = [b.cross(c), c.cross(a), a.cross(b)];
    let mirrored = a[0] * cofactor[0][0] + a[1] * cofactor[0][1] + a[2] * cofactor[0][2] < 0.0;
    let moved = [a.0, b.0, c.0] != [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    match get("NORMAL")? {
        Some((v, 3)) => {
            scene.normals.resize(first, [0.0; 3]);
            scene.normals.extend(v.chunks_exact(3).map(|v| {
                if !moved {
                    return [v[0] as f32, v[1] as f32, v[2] as f32];
                }
                let sign = if mirrored { -1.0 } else { 1.0 };
                let t = cofactor.map(|r| sign * (r[0] * v[0] + r[1] * v[1] + r[2] * v[2]));
                Vec3(t).normalized().to_f32()
            }));
        }
        _ => scene.normalless |= n > 0,
    }
    if let Some((v, w @ 3..=4)) = get("COLOR_0")? {
        scene.colors.resize(first, [1.0; 4]);
        scene.colors.extend(v.chunks_exact(w).map(|c| {
            let [r, g, b] = [0, 1, 2].map(|k| to_srgb(c[k] as f32));
            [r, g, b, if w == 4 { c[3] as f32 } else { 1.0 }]
        }));
    }
    if let Some((v, 2)) = get("TEXCOORD_0")? {
        scene.uv.resize(first, [0.0; 2]);
        // v is down in glTF.
        scene.uv.extend(v.chunks_exact(2).map(|t| [t[0] as f32, 1.0 - t[1] as f32]));
    }
    for name in
        attributes.as_object().into_iter().flatten().map(|(k, _)| k.as_str()).filter(|k| k.starts_with('_'))
    {
        let Some((v, width)) = get(name)? else { continue };
        let name = name.trim_start_matches('_').to_lowercase();
        let column = match scene.attributes.iter_mut().find(|a| a.name == name) {
            Some(c) if c.width == width => c,
            Some(_) => continue,
            None => {
                scene.attributes.push(Attribute { name, width, kind: ScalarKind::F32, values: Vec::new() });
                let last = scene.attributes.len() - 1;
                &mut scene.attributes[last]
            }
        };
        column.values.resize(first * width, 0.0);
        column.values.extend(v);
    }
    // Columns that this primitive lacks.
    let total = first + n;
    let pad = |len: usize| len > 0 && len < total;
    if pad(scene.normals.len()) {
        scene.normals.resize(total, [0.0; 3]);
    }
    if pad(scene.colors.len()) {
        scene.colors.resize(total, [1.0; 4]);
    }
    if pad(scene.uv.len()) {
        scene.uv.resize(total, [0.0; 2]);
    }
    for a in &mut scene.attributes {
        a.values.resize(total * a.width, 0.0);
    }
    if !matches!(mode, 4..=6) {
        return Ok(());
    }
    let corners: Vec<u32> = match number(&primitive["indices"]) {
        Some(id) => {
            let (v, _) = accessor(input, file, id)?;
            // Wrong indices must stay wrong after the shift.
            v.into_iter().map(|v| if v < n as f64 { first as u32 + v as u32 } else { index(-1) }).collect()
        }
        None => (first as u32..total as u32).collect(),
    };
    input.reserve(corners.len(), 16)?;
    let turn = |t: [u32; 3]| if mirrored { [t[0], t[2], t[1]] } else { t };
    match mode {
        4 => {
            scene.triangles.extend(corners.chunks_exact(3).map(|t| turn([t[0], t[1], t[2]])));
            scene.skipped += u64::from(!corners.len().is_multiple_of(3));
        }
        5 => scene.triangles.extend(
            corners
                .windows(3)
                .enumerate()
                .map(|(i, t)| turn(if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })),
        ),
        _ => scene.triangles.extend(corners.windows(2).skip(1).map(|t| turn([corners[0], t[0], t[1]]))),
    }
    Ok(())
}

fn finish(input: &mut Input<'_>, mut scene: Scene) -> Result<Content> {
    let mut out = Content::default();
    input.report.add("lists of triangles with corners left over", scene.skipped, None);
    if scene.normalless && !scene.normals.is_empty() {
        input.report.add(
            "normals, left out because not every mesh has them",
            scene.normals.len() as u64,
            None,
        );
        scene.normals.clear();
    }
    if scene.triangles.is_empty() {
        out.cloud.positions = scene.positions;
        out.cloud.normals = (!scene.normals.is_empty()).then_some(scene.normals);
        out.cloud.colors = (!scene.colors.is_empty()).then_some(scene.colors);
        out.cloud.attributes = scene.attributes;
        return Ok(out);
    }
    let others = |i: usize| {
        let numbers = scene.attributes.iter().flat_map(|a| &a.values[i * a.width..(i + 1) * a.width]);
        // FNV-1a.
        numbers.fold(0xCBF2_9CE4_8422_2325u64, |h, v| (h ^ v.to_bits()).wrapping_mul(0x0100_0000_01B3))
    };
    input.reserve(scene.positions.len(), 64)?;
    let (ids, first) =
        weld((0..scene.positions.len()).map(|i| {
            (bits(scene.positions[i]), scene.colors.get(i).map(|c| c.map(f32::to_bits)), others(i))
        }));
    let joined = ids.len() - first.len();
    input.report.add(
        "vertices split for texture coordinates or normals, joined where exactly equal",
        joined as u64,
        None,
    );
    let firsts = || first.iter().map(|&i| i as usize);
    out.cloud.positions = firsts().map(|i| scene.positions[i]).collect();
    if !scene.colors.is_empty() {
        out.cloud.colors = Some(firsts().map(|i| scene.colors[i]).collect());
    }
    for a in &scene.attributes {
        let values =
            firsts().flat_map(|i| a.values[i * a.width..(i + 1) * a.width].iter().copied()).collect();
        out.cloud.attributes.push(Attribute { values, ..a.clone() });
    }
    if !scene.normals.is_empty() {
        let mut normals: Vec<[f32; 3]> = firsts().map(|i| scene.normals[i]).collect();
        let mut sums = vec![[0.0f64; 3]; first.len()];
        let mut differ = vec![false; first.len()];
        for (i, &id) in ids.iter().enumerate() {
            let id = id as usize;
            differ[id] |= scene.normals[i] != normals[id];
            for (s, &c) in sums[id].iter_mut().zip(&scene.normals[i]) {
                *s += f64::from(c);
            }
        }
        for (id, _) in differ.iter().enumerate().filter(|d| *d.1) {
            normals[id] = Vec3(sums[id]).normalized().to_f32();
        }
        let averaged = differ.iter().filter(|d| **d).count();
        input.report.add(
            "vertices with different normals at different corners, averaged",
            averaged as u64,
            None,
        );
        out.cloud.normals = Some(normals);
    }
    let mut faces = Faces::default();
    for t in &scene.triangles {
        let corner = |v: u32| ids.get(v as usize).copied().unwrap_or(index(-1));
        let uv = |v: u32| scene.uv.get(v as usize).copied().unwrap_or_default();
        if scene.uv.is_empty() {
            faces.push(&t.map(corner), &[]);
        } else {
            faces.push(&t.map(corner), &t.map(uv));
        }
    }
    let faces = faces.finish(&out.cloud.positions, &mut input.report);
    out.faces = faces.triangles;
    out.corner_uv = faces.corner_uv;
    Ok(out)
}
