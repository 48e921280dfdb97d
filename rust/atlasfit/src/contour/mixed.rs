//! A voxel that touches finer ones, contoured.
//!
//! In: the signed distance at its corners and at those of the finer voxels on its border. Out: as for any
//! voxel ([`super::cells`]). Where finer voxels touch a face it is four faces, and where they touch an edge
//! it is two edges: all voxels that share one of these see the same (Ju et al. 2002, with one vertex for each
//! piece of surface as Schaefer, Ju and Warren 2007).

use super::cells::{Cells, Crossing, Edged, NONE, Place, VoxelEdge, pieces, slot};
use super::normals::Charts;
use crate::blend::blocks::{CornerId, Grid, corner_index};
use crate::blend::constants::BLOCK;

/// Places of a voxel at halves of its side: three by three by three.
const NODES: usize = 27;
/// Which of them is at `i`, each 0, 1 or 2.
const fn node(i: [i32; 3]) -> usize {
    (i[0] + 3 * i[1] + 9 * i[2]) as usize
}
/// Middles of edges between them: halves of the voxel's side are halved again.
const MIDDLES: usize = 125;

/// A voxel beside finer ones.
struct Mixed {
    place: Place,
    /// The finer blocks' corners at the nodes.
    finer: [CornerId; NODES],
    /// Signed distances at the nodes that matter.
    field: [f64; NODES],
}

/// Which of the voxels around one are finer.
struct Finer<'a> {
    around: &'a Around,
    at: [i32; 3],
}

impl Finer<'_> {
    /// The finer voxels in the place of the neighbour at `o`, each -1, 0 or 1.
    fn beside(&self, o: [i32; 3]) -> bool {
        let i = [0, 1, 2].map(|k| (self.at[k] + o[k]).div_euclid(2) + 1);
        self.around.contoured[(i[0] + 4 * i[1] + 16 * i[2]) as usize]
    }
    /// The corner of a finer block at a node.
    fn corner(&self, node: [i32; 3]) -> CornerId {
        let p = [0, 1, 2].map(|k| 2 * self.at[k] + node[k]);
        let i = p.map(|x| x / BLOCK + 1);
        let block = self.around.blocks[(i[0] + 4 * i[1] + 16 * i[2]) as usize];
        CornerId { block, corner: corner_index(p.map(|x| x % BLOCK)) }
    }
    /// Whether finer voxels touch the edge along an axis at `at`, each 0 or 2, on the axes after it.
    fn edge(&self, axis: usize, at: [i32; 2]) -> bool {
        let [du, dv] = at.map(|x| x - 1);
        [[du, 0], [0, dv], [du, dv]].iter().any(|&[u, v]| {
            let mut o = [0; 3];
            (o[(axis + 1) % 3], o[(axis + 2) % 3]) = (u, v);
            self.beside(o)
        })
    }
}

/// The finer blocks in and around one.
pub(super) struct Around {
    /// See [`Grid::finer`].
    blocks: [u32; 64],
    /// Whether each of them is contoured.
    contoured: [bool; 64],
}

impl Around {
    /// `None` where none of them is contoured.
    pub(super) fn of(grid: &Grid<'_>, block: usize) -> Option<Self> {
        let blocks = grid.finer(block)?;
        let contoured = blocks.map(|b| b != u32::MAX && grid.contoured[b as usize]);
        contoured.contains(&true).then_some(Self { blocks, contoured })
    }
}

/// Contours the voxel of `block` with lowest corner `at`, counted from the block's, if finer ones touch it.
/// Returns whether they do.
pub(super) fn contour(
    grid: &Grid<'_>,
    block: usize,
    at: [i32; 3],
    around: &Around,
    charts: &mut Charts,
    out: &mut Cells,
) -> bool {
    let finer = Finer { around, at };
    let offsets = (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
    if !offsets.into_iter().any(|o| o != [0; 3] && finer.beside(o)) {
        return false;
    }
    let faces = faces(&finer);
    if let Some(voxel) = Mixed::read(grid, block, &finer, &faces)
        && let Some(next) = voxel.links(&faces)
    {
        pieces(grid, &voxel, &next, charts, out);
    }
    true
}

/// The faces of the voxel: their nodes in cyclic order, from the lowest. Each is a face of the voxel, with a
/// node more on each edge that is two, or a quarter of one.
fn faces(finer: &Finer<'_>) -> Vec<Vec<[i32; 3]>> {
    let mut faces = Vec::with_capacity(24);
    for axis in 0..3 {
        let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
        for side in [0, 2] {
            let at = |[i, j]: [i32; 2]| {
                let mut node = [side; 3];
                (node[u], node[v]) = (i, j);
                node
            };
            let mut o = [0; 3];
            o[axis] = side - 1;
            if finer.beside(o) {
                for [i, j] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                    faces.push([[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(at).to_vec());
                }
                continue;
            }
            let ring = [[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]].map(at);
            let there = |node: &[i32; 3]| match [0, 1, 2].into_iter().find(|&k| k != axis && node[k] == 1) {
                None => true,
                Some(along) => finer.edge(along, [node[(along + 1) % 3], node[(along + 2) % 3]]),
            };
            faces.push(ring.into_iter().filter(there).collect());
        }
    }
    faces
}

/// The axis of an edge between two nodes, by its middle, and its ends.
fn ends(middle: usize) -> (usize, [[i32; 3]; 2]) {
    let m = [middle % 5, middle / 5 % 5, middle / 25].map(|x| x as i32);
    let half = (0..3).find(|&k| m[k] % 2 == 1);
    let axis = half.or_else(|| (0..3).find(|&k| m[k] == 2)).unwrap_or(0);
    let (mut low, mut high) = (m.map(|x| x / 2), m.map(|x| x / 2));
    low[axis] = (m[axis] - 1) / 2;
    high[axis] = m[axis] - low[axis];
    (axis, [low, high])
}

impl Edged for Mixed {
    fn place(&self) -> &Place {
        &self.place
    }
    fn edge(&self, edge: usize) -> VoxelEdge {
        let (_, ends) = ends(edge);
        VoxelEdge { ends, field: ends.map(|i| self.field[node(i)]) }
    }
    fn cross(&self, grid: &Grid<'_>, edge: usize, rises: bool, vertex: u32, out: &mut Vec<Crossing>) {
        let (axis, [low, high]) = ends(edge);
        let corner = if high[axis] - low[axis] == 2 {
            grid.owner(self.place.block, [0, 1, 2].map(|k| self.place.at[k] + low[k] / 2))
        } else {
            self.finer[node(low)]
        };
        if corner.block == u32::MAX {
            return;
        }
        // An edge in the middle of a face is one that the voxel stands at for two.
        let sides = |x: i32| if x == 1 { 0..2 } else { x / 2..x / 2 + 1 };
        for a in sides(low[(axis + 1) % 3]) {
            for b in sides(low[(axis + 2) % 3]) {
                out.push(Crossing::new(corner, axis, slot([a, b]), rises, vertex));
            }
        }
    }
}

impl Mixed {
    /// The voxel, where all nodes of its faces are known.
    fn read(grid: &Grid<'_>, block: usize, finer: &Finer<'_>, faces: &[Vec<[i32; 3]>]) -> Option<Self> {
        let at = finer.at;
        let none = CornerId { block: u32::MAX, corner: 0 };
        let mut voxel = Self { place: Place::new(block, at), finer: [none; NODES], field: [0.0; NODES] };
        let mut seen = [false; NODES];
        for &i in faces.iter().flatten() {
            let n = node(i);
            if std::mem::replace(&mut seen[n], true) {
                continue;
            }
            let mut corner = finer.corner(i);
            let mut value = grid.read(block, corner);
            if value.round == 0 && i.iter().all(|x| x % 2 == 0) {
                corner = grid.owner(block, [0, 1, 2].map(|k| at[k] + i[k] / 2));
                value = grid.read(block, corner);
            }
            if value.round == 0 {
                return None;
            }
            voxel.place.note(value.round, || grid.support_of(corner));
            voxel.field[n] = value.value;
            voxel.finer[n] = finer.corner(i);
        }
        Some(voxel)
    }

    /// For each crossed edge the two that follow it across its faces; `None` where none is crossed.
    fn links(&self, faces: &[Vec<[i32; 3]>]) -> Option<[[usize; 2]; MIDDLES]> {
        let mut next = [[NONE; 2]; MIDDLES];
        let mut any = false;
        for face in faces {
            let values: Vec<f64> = face.iter().map(|&i| self.field[node(i)]).collect();
            for (a, b) in pairs(&values) {
                any = true;
                let edge = |k: usize| middle(face[k], face[(k + 1) % face.len()]);
                for (p, q) in [(edge(a), edge(b)), (edge(b), edge(a))] {
                    let slot = usize::from(next[p][0] != NONE);
                    next[p][slot] = q;
                }
            }
        }
        any.then_some(next)
    }
}

/// The edge between two nodes.
fn middle(a: [i32; 3], b: [i32; 3]) -> usize {
    let m = [0, 1, 2].map(|k| a[k] + b[k]);
    (m[0] + 5 * m[1] + 25 * m[2]) as usize
}

/// Which crossings of a polygon's border are joined across it: pairs of edges, each numbered by the node that
/// it starts from. Where there are more than two, the nodes of one sign are joined and those of the other cut
/// off, as a bilinear saddle decides on four nodes (Nielson and Hamann 1991).
fn pairs(values: &[f64]) -> Vec<(usize, usize)> {
    let n = values.len();
    let crossed: Vec<usize> = (0..n).filter(|&k| (values[k] < 0.0) != (values[(k + 1) % n] < 0.0)).collect();
    let m = crossed.len();
    if m <= 2 {
        return crossed.chunks_exact(2).map(|c| (c[0], c[1])).collect();
    }
    // How far the nodes between two crossings lie from the surface: of both signs in turn, the first node's
    // among the last.
    let largest = |k: usize| {
        let (from, to) = (crossed[k], crossed[(k + 1) % m]);
        let to = if to > from { to } else { to + n };
        (from + 1..=to).map(|i| values[i % n].abs()).fold(0.0, f64::max)
    };
    let product = |first: usize| (first..m).step_by(2).map(largest).product::<f64>();
    let joined = product(1) > product(0);
    let first = usize::from(!joined);
    (first..m).step_by(2).map(|k| (crossed[k], crossed[(k + 1) % m])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    /// Finer blocks in some places in and around one.
    fn around(rng: &mut Rng) -> Around {
        let share = rng.uniform();
        Around { blocks: [0; 64], contoured: std::array::from_fn(|_| rng.uniform() < share) }
    }

    /// Every crossed edge has two neighbours that have it for theirs, whatever the signs and the finer
    /// neighbours: pieces are closed rings.
    #[test]
    fn the_crossed_edges_of_any_voxel_make_closed_rings() {
        let mut rng = Rng::new(1);
        for _ in 0..3000 {
            let around = around(&mut rng);
            let at = std::array::from_fn(|_| (4.0 * rng.uniform()) as i32);
            let faces = faces(&Finer { around: &around, at });
            let none = CornerId { block: 0, corner: 0 };
            let voxel = Mixed {
                place: Place::new(0, at),
                finer: [none; NODES],
                field: std::array::from_fn(|_| rng.normal()),
            };
            let Some(next) = voxel.links(&faces) else { continue };
            for (e, of) in next.iter().enumerate() {
                let [a, b] = ends(e).1.map(node);
                assert_eq!(of[0] == NONE, of[1] == NONE, "{e}");
                if of[0] != NONE {
                    assert!((voxel.field[a] < 0.0) != (voxel.field[b] < 0.0), "{e}");
                    assert!(of.iter().all(|&o| next[o].contains(&e)), "{e}");
                }
            }
        }
    }

    /// Two voxels see the face between them alike, whichever is finer.
    #[test]
    fn crossings_of_four_nodes_are_joined_as_on_any_voxel() {
        // Nodes 0 and 2 are joined where their product is the larger one: 1 and 3 are cut off.
        assert_eq!(pairs(&[2.0, -1.0, 2.0, -1.0]), [(0, 1), (2, 3)]);
        assert_eq!(pairs(&[1.0, -2.0, 1.0, -2.0]), [(1, 2), (3, 0)]);
        assert_eq!(pairs(&[-1.0, 2.0, -1.0, 2.0]), pairs(&[1.0, -2.0, 1.0, -2.0]));
        assert_eq!(pairs(&[1.0, 1.0, -1.0, -1.0]), [(1, 3)]);
        // A node more on an edge changes nothing where it has the sign of an end.
        assert_eq!(pairs(&[2.0, 1.0, -1.0, 2.0, -1.0]), [(1, 2), (3, 4)]);
    }

    #[test]
    fn an_edge_is_found_by_its_middle() {
        let nodes = || (0..27).map(|n| [n % 3, n / 3 % 3, n / 9]);
        for (a, b) in nodes().flat_map(|a| nodes().map(move |b| (a, b))) {
            let d: Vec<i32> = (0..3).map(|k| b[k] - a[k]).filter(|&d| d != 0).collect();
            let whole = d == [2] && a.iter().zip(&b).all(|(x, y)| x != y || x % 2 == 0);
            if d == [1] || whole {
                assert_eq!(ends(middle(a, b)).1, [a, b]);
            }
        }
    }
}
