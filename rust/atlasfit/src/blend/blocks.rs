//! The grid that the blended signed distance is kept on: blocks of voxels along the surface.
//!
//! Data and look-ups only: [`super::field`] makes the blocks, [`super::fill`] extends them. Blocks of a level
//! have voxels twice as wide as those of the level before; [`super::levels`] says which level is where. Each
//! block has its own gauge, that is its own choice of which side of the surface is positive, so one-sided
//! surfaces need no special care. Who reads across the border of a block gets the value in the reader's
//! gauge.

use super::constants::{BLEND, BLOCK};
use crate::atlas::Chart;
use crate::numeric::vec3::Vec3;

/// Corners that a block owns.
pub(crate) const CORNERS: usize = (BLOCK as usize).pow(3);
/// Bits of a key for each axis.
const AXIS_BITS: u32 = 20;
/// Blocks from the origin that a key can name.
const KEY_OFFSET: i64 = 1 << (AXIS_BITS - 1);
/// Levels that a key can name.
pub(super) const LEVELS: usize = 1 << (64 - 3 * AXIS_BITS);

/// Marks the round of a corner that charts know, but farther from them than its block's voxels believe:
/// coarser ones beside them do.
pub(super) const BEYOND: u8 = 0x80;

/// The key of the block at `b` of a level. Keys are ordered by level, then z, then y, then x.
#[inline]
pub(super) fn block_key(level: usize, b: [i32; 3]) -> u64 {
    let f = |x: i32| (i64::from(x) + KEY_OFFSET) as u64 & ((1 << AXIS_BITS) - 1);
    (level as u64) << (3 * AXIS_BITS) | f(b[2]) << (2 * AXIS_BITS) | f(b[1]) << AXIS_BITS | f(b[0])
}

/// The position of the block with a key, in blocks of its level.
#[inline]
pub(super) fn block_of_key(k: u64) -> [i32; 3] {
    let f = |axis: u32| ((k >> (axis * AXIS_BITS) & ((1 << AXIS_BITS) - 1)) as i64 - KEY_OFFSET) as i32;
    [f(0), f(1), f(2)]
}

/// The level of the block with a key.
#[inline]
pub(super) fn level_of_key(k: u64) -> usize {
    (k >> (3 * AXIS_BITS)) as usize
}

/// The index of a block among ascending keys; `u32::MAX` where it is not one of them.
pub(super) fn find(keys: &[u64], level: usize, b: [i32; 3]) -> u32 {
    keys.binary_search(&block_key(level, b)).map_or(u32::MAX, |i| i as u32)
}

/// Side of a voxel of a level, where it is `h` at the finest.
#[inline]
pub(super) fn side(h: f64, level: usize) -> f64 {
    h * f64::from(1u32 << level)
}

/// Whether voxels of size `h` at `p` can be named.
#[must_use]
pub(crate) fn within_range(p: Vec3, h: f64) -> bool {
    p.iter().all(|x| x.abs() < BLEND.range * h)
}

/// Index of the corner at `i`, each in 0..[`BLOCK`], among those of its block.
#[inline]
pub(crate) fn corner_index(i: [i32; 3]) -> usize {
    ((i[2] * BLOCK + i[1]) * BLOCK + i[0]) as usize
}

/// Where the corner with an index lies in its block, in voxels.
#[inline]
pub(crate) fn corner_at(index: usize) -> [i32; 3] {
    let k = index as i32;
    [k % BLOCK, k / BLOCK % BLOCK, k / BLOCK / BLOCK]
}

/// Offsets of a voxel's eight corners from its lowest: bit 0 is x, bit 1 y, bit 2 z.
#[inline]
pub(crate) const fn corner_offset(c: usize) -> [i32; 3] {
    [(c & 1) as i32, (c >> 1 & 1) as i32, (c >> 2 & 1) as i32]
}

/// The band of voxels: blocks of corner values, each in its own gauge.
pub(crate) struct Grid<'c> {
    /// The charts that are blended.
    pub(super) charts: &'c [Chart],
    /// Side of the finest voxels.
    pub(super) h: f64,
    /// Pairs of a block and a point that influences it: a measure of the work that the grid is.
    pub(crate) pairs: usize,
    /// Level and position of each block, as a key; ascending.
    pub(super) keys: Vec<u64>,
    /// Whether the voxels of each block are contoured; the others lend their corners to finer blocks beside
    /// coarser ones.
    pub(crate) contoured: Vec<bool>,
    /// Where the charts of each block start, one more than there are blocks.
    pub(super) start: Vec<u32>,
    /// The charts of each block, ascending.
    pub(super) lists: Vec<u32>,
    /// Whether each chart of `lists` faces the other way in the block's gauge.
    pub(super) turned: Vec<bool>,
    /// Whether the block's gauge may differ from the charts' global signs.
    pub(super) own_gauge: Vec<bool>,
    /// Indices of the 27 blocks of its level around each block, itself in the middle; `u32::MAX` where there
    /// is none.
    pub(super) around: Vec<[u32; 27]>,
    /// The corner values of each block.
    pub(super) corners: Vec<Corners>,
}

/// The corner values of one block.
#[derive(Clone)]
pub(super) struct Corners {
    /// Signed distance to the surface.
    pub(super) value: [f32; CORNERS],
    /// The chart that weighs most there (or did where the value was filled in from).
    pub(super) chart: [u32; CORNERS],
    /// 0 = unknown, 1 = from charts, more = filled in that round minus one; or with [`BEYOND`].
    pub(super) round: [u8; CORNERS],
    /// Blended mask, 0 to 255.
    pub(super) support: [u8; CORNERS],
}

/// What is known at one corner, in the gauge of the block that asked.
#[derive(Clone, Copy)]
pub(crate) struct CornerValue {
    /// Signed distance to the surface.
    pub(crate) value: f64,
    /// 0 = unknown, 1 = from charts, more = filled in.
    pub(crate) round: u8,
    /// The chart that weighs most there.
    pub(crate) chart: u32,
}

/// A corner by its block and its index there; block `u32::MAX` where there is none.
#[derive(Clone, Copy)]
pub(crate) struct CornerId {
    /// Index of the block.
    pub(crate) block: u32,
    /// Index of the corner in the block.
    pub(crate) corner: usize,
}

/// A chart as a block sees it.
pub(crate) struct BlockChart<'c> {
    /// Index of the chart.
    pub(crate) index: u32,
    /// The chart.
    pub(crate) chart: &'c Chart,
    /// 1 or -1: which way its normal faces in the block's gauge.
    pub(crate) sign: f64,
}

impl<'c> Grid<'c> {
    /// Number of blocks.
    pub(crate) fn blocks(&self) -> usize {
        self.keys.len()
    }
    /// Side of a block's voxels.
    #[inline]
    pub(crate) fn side(&self, block: usize) -> f64 {
        side(self.h, level_of_key(self.keys[block]))
    }
    /// The lowest corner of a block, in its voxels from the origin.
    #[inline]
    pub(crate) fn origin(&self, block: usize) -> [i32; 3] {
        block_of_key(self.keys[block]).map(|b| b * BLOCK)
    }
    /// Charts of a block, and whether each is turned in the block's gauge.
    fn list(&self, block: usize) -> (&[u32], &[bool]) {
        let range = self.start[block] as usize..self.start[block + 1] as usize;
        (&self.lists[range.clone()], &self.turned[range])
    }
    /// The charts of a block, in its gauge.
    pub(crate) fn charts_of(&self, block: usize) -> impl Iterator<Item = BlockChart<'c>> {
        let (list, turned) = self.list(block);
        list.iter().zip(turned).map(|(&index, &turned)| {
            let chart = &self.charts[index as usize];
            BlockChart { index, chart, sign: if turned { -chart.sign } else { chart.sign } }
        })
    }
    /// Sign of a chart in a block's gauge.
    fn sign(&self, block: usize, chart: u32) -> f64 {
        let sign = self.charts[chart as usize].sign;
        if self.own_gauge[block] {
            let (list, turned) = self.list(block);
            if let Ok(k) = list.binary_search(&chart) {
                return if turned[k] { -sign } else { sign };
            }
        }
        sign
    }
    /// Indices of the finer blocks in and around a block: those of the level before, by x, then y, then z,
    /// from the one below its lowest corner; `u32::MAX` where there is none. `None` where there are none at
    /// all.
    pub(crate) fn finer(&self, block: usize) -> Option<[u32; 64]> {
        let (level, b) = (level_of_key(self.keys[block]), block_of_key(self.keys[block]));
        if level == 0 {
            return None;
        }
        let at = |n: i32| [2 * b[0] + n % 4 - 1, 2 * b[1] + n / 4 % 4 - 1, 2 * b[2] + n / 16 - 1];
        let found: [u32; 64] = std::array::from_fn(|n| find(&self.keys, level - 1, at(n as i32)));
        found.iter().any(|&f| f != u32::MAX).then_some(found)
    }
    /// Who owns corner `i`, counted from `block`: that block or one of those around it.
    #[inline]
    pub(crate) fn owner(&self, block: usize, mut i: [i32; 3]) -> CornerId {
        let mut n = 13usize;
        for (k, stride) in [(0, 1usize), (1, 3), (2, 9)] {
            if i[k] < 0 {
                i[k] += BLOCK;
                n -= stride;
            } else if i[k] >= BLOCK {
                i[k] -= BLOCK;
                n += stride;
            }
        }
        let block = if n == 13 { block as u32 } else { self.around[block][n] };
        CornerId { block, corner: corner_index(i) }
    }
    /// What is known at corner `i` of `block`, in that block's gauge; `i` may reach into the blocks around
    /// it.
    #[inline]
    pub(crate) fn fetch(&self, block: usize, i: [i32; 3]) -> CornerValue {
        self.read(block, self.owner(block, i))
    }
    /// What is known at a corner, in the gauge of `block`.
    #[inline]
    pub(crate) fn read(&self, block: usize, CornerId { block: other, corner: c }: CornerId) -> CornerValue {
        if other == u32::MAX {
            return CornerValue { value: 0.0, round: 0, chart: u32::MAX };
        }
        let other = other as usize;
        let b = &self.corners[other];
        let (mut value, mut round, chart) = (f64::from(b.value[c]), b.round[c], b.chart[c]);
        if round & BEYOND != 0 {
            round = if self.side(block) > self.side(other) { 1 } else { round & !BEYOND };
        }
        if other != block && round > 0 && (self.own_gauge[block] || self.own_gauge[other]) {
            value *= self.sign(block, chart) * self.sign(other, chart);
        }
        CornerValue { value, round, chart }
    }
    /// Blended mask at corner `i`, in [0, 1].
    pub(crate) fn support(&self, block: usize, i: [i32; 3]) -> f64 {
        self.support_of(self.owner(block, i))
    }
    /// Blended mask at a corner, in [0, 1].
    pub(crate) fn support_of(&self, CornerId { block, corner }: CornerId) -> f64 {
        self.corners.get(block as usize).map_or(0.0, |b| f64::from(b.support[corner]) / 255.0)
    }
    /// Blended mask at `p` in the voxel of `block` with lowest corner `at`, trilinear.
    pub(crate) fn support_at(&self, block: usize, at: [i32; 3], p: Vec3) -> f32 {
        let first = self.origin(block);
        let h = self.side(block);
        let t = [0, 1, 2].map(|k| p[k] / h - f64::from(first[k] + at[k]));
        let weight = |o: [i32; 3]| (0..3).map(|k| if o[k] == 1 { t[k] } else { 1.0 - t[k] }).product::<f64>();
        let corners = (0..8).map(corner_offset);
        corners.map(|o| weight(o) * self.support(block, [0, 1, 2].map(|k| at[k] + o[k]))).sum::<f64>() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_gives_its_block_back_and_keys_ascend_with_level_z_y_x() {
        let blocks = [
            (0, [-3, 5, -500_000]),
            (0, [500_000, -7, 0]),
            (0, [0, -6, 0]),
            (0, [-1, 2, 9]),
            (LEVELS - 1, [2, 3, -500_000]),
        ];
        for (level, b) in blocks {
            let key = block_key(level, b);
            assert_eq!((level_of_key(key), block_of_key(key)), (level, b));
        }
        assert!(blocks.map(|(level, b)| block_key(level, b)).is_sorted());
    }

    #[test]
    fn a_corner_has_one_index() {
        assert!((0..CORNERS).all(|k| corner_index(corner_at(k)) == k));
    }
}
