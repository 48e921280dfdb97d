//! Gaps in the field closed: values for corners that no chart reaches.
//!
//! In: the grid with what the charts say. Out: the same grid, extended by a few voxels and smooth there
//! (volumetric diffusion; Davis, Marschner, Garr and Levoy 2002). What the charts say is never changed.

use super::blocks::{BEYOND, CORNERS, CornerValue, Grid, corner_at};
use super::constants::BLEND;
use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;

/// Blocks that one worker handles between two checks.
const CHUNK: usize = 64;
/// Offsets of a corner's neighbours.
const NEIGHBOURS: [[i32; 3]; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

/// A new value for a corner of a chunk of blocks.
struct Change {
    /// Block within the chunk times [`CORNERS`], plus the corner.
    at: u32,
    value: f32,
    chart: u32,
}

/// Extends the field into corners that no chart reaches, and smooths what was filled in.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn fill(grid: &mut Grid<'_>, ctx: &Context<'_>) -> Result<()> {
    for round in 0..BLEND.fill_rounds {
        sweep(grid, Some(2 + round), ctx)?;
    }
    for _ in 0..BLEND.relax {
        sweep(grid, None, ctx)?;
    }
    Ok(())
}

/// One sweep over the grid: gives unknown corners beside known ones a value and this round, or, without
/// one, smooths the filled ones. Every new value is computed from old ones only, so the order of the blocks
/// does not matter.
fn sweep(grid: &mut Grid<'_>, grow: Option<u8>, ctx: &Context<'_>) -> Result<()> {
    let blocks = grid.blocks();
    let changes: Vec<Vec<Change>> = (0..blocks.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            ctx.check()?;
            let mut changes = Vec::new();
            for b in chunk * CHUNK..((chunk + 1) * CHUNK).min(blocks) {
                for (c, &round) in grid.corners[b].round.iter().enumerate() {
                    let round = round & !BEYOND;
                    if (if grow.is_some() { round == 0 } else { round > 1 })
                        && let Some((value, chart)) = mean_of_neighbours(grid, b, corner_at(c))
                    {
                        changes.push(Change { at: (b % CHUNK * CORNERS + c) as u32, value, chart });
                    }
                }
            }
            Ok(changes)
        })
        .collect::<Result<_>>()?;
    grid.corners.par_chunks_mut(CHUNK).zip(changes).try_for_each(|(corners, changes)| {
        ctx.check()?;
        for Change { at, value, chart } in changes {
            let (block, c) = (&mut corners[at as usize / CORNERS], at as usize % CORNERS);
            // An exact zero would make an edge end on the surface.
            block.value[c] = if value == 0.0 { f32::MIN_POSITIVE } else { value };
            if let Some(round) = grow {
                block.chart[c] = chart;
                block.round[c] |= round;
            }
        }
        Ok(())
    })
}

/// The mean of the known values around a corner, and the chart of the first of them. Nothing between two
/// sheets that face the same way: the field jumps there and no surface passes.
fn mean_of_neighbours(grid: &Grid<'_>, block: usize, i: [i32; 3]) -> Option<(f32, u32)> {
    let (mut sum, mut count, mut from) = (0.0, 0.0, u32::MAX);
    let (own, jump) = (grid.fetch(block, i), BLEND.fill_jump * grid.side(block));
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for o in NEIGHBOURS {
        let CornerValue { value, round, chart } = grid.fetch(block, [i[0] + o[0], i[1] + o[1], i[2] + o[2]]);
        if round > 0 && (own.round == 0 || (value - own.value).abs() <= jump) {
            lo = lo.min(value);
            hi = hi.max(value);
            // Each value comes in the gauge of this block.
            sum += value;
            count += 1.0;
            if from == u32::MAX {
                from = chart;
            }
        }
    }
    (count > 0.0 && (own.round > 0 || hi - lo <= jump)).then(|| ((sum / count) as f32, from))
}
