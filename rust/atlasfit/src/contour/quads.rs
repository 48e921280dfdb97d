//! Contouring the field.
//!
//! In: the signed distance on the grid. Out: a quadrilateral mesh, one vertex per piece of surface in a
//! voxel, one quad per edge of the grid that the surface crosses (dual marching cubes; Nielson 2004). Where a
//! voxel meets an edge of finer ones with the middle of its face, it stands for two, and the quad is a
//! triangle. A quad faces where the field rises, in the gauge of the block that owns its edge.

use super::cells::{self, Cells, Crossing};
use super::constants::CONTOUR;
use super::mixed;
use super::normals::Charts;
use super::surface::{Contour, ContourVertices};
use crate::blend::blocks::{CORNERS, Grid, corner_at};
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use rayon::prelude::*;

/// Contours the field on a grid.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn contour(grid: Grid<'_>, ctx: &Context<'_>) -> Result<Contour> {
    let blocks = grid.blocks();
    let cells: Vec<Cells> = (0..blocks.div_ceil(CONTOUR.chunk))
        .into_par_iter()
        .map(|chunk| {
            ctx.check()?;
            let (mut charts, mut out) = (Charts::default(), Cells::default());
            let range = chunk * CONTOUR.chunk..((chunk + 1) * CONTOUR.chunk).min(blocks);
            ctx.advance(grid.pairs / blocks * range.len());
            for b in range {
                if !grid.contoured[b] {
                    continue;
                }
                let finer = mixed::Around::of(&grid, b);
                for at in (0..CORNERS).map(corner_at) {
                    let touches = |around| mixed::contour(&grid, b, at, around, &mut charts, &mut out);
                    if !finer.as_ref().is_some_and(touches) {
                        cells::contour(&grid, b, at, &mut charts, &mut out);
                    }
                }
            }
            Ok(out)
        })
        .collect::<Result<_>>()?;
    drop(grid);
    let Joined { vertices, mut crossings } = join(cells, ctx)?;
    sort(&mut crossings, ctx)?;
    Ok(Contour { vertices, quads: quads(&crossings, ctx)? })
}

/// What all blocks contribute.
struct Joined {
    vertices: ContourVertices,
    crossings: Vec<Crossing>,
}

/// Puts what chunks of blocks contribute into one, in order.
fn join(cells: Vec<Cells>, ctx: &Context<'_>) -> Result<Joined> {
    let count = cells.iter().map(|o| o.vertices.positions.len()).sum();
    let mut crossings: Vec<Crossing> = Vec::with_capacity(cells.iter().map(|o| o.crossings.len()).sum());
    let mut all = ContourVertices {
        positions: Vec::with_capacity(count),
        normals: Vec::with_capacity(count),
        chart: Vec::with_capacity(count),
        filled: Vec::with_capacity(count),
        support: Vec::with_capacity(count),
    };
    for (k, Cells { vertices, crossings: of_chunk }) in cells.into_iter().enumerate() {
        if k % CONTOUR.chunk == 0 {
            ctx.check()?;
        }
        let base = all.positions.len() as u32;
        crossings.extend(of_chunk.into_iter().map(|c| c.counted_from(base)));
        all.positions.extend(vertices.positions);
        all.normals.extend(vertices.normals);
        all.chart.extend(vertices.chart);
        all.filled.extend(vertices.filled);
        all.support.extend(vertices.support);
    }
    Ok(Joined { vertices: all, crossings })
}

/// A quad for each edge of the grid that has its four cells.
fn quads(crossings: &[Crossing], ctx: &Context<'_>) -> Result<Vec<[u32; 4]>> {
    let mut quads = Vec::with_capacity(crossings.len() / 4);
    let mut i = 0;
    while i + 3 < crossings.len() {
        if i % 65536 < 4 {
            ctx.check()?;
        }
        let r = &crossings[i..i + 4];
        if (0..4).all(|k| r[k].edge() == r[0].edge() && r[k].slot() == k as u64) {
            let q = [r[0].vertex, r[1].vertex, r[2].vertex, r[3].vertex];
            quads.push(if r[0].rises() { q } else { [q[3], q[2], q[1], q[0]] });
            i += 4;
        } else {
            i += 1;
        }
    }
    Ok(quads)
}
