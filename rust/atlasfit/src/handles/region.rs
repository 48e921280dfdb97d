//! A part of a surface taken out, changed, and put back.
//!
//! In: a surface, some of its vertices. Out: the triangles about them as a surface of their own; what has
//! become of it in its place.

use super::constants::HANDLES;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::lists::Lists;

/// The edges of a surface, and the neighbours of each vertex.
pub(super) struct Mesh {
    pub edges: Edges,
    pub neighbours: Lists,
}

impl Mesh {
    pub fn new(s: &Surface, ctx: &Context<'_>) -> Result<Self> {
        let edges = Edges::new(&s.triangles, ctx)?;
        let neighbours = Lists::of_neighbours(s.positions.len(), &edges, ctx)?;
        Ok(Self { edges, neighbours })
    }
}

/// A part of a surface by itself.
pub(super) struct Region {
    /// Its vertices and triangles by their names in the surface, ascending.
    pub vertices: Vec<u32>,
    pub faces: Vec<u32>,
    pub part: Surface,
}

impl Region {
    /// The triangles about some vertices, and a few rings about these.
    pub fn about(s: &Surface, mesh: &Mesh, mut vertices: Vec<u32>, ctx: &Context<'_>) -> Result<Self> {
        let mut there = ctx.filled(false, s.positions.len())?;
        vertices.iter().for_each(|&v| there[v as usize] = true);
        for _ in 0..HANDLES.rings {
            let beside = vertices.iter().flat_map(|&v| mesh.neighbours.of(v));
            vertices =
                beside.copied().filter(|&v| !std::mem::replace(&mut there[v as usize], true)).collect();
        }
        let mut faces = Vec::new();
        for (f, t) in s.triangles.iter().enumerate() {
            ctx.check_at(f)?;
            if t.iter().any(|&v| there[v as usize]) {
                faces.push(f as u32);
            }
        }
        let mut vertices: Vec<u32> = faces.iter().flat_map(|&f| s.triangles[f as usize]).collect();
        sort(&mut vertices, ctx)?;
        vertices.dedup();
        let mut name = ctx.filled(0, s.positions.len())?;
        vertices.iter().zip(0..).for_each(|(&v, k)| name[v as usize] = k);
        let part = Surface {
            positions: vertices.iter().map(|&v| s.positions[v as usize]).collect(),
            normals: vertices.iter().map(|&v| s.normals[v as usize]).collect(),
            chart: vertices.iter().map(|&v| s.chart[v as usize]).collect(),
            triangles: faces.iter().map(|&f| s.triangles[f as usize].map(|v| name[v as usize])).collect(),
        };
        Ok(Self { vertices, faces, part })
    }
}

/// Puts a part back that was changed. Its first vertices and triangles are those of the surface with these
/// names, all others are new.
pub(super) fn put(s: &mut Surface, vertices: &[u32], faces: &[u32], part: &Surface) {
    let new = s.positions.len() as u32..;
    let names: Vec<u32> = vertices.iter().copied().chain(new).take(part.positions.len()).collect();
    for (k, &v) in vertices.iter().enumerate() {
        (s.positions[v as usize], s.normals[v as usize]) = (part.positions[k], part.normals[k]);
    }
    s.positions.extend(&part.positions[vertices.len()..]);
    s.normals.extend(&part.normals[vertices.len()..]);
    s.chart.extend(&part.chart[vertices.len()..]);
    let mut triangles = part.triangles.iter().map(|t| t.map(|v| names[v as usize]));
    faces.iter().zip(&mut triangles).for_each(|(&f, t)| s.triangles[f as usize] = t);
    s.triangles.extend(triangles);
}
