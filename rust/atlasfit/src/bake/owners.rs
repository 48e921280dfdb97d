//! The face that each texel of a texture shows.
//!
//! In: UVs of the faces, size of the texture. Out: a face or [`NO_FACE`] for each texel, rows from the top.

use crate::error::Result;
use crate::run::Context;
use rayon::prelude::*;

/// Stands for a texel without a face.
pub(super) const NO_FACE: u32 = u32::MAX;
/// Rows per task.
pub(super) const ROWS: usize = 8;
/// Texels that are looked at between two looks at the cancel flag: below a millisecond.
const TEXELS_PER_CHECK: usize = 1 << 16;
/// What a face costs before its first texel is looked at, in texels (an estimate).
const FACE_COST: usize = 16;

/// The face at the middle of each texel. Where there is none, one with a corner in the texel, so that what is
/// thinner than a texel is seen too. Of several the last.
pub(super) fn owners(
    uv: &[[[f32; 2]; 3]],
    width: usize,
    height: usize,
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let texels = |t: &[[f32; 2]; 3]| {
        t.map(|q| [f64::from(q[0]) * width as f64, (1.0 - f64::from(q[1])) * height as f64])
    };
    let span = |p: &[[f64; 2]; 3], k: usize| {
        p.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), q| (lo.min(q[k]), hi.max(q[k])))
    };
    // Faces of each block of rows.
    let mut blocks: Vec<Vec<u32>> = vec![Vec::new(); height.div_ceil(ROWS)];
    for (f, t) in uv.iter().enumerate() {
        ctx.check_at(f)?;
        let p = texels(t);
        if p.iter().flatten().all(|x| x.is_finite()) {
            let (lo, hi) = span(&p, 1);
            let first = (lo / ROWS as f64).max(0.0) as usize;
            let end = ((hi / ROWS as f64).floor() + 1.0).clamp(0.0, blocks.len() as f64) as usize;
            blocks.iter_mut().take(end).skip(first).for_each(|b| b.push(f as u32));
        }
    }
    let mut owner = ctx.filled(NO_FACE, width * height)?;
    owner.par_chunks_mut(width * ROWS).zip(blocks).enumerate().try_for_each(|(block, (owner, faces))| {
        let (top, rows) = (block * ROWS, owner.len() / width);
        for &f in &faces {
            for [x, y] in texels(&uv[f as usize]).map(|q| q.map(f64::floor)) {
                if (0.0..width as f64).contains(&x) && (top as f64..(top + rows) as f64).contains(&y) {
                    owner[(y as usize - top) * width + x as usize] = f;
                }
            }
        }
        let mut looked_at = 0;
        for &f in &faces {
            let p = texels(&uv[f as usize]);
            // Texels whose middles are within.
            let range = |k: usize, least: usize, most: usize| {
                let (lo, hi) = span(&p, k);
                let (least, most) = (least as f64, most as f64);
                let from = (lo - 0.5).ceil().clamp(least, most) as usize;
                (from, ((hi - 0.5).floor() + 1.0).clamp(from as f64, most) as usize)
            };
            let (ys, xs) = (range(1, top, top + rows), range(0, 0, width));
            looked_at += FACE_COST + (ys.1 - ys.0) * (xs.1 - xs.0);
            if looked_at > TEXELS_PER_CHECK {
                ctx.check()?;
                looked_at = 0;
            }
            for y in ys.0..ys.1 {
                for x in xs.0..xs.1 {
                    let q = [x as f64 + 0.5, y as f64 + 0.5];
                    let side = |a: [f64; 2], b: [f64; 2]| {
                        (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0])
                    };
                    let s = [side(p[0], p[1]), side(p[1], p[2]), side(p[2], p[0])];
                    if s.iter().all(|&s| s >= 0.0) || s.iter().all(|&s| s <= 0.0) {
                        owner[(y - top) * width + x] = f;
                    }
                }
            }
        }
        ctx.check()
    })?;
    Ok(owner)
}
