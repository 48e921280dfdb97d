//! New texture coordinates for the vertices of a file.
//!
//! In: a file that is edited, a block of vertices, and texture coordinates for the corners of the triangles
//! that use it. Out: the file with vertices split where those differ; all else that a vertex has is copied
//! byte by byte. Old vertices keep their numbers.

use super::edit::Edit;
use super::parts::{Block, Column, Part, corners, is_right};
use super::rows::Rows;
use super::split::Split;
use crate::error::{Error, Result};
use crate::gltf::document::{list, number};
use crate::input::Input;
use crate::job::Job;
use crate::stopping::WRITING;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// The set of texture coordinates that is new.
const NEW_SET: &str = "TEXCOORD_0";

/// Numbers of the format for types of components and uses of buffers.
const UNSIGNED_BYTE: u64 = 5121;
const UNSIGNED_SHORT: u64 = 5123;
const UNSIGNED_INT: u64 = 5125;
const FLOAT: u64 = 5126;
const ARRAY_BUFFER: u64 = 34962;
const ELEMENT_ARRAY_BUFFER: u64 = 34963;

/// What is laid out: all parts, the first triangle of each, and the new texture coordinates.
pub(super) struct Layout<'a> {
    pub parts: &'a [Part],
    pub first: &'a [usize],
    pub job: &'a Job<'a>,
}

/// The corners of a part as they are written.
struct NewCorners {
    part: usize,
    /// `None` where they stay as they are.
    corners: Option<Vec<u32>>,
}

/// Gives the vertices of a block their new texture coordinates. `drops_tangents`: those that they have go.
pub(super) fn lay(
    input: &mut Input<'_>,
    edit: &mut Edit<'_>,
    block: &Block,
    layout: &Layout<'_>,
    drops_tangents: bool,
) -> Result<()> {
    if block.vertices == 0 {
        return Ok(());
    }
    input.reserve(block.vertices, size_of::<Option<[f32; 2]>>())?;
    let mut split = Split::new(block.vertices);
    let mut parts = Vec::new();
    for &part in &block.parts {
        parts.push(new_corners(input, edit, layout, part, &mut split)?);
    }
    let drops = |name: &str| name == "TANGENT" && drops_tangents;
    let mut replaced: BTreeMap<usize, usize> = BTreeMap::new();
    for Column { name, accessor } in block.columns.iter().chain(&block.targets) {
        let stays = split.copies.is_empty() || replaced.contains_key(accessor) || drops(name);
        if !stays && name != NEW_SET {
            let new = copied(input, edit, *accessor, &split.copies)?;
            replaced.insert(*accessor, new);
        }
        layout.job.stop.check(WRITING).map_err(Error::Stopped)?;
    }
    let old = block.columns.iter().find(|c| c.name == NEW_SET).map(|c| c.accessor);
    input.reserve(split.vertices(), 8)?;
    let uv = texture_coordinates(edit, &split, old);
    for NewCorners { part, corners } in parts {
        let of = &layout.parts[part];
        let place = [("meshes", of.mesh), ("primitives", of.primitive)];
        let corners = match corners {
            Some(corners) => {
                let old = number(&super::parts::json_of(&edit.json, of)["indices"]);
                input.reserve(corners.len(), 4)?;
                Some(indices(edit, &corners, old))
            }
            None => None,
        };
        let found = place.iter().try_fold(&mut edit.json, |v, (key, i)| v.get_mut(*key)?.get_mut(*i));
        let Some(primitive) = found.and_then(Value::as_object_mut) else { continue };
        rename(primitive.get_mut("attributes"), &replaced, &drops);
        if let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) {
            attributes.insert(NEW_SET.into(), uv.into());
        }
        for target in primitive.get_mut("targets").and_then(Value::as_array_mut).into_iter().flatten() {
            // What moves the old texture coordinates means nothing to the new ones.
            rename(Some(target), &replaced, &|name| drops(name) || name == NEW_SET);
        }
        if let Some(id) = corners {
            primitive.insert("indices".into(), id.into());
            if primitive.contains_key("mode") {
                primitive.insert("mode".into(), 4.into());
            }
        }
    }
    Ok(())
}

/// Takes the corners of a part to split vertices.
fn new_corners(
    input: &mut Input<'_>,
    edit: &Edit<'_>,
    layout: &Layout<'_>,
    part: usize,
    split: &mut Split,
) -> Result<NewCorners> {
    let Layout { parts, first, job } = layout;
    let (of, first) = (&parts[part], first[part]);
    let old = corners(input, edit.file, of, split.old_vertices())?;
    let uv = job.corner_uv.unwrap_or_default();
    // A copied vertex: itself, its key and its number in the table, its coordinates.
    const COPY: usize = 48;
    let mut out = Vec::with_capacity(3 * of.triangles);
    let (mut t, before) = (first, split.copies.len());
    for triangle in job.watched(old.triangles.iter().filter(|t| is_right(t))) {
        let Some(&[a, b, c]) = uv.get(t) else { break };
        let uv = if of.mirrored { [a, c, b] } else { [a, b, c] };
        (0..3).for_each(|k| out.push(split.corner(triangle[k], uv[k])));
        t += 1;
    }
    job.stop.check(WRITING).map_err(Error::Stopped)?;
    input.reserve(split.copies.len() - before, COPY)?;
    if t != first + of.triangles {
        return Err(input.unsupported("the mesh is not the one that was read", "Read it again"));
    }
    let stays = out.is_empty() || out == old.listed;
    Ok(NewCorners { part, corners: (!stays).then_some(out) })
}

/// The numbers of an object's accessors, renamed; some names are dropped.
fn rename(object: Option<&mut Value>, new: &BTreeMap<usize, usize>, drops: &dyn Fn(&str) -> bool) {
    let Some(object) = object.and_then(Value::as_object_mut) else { return };
    object.retain(|name, _| !drops(name));
    for value in object.values_mut() {
        if let Some(&id) = number(value).and_then(|id| new.get(&id)) {
            *value = id.into();
        }
    }
}

/// What is said of an accessor, without its place and what its numbers decide.
fn described(edit: &Edit<'_>, old: Option<usize>) -> Map<String, Value> {
    let old = old.and_then(|id| list(&edit.file.json, "accessors").get(id)).and_then(Value::as_object);
    let mut out = old.cloned().unwrap_or_default();
    ["byteOffset", "sparse"].iter().for_each(|key| drop(out.shift_remove(*key)));
    out
}

/// The view of an accessor.
fn view_of(edit: &Edit<'_>, accessor: Option<usize>) -> Option<usize> {
    number(&list(&edit.file.json, "accessors").get(accessor?)?["bufferView"])
}

/// An accessor with copies of some rows behind the old ones.
fn copied(input: &mut Input<'_>, edit: &mut Edit<'_>, old: usize, copies: &[u32]) -> Result<usize> {
    let file = edit.file;
    let Ok(rows) = Rows::of(file, old) else { return Ok(old) };
    input.reserve(rows.count + copies.len(), rows.step())?;
    let says = if rows.bytes == rows.step() {
        json!({ "target": ARRAY_BUFFER })
    } else {
        json!({ "byteStride": rows.step(), "target": ARRAY_BUFFER })
    };
    let mut accessor = described(edit, Some(old));
    let view = edit.add_view(rows.with_copies(copies), view_of(edit, Some(old)), says);
    accessor.insert("bufferView".into(), view.into());
    accessor.insert("count".into(), (rows.count + copies.len()).into());
    Ok(edit.add_accessor(accessor, Some(old)))
}

/// The accessor of the new texture coordinates.
fn texture_coordinates(edit: &mut Edit<'_>, split: &Split, old: Option<usize>) -> usize {
    let view = edit.add_view(split.uv_bytes(), view_of(edit, old), json!({ "target": ARRAY_BUFFER }));
    let mut accessor = described(edit, old);
    ["normalized", "min", "max"].iter().for_each(|key| drop(accessor.shift_remove(*key)));
    accessor.insert("bufferView".into(), view.into());
    accessor.insert("componentType".into(), FLOAT.into());
    accessor.insert("count".into(), split.vertices().into());
    accessor.insert("type".into(), "VEC2".into());
    edit.add_accessor(accessor, old)
}

/// The accessor of corners: of the type that the old one has, or of a wider one.
fn indices(edit: &mut Edit<'_>, corners: &[u32], old: Option<usize>) -> usize {
    let mut accessor = described(edit, old);
    // The largest number of a type means something else.
    let largest = corners.iter().max().map_or(0, |&v| u64::from(v));
    let kind = match accessor.get("componentType").and_then(Value::as_u64) {
        Some(UNSIGNED_BYTE) if largest < 0xFF => UNSIGNED_BYTE,
        Some(UNSIGNED_BYTE | UNSIGNED_SHORT) | None if largest < 0xFFFF => UNSIGNED_SHORT,
        _ => UNSIGNED_INT,
    };
    let mut bytes = Vec::with_capacity(4 * corners.len());
    let width = match kind {
        UNSIGNED_BYTE => 1,
        UNSIGNED_SHORT => 2,
        _ => 4,
    };
    corners.iter().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()[..width]));
    let view = edit.add_view(bytes, view_of(edit, old), json!({ "target": ELEMENT_ARRAY_BUFFER }));
    ["normalized", "min", "max"].iter().for_each(|key| drop(accessor.shift_remove(*key)));
    accessor.insert("bufferView".into(), view.into());
    accessor.insert("componentType".into(), kind.into());
    accessor.insert("count".into(), corners.len().into());
    accessor.insert("type".into(), "SCALAR".into());
    edit.add_accessor(accessor, old)
}
