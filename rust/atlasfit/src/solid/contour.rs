//! The solid's surface in tetrahedra (marching tetrahedra).
//!
//! In: tetrahedra that are partly inside. Out: triangles, one or two in each. Every tetrahedron holds its
//! own, and none overlap, so nothing meets; edges of the lattice have two different ends, so every vertex
//! stands apart: the surface is closed and two-manifold whatever the field is.

use super::constants::SOLID;
use super::field::Sample;
use super::grow::Grown;
use super::mesh::Exit;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::faces::Faces;
use rayon::prelude::*;

/// A vertex of the solid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub(super) position: Vec3,
    /// The triangle of the surface that it lies on; none where it was invented.
    pub(super) on: Option<u32>,
}

/// The solid's surface.
pub(super) struct Contour {
    pub(super) vertices: Vec<Vertex>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// An edge of the lattice from its inner end to its outer one, as entries of the samples.
type LatticeEdge = [u32; 2];

/// What a tetrahedron holds: the crossed edges round a triangle or a quadrilateral, seen from outside
/// counter-clockwise.
enum Piece {
    Triangle([LatticeEdge; 3]),
    Quad([LatticeEdge; 4]),
}

/// Even permutations that bring one corner to the front.
const ONE: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
/// Even permutations that bring two corners to the front.
const TWO: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];

/// Contours the tetrahedra.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn contour(grown: &Grown, faces: &Faces<'_>, ctx: &Context<'_>) -> Result<Contour> {
    let mut edges: Vec<LatticeEdge> = Vec::new();
    for (i, tet) in grown.tets.iter().enumerate() {
        ctx.check_at(i)?;
        match piece(tet, &grown.samples) {
            Piece::Triangle(e) => edges.extend(e),
            Piece::Quad(e) => edges.extend(e),
        }
    }
    sort(&mut edges, ctx)?;
    edges.dedup();
    let vertices = edges
        .par_chunks(SOLID.check)
        .map(|chunk| {
            ctx.check()?;
            Ok(chunk.iter().map(|e| vertex(*e, &grown.samples, faces)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    let number = |e: &LatticeEdge| edges.binary_search(e).unwrap_or(0) as u32;
    let position = |v: u32| vertices[v as usize].position;
    let mut triangles = Vec::new();
    for (i, tet) in grown.tets.iter().enumerate() {
        ctx.check_at(16 * i)?;
        match piece(tet, &grown.samples) {
            Piece::Triangle(e) => triangles.push(e.each_ref().map(number)),
            Piece::Quad(e) => {
                let [a, b, c, d] = e.each_ref().map(number);
                // Along the shorter diagonal.
                if position(a).dist2(position(c)) <= position(b).dist2(position(d)) {
                    triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    triangles.extend([[b, c, d], [b, d, a]]);
                }
            }
        }
    }
    Ok(Contour { vertices, triangles })
}

/// What a tetrahedron that is partly inside holds.
fn piece(tet: &[u32; 4], samples: &[Sample]) -> Piece {
    let inside = tet.map(|v| samples[v as usize].inside());
    let count = inside.iter().filter(|i| **i).count();
    if count == 2 {
        let found = TWO.iter().find(|p| inside[p[0]] && inside[p[1]]);
        let [i, j, k, l] = found.unwrap_or(&TWO[0]).map(|c| tet[c]);
        return Piece::Quad([[i, k], [i, l], [j, l], [j, k]]);
    }
    let alone = ONE.iter().find(|p| inside[p[0]] == (count == 1));
    let [i, j, k, l] = alone.unwrap_or(&ONE[0]).map(|c| tet[c]);
    if count == 1 {
        Piece::Triangle([[i, j], [i, k], [i, l]])
    } else {
        Piece::Triangle([[j, i], [l, i], [k, i]])
    }
}

/// Where the solid's surface crosses an edge: on the surface if that crosses there, else by interpolation.
fn vertex(edge: LatticeEdge, samples: &[Sample], faces: &Faces<'_>) -> Vertex {
    let [inner, outer] = edge.map(|v| samples[v as usize]);
    let way = outer.position - inner.position;
    if let Some(Exit { triangle, share }) = faces.exit(inner.position, outer.position) {
        let share = share.clamp(SOLID.exit_margin, 1.0 - SOLID.exit_margin);
        return Vertex { position: inner.position + way * share, on: Some(triangle) };
    }
    let share = inner.value / (inner.value - outer.value);
    let share = share.clamp(SOLID.end_margin, 1.0 - SOLID.end_margin);
    Vertex { position: inner.position + way * share, on: None }
}
