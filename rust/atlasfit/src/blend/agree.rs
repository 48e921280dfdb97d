//! Corners that two levels of blocks have, made the same.
//!
//! In: a grid whose values are all known. Out: the same grid, where coarser blocks have the values that finer
//! ones over them lend: voxels on both sides of a change of levels see one field.

use super::blocks::{CornerId, Corners, Grid, block_of_key, corner_index, find, level_of_key};
use crate::error::Result;
use crate::run::Context;

/// Copies what finer blocks know.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn agree(grid: &mut Grid<'_>, ctx: &Context<'_>) -> Result<()> {
    for block in 0..grid.blocks() {
        ctx.check_at(block)?;
        let (level, at) = (level_of_key(grid.keys[block]), block_of_key(grid.keys[block]));
        if level == 0 || !grid.contoured[block] {
            continue;
        }
        for child in 0..8 {
            let o = [0, 1, 2].map(|k| child >> k & 1);
            let finer = find(&grid.keys, level - 1, [0, 1, 2].map(|k| 2 * at[k] + o[k]));
            if finer != u32::MAX {
                take(grid, block, finer, o);
            }
        }
    }
    Ok(())
}

/// Copies the corners of a finer block that lies over an eighth of a block: `o` says which.
fn take(grid: &mut Grid<'_>, block: usize, finer: u32, o: [i32; 3]) {
    for c in 0..8 {
        let i = [0, 1, 2].map(|k| c >> k & 1);
        let from = CornerId { block: finer, corner: corner_index(i.map(|x| 2 * x)) };
        let there = grid.read(block, from);
        if there.round == 0 {
            continue;
        }
        let support = grid.corners[finer as usize].support[from.corner];
        let to = corner_index([0, 1, 2].map(|k| 2 * o[k] + i[k]));
        let Corners { value, chart, round, support: own } = &mut grid.corners[block];
        (value[to], chart[to], round[to], own[to]) = (there.value as f32, there.chart, there.round, support);
    }
}
