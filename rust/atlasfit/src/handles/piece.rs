//! A piece of a surface about a place.
//!
//! In: a surface, a vertex, a radius. Out: the triangles about what lies within, with vertices of its own
//! names, its edges, its boundary rings and its handles.

use crate::contour::surface::Surface;
use crate::numeric::vec3::Vec3;
use crate::spatial::lists::Lists;
use rustc_hash::{FxHashMap, FxHashSet};

/// An edge of a piece.
pub(super) struct Edge {
    /// Its vertices.
    pub ends: [u32; 2],
    /// The triangles beside it; a ring is one more, after all triangles.
    pub beside: [u32; 2],
}

/// A connected piece of an oriented surface.
pub(super) struct Piece {
    /// Its vertices by their names in the surface, ascending.
    pub vertices: Vec<u32>,
    /// Their places.
    pub positions: Vec<Vec3>,
    /// Its triangles by their names in the surface, ascending.
    pub faces: Vec<u32>,
    /// Their corners, by their places in `vertices`.
    pub corners: Vec<[u32; 3]>,
    /// Its edges.
    pub edges: Vec<Edge>,
    /// Whether each vertex lies on a boundary.
    pub on_ring: Vec<bool>,
    /// Number of boundaries.
    pub rings: usize,
    /// Number of handles.
    pub handles: usize,
}

/// The vertices within a radius about one that hang together with it.
pub(super) fn ball(s: &Surface, neighbours: &Lists, v: u32, radius: f64) -> Vec<u32> {
    let at = s.positions[v as usize];
    let mut seen = FxHashSet::from_iter([v]);
    let mut inside = vec![v];
    let mut next = 0;
    while let Some(&v) = inside.get(next) {
        next += 1;
        for &w in neighbours.of(v) {
            if s.positions[w as usize].dist2(at) < radius * radius && seen.insert(w) {
                inside.push(w);
            }
        }
    }
    inside
}

impl Piece {
    /// The triangles about some vertices that hang together. None where a boundary comes to a vertex twice,
    /// or neighbours face opposite ways.
    pub fn about(s: &Surface, around: &Lists, inside: &[u32]) -> Option<Self> {
        let mut faces: Vec<u32> = inside.iter().flat_map(|&v| around.of(v)).copied().collect();
        faces.sort_unstable();
        faces.dedup();
        let mut vertices: Vec<u32> = faces.iter().flat_map(|&f| s.triangles[f as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let names: FxHashMap<u32, u32> = vertices.iter().copied().zip(0..).collect();
        let corners: Vec<[u32; 3]> =
            faces.iter().map(|&f| s.triangles[f as usize].map(|v| names[&v])).collect();
        let halves = Halves::new(vertices.len(), &corners)?;
        let beyond = |a: u32, b: u32| halves.of(b).iter().find(|h| h.1 == a).map(|h| h.2);
        let mut after = vec![u32::MAX; vertices.len()];
        for &(a, b, _) in halves.list.iter().filter(|h| beyond(h.0, h.1).is_none()) {
            if after[a as usize] != u32::MAX {
                return None;
            }
            after[a as usize] = b;
        }
        let (ring, rings) = rings(&after)?;
        let edge = |&(a, b, f): &(u32, u32, u32)| {
            let other = beyond(a, b).unwrap_or_else(|| faces.len() as u32 + ring[a as usize]);
            // An edge inside is met twice.
            (a < b || other >= faces.len() as u32).then_some(Edge { ends: [a, b], beside: [f, other] })
        };
        let edges: Vec<Edge> = halves.list.iter().filter_map(edge).collect();
        // Were each boundary closed by a disk, the Euler characteristic would be two, less two a handle.
        let handles = (2 + edges.len()).checked_sub(vertices.len() + faces.len() + rings)? / 2;
        let positions = vertices.iter().map(|&v| s.positions[v as usize]).collect();
        let on_ring = after.iter().map(|&w| w != u32::MAX).collect();
        Some(Self { vertices, positions, faces, corners, edges, on_ring, rings, handles })
    }
    /// Distance of two of its vertices.
    pub fn distance(&self, a: u32, b: u32) -> f64 {
        self.positions[a as usize].dist2(self.positions[b as usize]).sqrt()
    }
}

/// Sides of triangles: where they begin and end, and the triangle; ascending.
struct Halves {
    list: Vec<(u32, u32, u32)>,
    /// Where those of each vertex begin.
    start: Vec<u32>,
}

impl Halves {
    /// None where two run alike.
    fn new(vertices: usize, corners: &[[u32; 3]]) -> Option<Self> {
        let mut start = vec![0; vertices + 1];
        corners.as_flattened().iter().for_each(|&v| start[v as usize + 1] += 1);
        (0..vertices).for_each(|v| start[v + 1] += start[v]);
        let mut next = start.clone();
        let mut list = vec![(0, 0, 0); 3 * corners.len()];
        for (&[a, b, c], f) in corners.iter().zip(0..) {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let place = &mut next[from as usize];
                list[*place as usize] = (from, to, f);
                *place += 1;
            }
        }
        for v in 0..vertices {
            list[start[v] as usize..start[v + 1] as usize].sort_unstable();
        }
        let alike = list.windows(2).any(|h| (h[0].0, h[0].1) == (h[1].0, h[1].1));
        (!alike).then_some(Self { list, start })
    }
    /// Those that begin at a vertex.
    fn of(&self, v: u32) -> &[(u32, u32, u32)] {
        &self.list[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }
}

/// The ring of each vertex, and how many there are, from the vertex that comes after each on its ring. None
/// where they do not close.
fn rings(after: &[u32]) -> Option<(Vec<u32>, usize)> {
    let mut ring = vec![u32::MAX; after.len()];
    let mut count = 0;
    for start in 0..after.len() as u32 {
        if after[start as usize] == u32::MAX || ring[start as usize] != u32::MAX {
            continue;
        }
        let mut v = start;
        loop {
            ring[v as usize] = count;
            v = after[v as usize];
            if v == start {
                break;
            }
            if v == u32::MAX || ring[v as usize] != u32::MAX {
                return None;
            }
        }
        count += 1;
    }
    Some((ring, count as usize))
}
