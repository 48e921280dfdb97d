//! A chart as runs of cells, in several rotations, with and without the padding round it.

use super::bitmap::{Bitmap, runs};
use super::placement::Placement;
use crate::unwrap::chart::Chart;
use crate::unwrap::planar::rotated;

/// Rows that are tested together first.
pub(crate) const BLOCK: usize = 8;

/// A run of cells in a row.
#[derive(Clone, Copy)]
pub(super) struct Run {
    pub row: u32,
    /// Its first cell, and the one behind its last.
    pub from: u32,
    pub to: u32,
}

impl Run {
    /// The cells `from..to` of a row.
    pub(super) fn new(row: usize, from: usize, to: usize) -> Self {
        Self { row: row as u32, from: from as u32, to: to as u32 }
    }
}

/// A chart's cells in one rotation.
pub(crate) struct Mask {
    pub width: usize,
    pub height: usize,
    /// All cells, widest runs first: the first ones rule out most positions.
    pub runs: Vec<Run>,
    /// The cells that are set in all of [`BLOCK`] rows from `row`: one look at such a run stands for that
    /// many rows.
    pub blocks: Vec<Run>,
}

impl Mask {
    /// The cells of a bitmap.
    pub(super) fn of(bits: &Bitmap) -> Self {
        let widest_first = |all: &mut Vec<Run>| {
            all.sort_unstable_by_key(|r| (std::cmp::Reverse(r.to - r.from), r.row, r.from));
        };
        let (mut all, mut blocks) = (Vec::new(), Vec::new());
        for y in 0..bits.height {
            runs(bits.row(y), |from, to| all.push(Run::new(y, from, to)));
        }
        let mut common = vec![0; bits.words];
        for y in (0..(bits.height + 1).saturating_sub(BLOCK)).step_by(BLOCK) {
            common.copy_from_slice(bits.row(y));
            for r in y + 1..y + BLOCK {
                common.iter_mut().zip(bits.row(r)).for_each(|(c, &o)| *c &= o);
            }
            runs(&common, |from, to| blocks.push(Run::new(y, from, to)));
        }
        widest_first(&mut all);
        widest_first(&mut blocks);
        Self { width: bits.width, height: bits.height, runs: all, blocks }
    }
}

/// One rotation of one chart.
pub(crate) struct Pose {
    pub rotation: [f64; 2],
    /// Lower left corner of the tight mask in the rotated chart's units.
    pub origin: [f64; 2],
    pub tight: Mask,
    /// The same with the padding round it: `grow` more cells on every side.
    pub grown: Mask,
}

impl Pose {
    /// The place of its tight mask at a cell.
    pub(crate) fn at(&self, x: usize, y: usize, cell: f64) -> Placement {
        let shift = [x as f64 * cell - self.origin[0], y as f64 * cell - self.origin[1]];
        Placement { rotation: self.rotation, shift, ..Placement::default() }
    }
}

/// The rotations of a chart: `turns` times four, from its upright pose.
pub(crate) fn poses(c: &Chart, upright: [f64; 2], cell: f64, grow: usize, turns: usize) -> Vec<Pose> {
    let (outline, mut out) = (c.outline(), Vec::new());
    for turn in 0..turns {
        let (s, k) = (std::f64::consts::FRAC_PI_2 * turn as f64 / turns as f64).sin_cos();
        let mut rotation = [k * upright[0] - s * upright[1], s * upright[0] + k * upright[1]];
        let (mut cells, mut origin) = Bitmap::of(&rotated(&outline, rotation), cell);
        for _ in 0..4 {
            out.push(Pose { rotation, origin, tight: Mask::of(&cells), grown: Mask::of(&cells.grown(grow)) });
            // (x, y) -> (-y, x): the new left side is the old top.
            origin = [-(origin[1] + cells.height as f64 * cell), origin[0]];
            rotation = [-rotation[1], rotation[0]];
            cells = cells.turned();
        }
    }
    out
}

/// How much a chart decides where others go, for the order of placing.
fn extent(poses: &[Pose]) -> (usize, usize) {
    (poses[0].tight.width * 10 + poses[0].tight.height * 3, poses[0].tight.height)
}

/// The order of placing in which charts that decide most go first.
pub(super) fn largest_first(poses: &[Vec<Pose>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by_key(|&c| (std::cmp::Reverse(extent(&poses[c])), c));
    order
}
