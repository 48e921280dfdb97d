//! One voxel contoured: dual marching cubes (Nielson 2004).
//!
//! In: the signed distance at the voxel's corners. Out: one vertex for each piece of surface in it, and for
//! each crossed edge of the voxel a record that says which vertex stands there. The quads are made of the
//! records ([`super::quads`]). Voxels that touch finer ones are in [`super::mixed`].

use super::constants::CONTOUR;
use super::normals::{Charts, heaviest, normal, normal_of_side, put_back};
use super::surface::ContourVertices;
use crate::blend::blocks::{CORNERS, CornerId, CornerValue, Grid, corner_offset};
use crate::blend::constants::BLEND;
use crate::numeric::vec3::Vec3;
use crate::spatial::quadric::Quadric;
use std::ops::Add;

/// The 12 edges of a voxel as corner pairs (low, high); edges 0-3 along x, 4-7 along y, 8-11 along z.
const EDGES: [(usize, usize); 12] =
    [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)];
/// The faces of a voxel: four corners in cyclic order.
const FACES: [[usize; 4]; 6] =
    [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
/// Stands for no edge.
pub(super) const NONE: usize = usize::MAX;
/// Edges of a voxel whose six faces touch finer ones.
pub(super) const MOST_EDGES: usize = 48;

/// A cell at an edge of the grid that the surface crosses. Sorted, the cells about an edge stand together in
/// cyclic order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Crossing {
    /// From high bits to low: the edge (block and index of its low corner, 2 bits for its axis), 2 bits for
    /// the cell's slot around it, 1 bit for whether the field rises along it.
    key: u64,
    /// The vertex in the cell.
    pub(super) vertex: u32,
}

impl Crossing {
    /// `low` is the edge's low corner, `slot` the cell's among those about the edge.
    pub(super) fn new(low: CornerId, axis: usize, slot: u8, rises: bool, vertex: u32) -> Self {
        let corner = u64::from(low.block) * CORNERS as u64 + low.corner as u64;
        let key = (corner << 2 | axis as u64) << 3 | u64::from(slot) << 1 | u64::from(rises);
        Self { key, vertex }
    }
    /// The same, its vertex counted from `base`.
    pub(super) fn counted_from(self, base: u32) -> Self {
        Self { vertex: self.vertex + base, ..self }
    }
    /// The edge of the grid.
    pub(super) fn edge(self) -> u64 {
        self.key >> 3
    }
    /// Which of the four cells about the edge this is.
    pub(super) fn slot(self) -> u64 {
        self.key >> 1 & 3
    }
    /// Whether the field rises along the edge.
    pub(super) fn rises(self) -> bool {
        self.key & 1 == 1
    }
}

/// What some voxels contribute to the surface.
#[derive(Default)]
pub(super) struct Cells {
    pub(super) vertices: ContourVertices,
    pub(super) crossings: Vec<Crossing>,
}

/// Where a voxel is, and what is known of all its corners.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) block: usize,
    /// Lowest corner, counted from the block's.
    pub(super) at: [i32; 3],
    /// Whether some corner was filled in.
    pub(super) filled: bool,
    /// Whether some corner was filled in though there are data: it lies too far from the charts.
    pub(super) off_band: bool,
}

impl Place {
    pub(super) fn new(block: usize, at: [i32; 3]) -> Self {
        Self { block, at, filled: false, off_band: false }
    }
    /// Takes note of a corner.
    #[inline]
    pub(super) fn note(&mut self, round: u8, support: impl FnOnce() -> f64) {
        self.filled |= round > 1;
        self.off_band |= round > 1 && support() >= BLEND.min_support;
    }
}

/// An edge of a voxel.
pub(super) struct VoxelEdge {
    /// Its low end and its high end, in halves of the voxel's side from its lowest corner.
    pub(super) ends: [[i32; 3]; 2],
    /// The signed distance there.
    pub(super) field: [f64; 2],
}

/// A voxel with its edges numbered: it may be one that touches finer ones.
pub(super) trait Edged {
    fn place(&self) -> &Place;
    fn edge(&self, edge: usize) -> VoxelEdge;
    /// Records that a vertex stands at an edge.
    fn cross(&self, grid: &Grid<'_>, edge: usize, rises: bool, vertex: u32, out: &mut Vec<Crossing>);
}

/// The field at a voxel's corners.
struct Voxel {
    place: Place,
    /// Signed distances.
    field: [f64; 8],
}

impl Edged for Voxel {
    fn place(&self) -> &Place {
        &self.place
    }
    #[inline]
    fn edge(&self, edge: usize) -> VoxelEdge {
        let (a, b) = EDGES[edge];
        VoxelEdge {
            ends: [a, b].map(|c| corner_offset(c).map(|x| 2 * x)),
            field: [self.field[a], self.field[b]],
        }
    }
    #[inline]
    fn cross(&self, grid: &Grid<'_>, edge: usize, rises: bool, vertex: u32, out: &mut Vec<Crossing>) {
        let (axis, low) = (edge / 4, EDGES[edge].0);
        let o = corner_offset(low);
        let slot = slot([o[(axis + 1) % 3], o[(axis + 2) % 3]]);
        out.push(Crossing::new(grid.owner(self.place.block, self.corner(low)), axis, slot, rises, vertex));
    }
}

impl Voxel {
    /// The voxel, where all its corners are known and the surface crosses it.
    #[inline]
    fn read(grid: &Grid<'_>, block: usize, at: [i32; 3]) -> Option<Self> {
        let mut voxel = Self { place: Place::new(block, at), field: [0.0; 8] };
        for c in 0..8 {
            let i = voxel.corner(c);
            let CornerValue { value, round, .. } = grid.fetch(block, i);
            if round == 0 {
                return None;
            }
            voxel.place.note(round, || grid.support(block, i));
            voxel.field[c] = value;
        }
        let inside = (0..8).filter(|&c| voxel.inside(c)).count();
        (inside != 0 && inside != 8).then_some(voxel)
    }
    /// A corner, counted from the block's lowest.
    #[inline]
    fn corner(&self, c: usize) -> [i32; 3] {
        let o = corner_offset(c);
        [0, 1, 2].map(|k| self.place.at[k] + o[k])
    }
    #[inline]
    fn inside(&self, c: usize) -> bool {
        self.field[c] < 0.0
    }
    /// Pairs up the crossed edges face by face: for each edge the two that follow it across its faces. A face
    /// with four crossings is decided by the bilinear saddle, which does not depend on the gauge and is the
    /// same for both voxels that share the face (Nielson and Hamann 1991).
    fn links(&self) -> [[usize; 2]; 12] {
        let mut next = [[NONE; 2]; 12];
        let mut link = |a: usize, b: usize| {
            for (p, q) in [(a, b), (b, a)] {
                let slot = usize::from(next[p][0] != NONE);
                next[p][slot] = q;
            }
        };
        for face in FACES {
            let mut crossed = (0..4).filter(|&k| self.inside(face[k]) != self.inside(face[(k + 1) % 4]));
            let e = |k: usize| edge_between(face[k], face[(k + 1) % 4]);
            let (Some(a), Some(b)) = (crossed.next(), crossed.next()) else { continue };
            if crossed.next().is_none() {
                link(e(a), e(b));
                continue;
            }
            let f = &self.field;
            let saddle = f[face[0]] * f[face[2]] - f[face[1]] * f[face[3]];
            // Positive: corners 0 and 2 are joined through the face, so 1 and 3 are cut off.
            let first = if saddle > 0.0 { 0 } else { 3 };
            for k in [first, (first + 2) % 4] {
                link(e(k), e((k + 1) % 4));
            }
        }
        next
    }
}

/// The edge between two neighbouring corners.
fn edge_between(a: usize, b: usize) -> usize {
    let (lo, hi) = (a.min(b), a.max(b));
    EDGES.iter().position(|&e| e == (lo, hi)).unwrap_or(0)
}

/// Which of the four cells around an edge a cell is: they stand in cyclic order about the edge's direction.
/// The edge lies at `offset` inside the cell, each 0 or 1, along the axes after its own, so that the cell
/// lies at minus that from the edge.
#[inline]
pub(super) fn slot(offset: [i32; 2]) -> u8 {
    match offset {
        [1, 1] => 0,
        [0, 1] => 1,
        [0, 0] => 2,
        _ => 3,
    }
}

/// Contours the voxel of `block` with lowest corner `at`, counted from the block's. `charts` is working
/// memory.
pub(super) fn contour(grid: &Grid<'_>, block: usize, at: [i32; 3], charts: &mut Charts, out: &mut Cells) {
    let Some(voxel) = Voxel::read(grid, block, at) else { return };
    pieces(grid, &voxel, &voxel.links(), charts, out);
}

/// Makes every piece of surface in a voxel. `next` says for each edge which two follow it; [`NONE`] where it
/// is not crossed.
pub(super) fn pieces<const N: usize>(
    grid: &Grid<'_>,
    voxel: &impl Edged,
    next: &[[usize; 2]; N],
    charts: &mut Charts,
    out: &mut Cells,
) {
    let mut done = [false; N];
    for start in 0..N {
        if !done[start] && !next[start].contains(&NONE) {
            piece(grid, voxel, next, start, &mut done, charts, out);
        }
    }
}

/// One piece of surface in a voxel: follows its crossed edges round from `start`, marks them as done, and
/// puts a vertex where the tangent planes there meet (dual contouring: Ju et al. 2002), or in their middle if
/// that is too far off. Nothing where all of the edges lie between two sheets.
fn piece(
    grid: &Grid<'_>,
    voxel: &impl Edged,
    next: &[[usize; 2]],
    start: usize,
    done: &mut [bool],
    charts: &mut Charts,
    out: &mut Cells,
) {
    let &Place { block, at, filled, off_band } = voxel.place();
    let h = grid.side(block);
    let origin = grid.origin(block);
    // In halves of the voxel's side, from its lowest corner.
    let position =
        |i: [i32; 3]| Vec3::from_fn(|k| (f64::from(origin[k] + at[k]) + 0.5 * f64::from(i[k])) * h);
    let jump = if filled { BLEND.fill_jump } else { CONTOUR.max_jump };
    let vertex = out.vertices.positions.len() as u32;
    let before = out.crossings.len();
    let (mut crossed, mut e, mut from) = (Places::default(), start, NONE);
    loop {
        done[e] = true;
        let VoxelEdge { ends: [a, b], field: [f, g] } = voxel.edge(e);
        let t = (f / (f - g)).clamp(CONTOUR.end_margin, 1.0 - CONTOUR.end_margin);
        let (low, high) = (position(a), position(b));
        crossed.add(low + (high - low) * t);
        let length = 0.5 * f64::from((0..3).map(|k| b[k] - a[k]).sum::<i32>()) * h;
        if (f - g).abs() <= jump * length {
            voxel.cross(grid, e, g > f, vertex, &mut out.crossings);
        }
        let [p, q] = next[e];
        let to = if p != from { p } else { q };
        from = e;
        e = to;
        if e == start {
            break;
        }
    }
    if out.crossings.len() == before {
        return;
    }
    let middle = crossed.mean();
    let mut plane = |p: Vec3| {
        let normal = normal_of_side(charts.at(grid, block, p));
        Quadric::of_plane(p - middle, normal.0, normal.norm2())
    };
    let planes = crossed.iter().map(&mut plane).fold(Quadric::default(), Add::add);
    let meet = middle + planes.least(Vec3::ZERO, CONTOUR.undecided);
    let off = (meet - position([0; 3])) * (1.0 / h);
    let near = off.iter().all(|x| (-CONTOUR.beyond..=1.0 + CONTOUR.beyond).contains(x));
    let place = if near { meet } else { middle };
    let charts = charts.at(grid, block, place);
    let (normal, chart) = (normal(charts), heaviest(charts).map_or(u32::MAX, |c| c.index));
    let back = put_back(charts);
    let support = if off_band { CONTOUR.off_band } else { grid.support_at(block, at, place) };
    let out = &mut out.vertices;
    out.positions.push(place + back);
    out.normals.push(normal);
    out.chart.push(chart);
    out.filled.push(filled);
    out.support.push(support);
}

/// The places where a piece of surface crosses the edges of its voxel.
struct Places {
    /// At most one on each edge of a voxel that touches finer ones.
    places: [Vec3; MOST_EDGES],
    count: usize,
}

impl Default for Places {
    fn default() -> Self {
        Self { places: [Vec3::ZERO; MOST_EDGES], count: 0 }
    }
}

impl Places {
    fn add(&mut self, place: Vec3) {
        self.places[self.count] = place;
        self.count += 1;
    }
    fn iter(&self) -> impl Iterator<Item = Vec3> {
        self.places[..self.count].iter().copied()
    }
    fn mean(&self) -> Vec3 {
        self.iter().fold(Vec3::ZERO, |sum, p| sum + p) * (1.0 / self.count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn voxel(field: [f64; 8]) -> Voxel {
        Voxel { place: Place::new(0, [0; 3]), field }
    }

    /// Every crossed edge has two neighbours that have it for theirs, whatever the signs: pieces are closed
    /// rings.
    #[test]
    fn the_crossed_edges_of_any_voxel_make_closed_rings() {
        for signs in 0..256u32 {
            let v =
                voxel(std::array::from_fn(|c| if signs >> c & 1 == 1 { -0.3 } else { 0.5 + 0.1 * c as f64 }));
            let next = v.links();
            for (e, (a, b)) in EDGES.iter().enumerate() {
                if v.inside(*a) == v.inside(*b) {
                    assert_eq!(next[e], [NONE; 2], "{signs:08b}: edge {e}");
                } else {
                    assert!(next[e].iter().all(|&o| next[o].contains(&e)), "{signs:08b}: edge {e}");
                }
            }
        }
    }

    #[test]
    fn the_four_cells_about_an_edge_have_four_slots() {
        let mut slots = [[0, 0], [0, 1], [1, 0], [1, 1]].map(slot);
        slots.sort_unstable();
        assert_eq!(slots, [0, 1, 2, 3]);
    }
}
