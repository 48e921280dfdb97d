//! Where the meshes of a file stand.
//!
//! In: the JSON of a file, whose nodes form trees. Out: its meshes with the transforms of their nodes (in
//! f64): every instance of the scene that is shown, or each mesh of the file once.

use super::document::{list, number};
use super::matrix::{IDENTITY, Matrix, multiply, of_node, volume};
use crate::input::Input;
use serde_json::Value;

/// A mesh at its place.
pub(super) struct Instance {
    pub mesh: usize,
    pub world: Matrix,
}

/// The nodes met so far.
struct Walk<'v> {
    nodes: &'v [Value],
    visited: Vec<bool>,
    found: Vec<Instance>,
}

/// The numbers in a list.
fn numbers(value: &Value, key: &str) -> Vec<usize> {
    list(value, key).iter().filter_map(number).collect()
}

impl<'v> Walk<'v> {
    fn new(json: &'v Value) -> Self {
        let nodes = list(json, "nodes");
        Self { nodes, visited: vec![false; nodes.len()], found: Vec::new() }
    }

    /// Adds what hangs on these nodes.
    fn from(&mut self, roots: Vec<usize>, input: &mut Input<'_>) {
        let mut stack: Vec<(usize, Matrix)> = roots.into_iter().rev().map(|n| (n, IDENTITY)).collect();
        while let Some((id, parent)) = stack.pop() {
            let Some(node) = self.nodes.get(id) else { continue };
            // Nodes form a tree: one met twice is an error of the file, and might be a circle.
            if std::mem::replace(&mut self.visited[id], true) {
                input.report.add("nodes with two parents, used once", 1, Some(format!("node {id}")));
                continue;
            }
            let world = multiply(&parent, &of_node(node));
            if let Some(mesh) = number(&node["mesh"]) {
                self.found.push(Instance { mesh, world });
            }
            if node.get("skin").is_some() {
                input.report.add("skinned meshes, read in their rest pose", 1, None);
            }
            stack.extend(numbers(node, "children").into_iter().rev().map(|c| (c, world)));
        }
    }

    /// Nodes that are nobody's child.
    fn parentless(&self) -> Vec<usize> {
        let mut is_child = vec![false; self.nodes.len()];
        for c in self.nodes.iter().flat_map(|n| numbers(n, "children")) {
            is_child.get_mut(c).into_iter().for_each(|b| *b = true);
        }
        (0..self.nodes.len()).filter(|&i| !is_child[i]).collect()
    }

    /// Those of these nodes that were not met.
    fn new_of(&self, nodes: Vec<usize>) -> Vec<usize> {
        nodes.into_iter().filter(|&n| self.visited.get(n) == Some(&false)).collect()
    }
}

/// The meshes of all nodes of the scene that is shown.
pub(super) fn shown(json: &Value, input: &mut Input<'_>) -> Vec<Instance> {
    let mut walk = Walk::new(json);
    // A library of meshes without nodes is shown as it is.
    if walk.nodes.is_empty() {
        let meshes = 0..list(json, "meshes").len();
        return meshes.map(|mesh| Instance { mesh, world: IDENTITY }).collect();
    }
    let roots = match list(json, "scenes").get(number(&json["scene"]).unwrap_or(0)) {
        Some(s) => numbers(s, "nodes"),
        // Without a scene: every node that is nobody's child.
        None => walk.parentless(),
    };
    walk.from(roots, input);
    walk.found
}

/// Each mesh of the file once, in the order of its first instance: as large as its largest one is. Meshes
/// that the shown scene does not have come last.
pub(super) fn once(json: &Value, input: &mut Input<'_>) -> Vec<Instance> {
    let mut walk = Walk::new(json);
    let scenes = list(json, "scenes");
    for scene in scenes.get(number(&json["scene"]).unwrap_or(0)).into_iter().chain(scenes) {
        walk.from(walk.new_of(numbers(scene, "nodes")), input);
    }
    walk.from(walk.new_of(walk.parentless()), input);
    let mut largest: Vec<Option<usize>> = vec![None; list(json, "meshes").len()];
    let mut out: Vec<Instance> = Vec::new();
    for instance in walk.found {
        let Some(known) = largest.get_mut(instance.mesh) else {
            input.report.add("nodes that name a mesh that is not there", 1, None);
            continue;
        };
        // What an animation unfolds may have no size now.
        let size = |i: &Instance| volume(&i.world).abs();
        let has_size = size(&instance) > 0.0 && size(&instance).is_finite();
        let world = if has_size { instance.world } else { IDENTITY };
        let instance = Instance { world, ..instance };
        match *known {
            None => {
                *known = Some(out.len());
                out.push(instance);
            }
            Some(at) if has_size && size(&instance) > size(&out[at]) => out[at] = instance,
            Some(_) => {}
        }
    }
    let unused = (0..largest.len()).filter(|&mesh| largest[mesh].is_none());
    out.extend(unused.map(|mesh| Instance { mesh, world: IDENTITY }));
    out
}
