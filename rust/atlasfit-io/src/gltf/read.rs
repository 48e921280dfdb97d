//! Reads glTF and GLB: the scene's meshes and point sets, moved by their nodes (in f64), joined into one.
//!
//! Vertices that were split for texture coordinates or normals are joined again where their positions,
//! colours and other attributes are exactly equal. The first material's colour image is kept; other
//! materials, images, skins, morph targets and animations are left out.

use super::document::{Document, list};
use super::instances::{Instance, shown};
use super::primitive::{self, Primitive};
use super::scene::Scene;
use crate::content::Content;
use crate::error::Result;
use crate::faces::NO_VERTEX;
use crate::input::Input;
use serde_json::Value;

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let file = Document::read(input)?;
    let mut scene = Scene::default();
    for instance in shown(&file.json, input) {
        add_mesh(input, &file, &mut scene, &instance)?;
    }
    let texture = file.texture(input);
    let left_out = left_out(&file.json);
    Ok(Content { texture, left_out, ..scene.finish(input)? })
}

/// What a file holds that one mesh with one texture does not.
fn left_out(json: &Value) -> Vec<String> {
    let several = |key: &str, most: usize, what: &str| -> Option<String> {
        let count = list(json, key).len();
        (count > most).then(|| format!("{count} {what}"))
    };
    let meshes = list(json, "nodes").iter().filter(|n| n.get("mesh").is_some()).count();
    let morphs = list(json, "meshes").iter().flat_map(|m| list(m, "primitives"));
    let morphs = morphs.filter(|p| p.get("targets").is_some()).count();
    let counted = |count: usize, most: usize, what: &str| (count > most).then(|| format!("{count} {what}"));
    [
        several("materials", 1, "materials"),
        several("images", 1, "images"),
        several("animations", 0, "animations"),
        several("skins", 0, "skins"),
        several("cameras", 0, "cameras"),
        counted(meshes, 1, "nodes with meshes"),
        counted(morphs, 0, "meshes with morph targets"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Triangles that a primitive added.
pub(super) struct Added {
    /// Its number in the mesh.
    pub primitive: usize,
    /// How many there are, without those that name a vertex that is not there.
    pub triangles: usize,
}

/// Adds the primitives of a mesh; gives those that hold triangles.
pub(super) fn add_mesh(
    input: &mut Input<'_>,
    file: &Document<'_>,
    scene: &mut Scene,
    instance: &Instance,
) -> Result<Vec<Added>> {
    let Some(mesh) = list(&file.json, "meshes").get(instance.mesh) else {
        input.report.add("nodes that name a mesh that is not there", 1, None);
        return Ok(Vec::new());
    };
    let mut added = Vec::new();
    for (i, json) in list(mesh, "primitives").iter().enumerate() {
        if json["extensions"].get("KHR_draco_mesh_compression").is_some() {
            return Err(input.unsupported(
                "the meshes are compressed (KHR_draco_mesh_compression)",
                "Write the file again without compression",
            ));
        }
        let Some(primitive) = Primitive::of(json) else { continue };
        if !primitive.is_points_or_triangles() {
            input.report.add("sets of lines, whose points are kept", 1, None);
        }
        let from = scene.triangles.len();
        primitive::add(input, file, scene, &primitive, &instance.world)?;
        if primitive.is_triangles() {
            let right = |t: &&[u32; 3]| !t.contains(&NO_VERTEX);
            let triangles = scene.triangles[from..].iter().filter(right).count();
            added.push(Added { primitive: i, triangles });
        }
        if json.get("targets").is_some() {
            input.report.add("meshes with morph targets, read in their rest shape", 1, None);
        }
    }
    Ok(added)
}
