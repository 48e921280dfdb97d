//! Constraints on the charts: from text files groups of faces and edges that become seams, from an attribute
//! the price of seams.

use crate::console::Usage;
use anyhow::{Context as _, Result};
use atlasfit::geometry::{Attribute, TriMesh};
use std::path::Path;

/// A whole number of a text file, and the line it stands on.
struct Number {
    line: usize,
    value: u32,
}

/// Whole numbers from a text file, parted by spaces or commas.
fn numbers(path: &Path) -> Result<Vec<Number>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut out = Vec::new();
    for (i, line) in text.lines().enumerate() {
        for word in line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()) {
            let value = word.parse::<u32>().map_err(|_| {
                Usage(format!("{} line {}: \"{word}\" is no whole number from 0", path.display(), i + 1))
            })?;
            out.push(Number { line: i + 1, value });
        }
    }
    Ok(out)
}

/// The price of seams at each vertex, from an attribute.
pub fn prices(name: &str, mesh: &TriMesh) -> Result<Vec<f32>> {
    let attribute = Attribute::named(&mesh.attributes, name).filter(|a| a.width == 1).ok_or_else(|| {
        let named: Vec<&str> = mesh.attributes.iter().map(|a| a.name.as_str()).collect();
        let known = if named.is_empty() { "none".into() } else { named.join(", ") };
        Usage(format!("the mesh has no attribute \"{name}\" of one number per vertex. It has: {known}"))
    })?;
    Ok(attribute.values.iter().map(|&x| x as f32).collect())
}

/// Groups of the triangles, from a file with one number per face.
pub fn groups(path: &Path, mesh: &TriMesh, polygon: Option<&[u32]>) -> Result<Vec<u32>> {
    let of_face: Vec<u32> = numbers(path)?.into_iter().map(|n| n.value).collect();
    let faces = polygon.map_or(mesh.triangles.len(), |p| p.last().map_or(0, |&l| l as usize + 1));
    if of_face.len() != faces {
        return Err(Usage(format!(
            "{} holds {} numbers for {faces} faces. Give one per face",
            path.display(),
            of_face.len()
        ))
        .into());
    }
    Ok(match polygon {
        Some(polygon) => polygon.iter().map(|&p| of_face[p as usize]).collect(),
        None => of_face,
    })
}

/// Pairs of vertices, from a file with two numbers per line.
pub fn seams(path: &Path, mesh: &TriMesh) -> Result<Vec<[u32; 2]>> {
    let all = numbers(path)?;
    let mut out = Vec::new();
    for pair in all.chunks(2) {
        let wrong = |what: &str| Usage(format!("{} line {}: {what}", path.display(), pair[0].line));
        let [a, b] = pair else { return Err(wrong("one number, give two per line").into()) };
        if a.line != b.line {
            return Err(wrong("give two numbers per line").into());
        }
        if a.value.max(b.value) as usize >= mesh.positions.len() {
            return Err(wrong(&format!("there are only {} vertices", mesh.positions.len())).into());
        }
        out.push([a.value, b.value]);
    }
    Ok(out)
}
