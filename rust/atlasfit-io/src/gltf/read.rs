//! Reads glTF and GLB: the scene's meshes and point sets, moved by their nodes (in f64), joined into one.
//!
//! Vertices that were split for texture coordinates or normals are joined again where their positions,
//! colours and other attributes are exactly equal. The first material's colour image is kept; other
//! materials, images, skins, morph targets and animations are left out.

use super::document::{Document, list, number};
use super::matrix::{IDENTITY, Matrix, multiply, of_node};
use super::primitive::{self, Primitive};
use super::scene::Scene;
use crate::content::Content;
use crate::error::Result;
use crate::input::Input;
use serde_json::Value;

pub(crate) fn read(input: &mut Input<'_>) -> Result<Content> {
    let file = Document::read(input)?;
    let mut scene = Scene::default();
    walk(input, &file, &mut scene)?;
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

/// Adds the meshes of all nodes of the scene.
fn walk(input: &mut Input<'_>, file: &Document<'_>, scene: &mut Scene) -> Result<()> {
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
        let world = multiply(&parent, &of_node(node));
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

/// Adds the primitives of a mesh.
fn add_mesh(
    input: &mut Input<'_>,
    file: &Document<'_>,
    scene: &mut Scene,
    mesh: usize,
    world: &Matrix,
) -> Result<()> {
    let Some(mesh) = list(&file.json, "meshes").get(mesh) else {
        input.report.add("nodes that name a mesh that is not there", 1, None);
        return Ok(());
    };
    for json in list(mesh, "primitives") {
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
        primitive::add(input, file, scene, &primitive, world)?;
        if json.get("targets").is_some() {
            input.report.add("meshes with morph targets, read in their rest shape", 1, None);
        }
    }
    Ok(())
}
