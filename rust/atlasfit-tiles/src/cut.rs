//! Space cut into tiles of about as many points.
//!
//! In: how many points lie in each cell of a grid that is known after one pass over the scan. Out: a binary
//! tree of planes, whose leaves are the tiles. Far-off points lie in some tile as any others do: a tile is as
//! large as it must be.

use crate::error::{Error, Result};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// Cells of the grid at the most; beyond, its cells are twice as wide.
const MOST_CELLS: usize = 200_000;
/// Cells along the longest side of the first points. They are small at first, as a point far away may be
/// among these, and grow until they are few enough.
const FIRST_CELLS: f64 = (1u64 << 40) as f64;
/// Cells from the origin to a place: more than numbers tell apart, less than cells can be counted.
const FAR_CELLS: f64 = (1u64 << 54) as f64;

/// How many points lie where.
#[derive(Default)]
pub(crate) struct Cells {
    /// Side of a cell; 0 before there are points.
    side: f64,
    counts: FxHashMap<[i64; 3], u64>,
}

impl Cells {
    /// Counts some points; those that are not finite are left out.
    pub fn add(&mut self, points: &[[f64; 3]]) {
        let finite = || points.iter().filter(|p| p.iter().all(|x| x.is_finite()));
        if self.side == 0.0 {
            if finite().next().is_none() {
                return;
            }
            let longest = (0..3).map(|k| {
                let [low, high] = finite().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
                    [low.min(p[k]), high.max(p[k])]
                });
                high - low
            });
            let longest = longest.fold(0.0, f64::max);
            let side = (longest / FIRST_CELLS).min(f64::MAX / FAR_CELLS);
            // A power of two: cells that grow keep their planes. Of points that all lie in one place no
            // length is known.
            self.side = if side > 0.0 { side.log2().ceil().exp2() } else { 1.0 / FIRST_CELLS };
        }
        for p in finite() {
            let farthest = p.iter().fold(0.0f64, |far, x| far.max(x.abs()));
            while farthest / self.side > FAR_CELLS {
                self.grow();
            }
            *self.counts.entry(p.map(|x| (x / self.side).floor() as i64)).or_default() += 1;
            while self.counts.len() > MOST_CELLS {
                self.grow();
            }
        }
    }

    /// Makes the cells twice as wide.
    fn grow(&mut self) {
        self.side *= 2.0;
        for (cell, n) in std::mem::take(&mut self.counts) {
            *self.counts.entry(cell.map(|x| x >> 1)).or_default() += n;
        }
    }

    /// Side of the cells.
    pub fn side(&self) -> f64 {
        self.side
    }

    /// The cells that hold points, with their number, in the order of their coordinates.
    pub fn sorted(&self) -> Vec<([i64; 3], u64)> {
        let mut cells: Vec<_> = self.counts.iter().map(|(c, n)| (*c, *n)).collect();
        cells.sort_unstable();
        cells
    }
}

/// A node of the tree: a plane, or a tile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Node {
    /// Below the plane, and from it on.
    Plane { axis: usize, at: f64, below: usize, above: usize },
    /// A tile.
    Tile { tile: u32 },
}

/// The tiles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Tree {
    nodes: Vec<Node>,
}

impl Tree {
    /// Cuts cells of this side into tiles of at most `most` points, as far as cells can be told apart.
    pub(crate) fn new(cells: &mut [([i64; 3], u64)], side: f64, most: u64) -> Result<Self> {
        let mut tree = Self { nodes: Vec::new() };
        let mut tiles = 0;
        tree.cut(cells, side, most, &mut tiles)?;
        Ok(tree)
    }

    fn cut(&mut self, cells: &mut [([i64; 3], u64)], side: f64, most: u64, tiles: &mut u32) -> Result<usize> {
        let here = self.nodes.len();
        self.nodes.push(Node::Tile { tile: *tiles });
        let points: u64 = cells.iter().map(|c| c.1).sum();
        let extent = |k: usize| {
            let of = || cells.iter().map(|c| c.0[k]);
            of().max().unwrap_or(0).saturating_sub(of().min().unwrap_or(0))
        };
        let axis = (0..3).max_by_key(|&k| (extent(k), k == 0)).unwrap_or(0);
        if points <= most || cells.len() < 2 {
            if *tiles >= MOST_TILES {
                return Err(Error::refused(
                    format!("the scan has more than {MOST_TILES} tiles"),
                    "Give larger tiles (--tile-points)",
                ));
            }
            *tiles += 1;
            return Ok(here);
        }
        cells.sort_unstable_by_key(|c| (c.0[axis], c.0));
        // The plane nearest to the middle of the points.
        let (mut before, mut best) = (0, (u64::MAX, 1));
        for i in 1..cells.len() {
            before += cells[i - 1].1;
            if cells[i].0[axis] != cells[i - 1].0[axis] {
                best = best.min((before.abs_diff(points - before), i));
            }
        }
        let (low, high) = cells.split_at_mut(best.1);
        let at = high[0].0[axis] as f64 * side;
        let below = self.cut(low, side, most, tiles)?;
        let above = self.cut(high, side, most, tiles)?;
        self.nodes[here] = Node::Plane { axis, at, below, above };
        Ok(here)
    }

    /// Tiles.
    #[must_use]
    pub fn tiles(&self) -> usize {
        self.nodes.iter().filter(|n| matches!(n, Node::Tile { .. })).count()
    }

    /// The tile that a place belongs to.
    #[must_use]
    pub fn of(&self, p: [f64; 3]) -> u32 {
        let mut at = 0;
        loop {
            match self.nodes[at] {
                Node::Tile { tile } => return tile,
                Node::Plane { axis, at: plane, below, above } => {
                    at = if p[axis] < plane { below } else { above };
                }
            }
        }
    }

    /// Calls `each` with every tile within `reach` of a place (in the largest of the three distances).
    pub fn near(&self, p: [f64; 3], reach: f64, mut each: impl FnMut(u32)) {
        let mut open = vec![0];
        while let Some(at) = open.pop() {
            match self.nodes[at] {
                Node::Tile { tile } => each(tile),
                Node::Plane { axis, at: plane, below, above } => {
                    if p[axis] >= plane - reach {
                        open.push(above);
                    }
                    if p[axis] < plane + reach {
                        open.push(below);
                    }
                }
            }
        }
    }
}

/// Tiles of a scan at the most.
const MOST_TILES: u32 = 1_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_of_one_tile_and_tiles_hold_about_as_many_points() {
        let points: Vec<[f64; 3]> =
            (0..10_000).map(|i| [f64::from(i % 100), f64::from(i / 100), f64::from(i % 7)]).collect();
        let mut cells = Cells::default();
        points.chunks(77).for_each(|c| cells.add(c));
        let tree = Tree::new(&mut cells.sorted(), cells.side(), 1500).unwrap();
        let mut count = vec![0; tree.tiles()];
        for p in &points {
            count[tree.of(*p) as usize] += 1;
            let mut near = Vec::new();
            tree.near(*p, 3.0, |t| near.push(t));
            assert!(near.contains(&tree.of(*p)));
        }
        assert!(count.iter().all(|n| (500..=1500).contains(n)), "{count:?}");
    }

    #[test]
    fn a_point_a_million_sides_away_makes_one_more_tile_at_the_most() {
        let mut points: Vec<[f64; 3]> =
            (0..10_000).map(|i| [f64::from(i % 100), f64::from(i / 100), 0.0]).collect();
        points.push([f64::NAN, 0.0, 0.0]);
        // Before the others or after them.
        for at in [0, 10_001] {
            points.insert(at, [1e8, 0.0, 0.0]);
            let mut cells = Cells::default();
            points.chunks(1000).for_each(|c| cells.add(c));
            let tree = Tree::new(&mut cells.sorted(), cells.side(), 3000).unwrap();
            assert!((4..=9).contains(&tree.tiles()), "{}", tree.tiles());
            points.remove(at);
        }
    }

    #[test]
    fn points_that_all_lie_in_one_place_at_first_count_too() {
        let mut cells = Cells::default();
        cells.add(&[[0.0; 3]; 5]);
        cells.add(&[[1e7, 2e7, 0.5], [1e7 + 1.0, 2e7, 0.5]]);
        let all: Vec<u64> = cells.sorted().iter().map(|c| c.1).collect();
        assert_eq!(all, [5, 1, 1]);
    }
}
