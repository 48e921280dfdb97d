//! Which triangles of a file belong to which primitive, and which primitives share their vertices.
//!
//! In: the file, and what reading added of each primitive. Out: the primitives in the order of the triangles,
//! and blocks of vertices, each with the primitives that use it. A block's vertices are split together.

use super::rows::Rows;
use crate::error::{Location, Result};
use crate::faces::NO_VERTEX;
use crate::gltf::document::{Document, list, number};
use crate::gltf::primitive::Primitive;
use crate::input::Input;
use serde_json::Value;
use std::collections::HashMap;

/// A primitive that holds triangles.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// Its mesh, and its number there.
    pub mesh: usize,
    pub primitive: usize,
    pub material: Option<usize>,
    /// Whether its triangles were turned over as they were read.
    pub mirrored: bool,
    /// How many triangles were read.
    pub triangles: usize,
    /// Its vertices.
    pub block: usize,
}

/// A column of vertices: its name and its accessor.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub name: String,
    pub accessor: usize,
}

/// Vertices that are split together.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// How many there are.
    pub vertices: usize,
    /// The attributes, and those of morph targets.
    pub columns: Vec<Column>,
    pub targets: Vec<Column>,
    /// The parts that use them.
    pub parts: Vec<usize>,
}

/// What the JSON says of a part.
pub(super) fn json_of<'v>(json: &'v Value, part: &Part) -> &'v Value {
    &json["meshes"][part.mesh]["primitives"][part.primitive]
}

/// The columns of an object that names accessors.
fn columns(attributes: &Value) -> Vec<Column> {
    let all = attributes.as_object().into_iter().flatten();
    all.filter_map(|(name, id)| Some(Column { name: name.clone(), accessor: number(id)? })).collect()
}

/// The blocks of the parts, which learn theirs.
pub(super) fn blocks(input: &mut Input<'_>, file: &Document<'_>, parts: &mut [Part]) -> Result<Vec<Block>> {
    let mut known: HashMap<String, usize> = HashMap::new();
    let mut out: Vec<Block> = Vec::new();
    for (i, part) in parts.iter_mut().enumerate() {
        let json = json_of(&file.json, part);
        let key = format!("{}{}", json["attributes"], json["targets"]);
        input.reserve(key.len(), 4)?;
        part.block = *known.entry(key).or_insert(out.len());
        if part.block == out.len() {
            out.push(block(input, file, json)?);
        }
        out[part.block].parts.push(i);
    }
    Ok(out)
}

/// The vertices that a primitive has. Room for all of their columns is accounted for: they are written again.
fn block(input: &mut Input<'_>, file: &Document<'_>, json: &Value) -> Result<Block> {
    let columns_of_vertices = columns(&json["attributes"]);
    let targets: Vec<Column> = list(json, "targets").iter().flat_map(columns).collect();
    let position = number(&json["attributes"]["POSITION"]).unwrap_or(usize::MAX);
    let wrong = |input: &Input<'_>, name: &str, id: usize, found: &str| {
        input.malformed(
            Location::Whole,
            format!("accessor {id} ({name}): {found}"),
            "one row per vertex within the buffers, as glTF 2.0 asks",
            "Correct the file, or write the mesh to .obj or .ply, which keep less of it",
        )
    };
    let vertices = match Rows::of(file, position) {
        Ok(rows) if list(&file.json, "accessors")[position]["type"] == "VEC3" => rows.count,
        Ok(_) => return Err(wrong(input, "POSITION", position, "its type is not VEC3")),
        Err(found) => return Err(wrong(input, "POSITION", position, found)),
    };
    for c in columns_of_vertices.iter().chain(&targets) {
        let rows = Rows::of(file, c.accessor).map_err(|found| wrong(input, &c.name, c.accessor, found))?;
        if rows.count != vertices {
            let found = format!("{} rows for {vertices} vertices", rows.count);
            return Err(wrong(input, &c.name, c.accessor, &found));
        }
        input.reserve(vertices, rows.step())?;
    }
    Ok(Block { vertices, columns: columns_of_vertices, targets, parts: Vec::new() })
}

/// The corners of a part's triangles, which may name vertices that are not there.
pub(super) struct Corners {
    /// The vertices of the corners, as the file has them.
    pub listed: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
}

/// Reads the corners of a part with so many vertices.
pub(super) fn corners(
    input: &mut Input<'_>,
    file: &Document<'_>,
    part: &Part,
    vertices: usize,
) -> Result<Corners> {
    let mut triangles = Vec::new();
    let Some(primitive) = Primitive::of(json_of(&file.json, part)) else {
        return Ok(Corners { listed: Vec::new(), triangles });
    };
    let listed = primitive.corners(input, file, 0, vertices)?;
    input.reserve(listed.len(), 16)?;
    primitive.cut(&listed, &mut triangles);
    Ok(Corners { listed, triangles })
}

/// Whether all vertices of a triangle are there.
pub(super) fn is_right(triangle: &[u32; 3]) -> bool {
    !triangle.contains(&NO_VERTEX)
}
