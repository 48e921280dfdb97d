//! Colours spread beyond the borders of the charts, so that filtered look-ups find nothing foreign.
//!
//! In: texels, and which of them have a colour. Out: a colour for every texel.

use super::owners::ROWS;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use rayon::prelude::*;

/// Texels whose neighbours are looked at between two looks at the run: below a millisecond.
const PIECE: usize = 1 << 14;

/// Spreads colours into empty texels, one ring at a time; what stays empty gets the mean colour. `filled`
/// says which texels have a colour.
pub(super) fn dilate(
    rgba: &mut [[u8; 4]],
    mut filled: Vec<bool>,
    width: usize,
    rings: u32,
    ctx: &Context<'_>,
) -> Result<()> {
    let block = width * ROWS;
    ctx.check()?;
    let sum = |(texels, filled): (&[[u8; 4]], &[bool])| {
        ctx.check()?;
        let (mut sum, mut count) = ([0u64; 4], 0u64);
        for (c, _) in texels.iter().zip(filled).filter(|c| *c.1) {
            (0..4).for_each(|k| sum[k] += u64::from(c[k]));
            count += 1;
        }
        Ok((sum, count))
    };
    let (sum, count) = (rgba.par_chunks(block).zip(filled.par_chunks(block)).map(sum))
        .try_reduce(|| ([0; 4], 0), |(a, m), (b, n)| Ok(([0, 1, 2, 3].map(|k| a[k] + b[k]), m + n)))?;
    let mean = sum.map(|s| (s / count.max(1)) as u8);
    let height = filled.len() / width;
    let near = |at: usize| {
        let (x, y) = (at % width, at / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |r| (x.saturating_sub(1)..(x + 2).min(width)).map(move |c| r * width + c))
    };
    let border = |block: &[usize; 2], filled: &[bool]| -> Result<Vec<usize>> {
        ctx.check()?;
        Ok((block[0]..block[1]).filter(|&i| !filled[i] && near(i).any(|j| filled[j])).collect())
    };
    let blocks: Vec<[usize; 2]> =
        (0..filled.len()).step_by(block).map(|i| [i, (i + block).min(filled.len())]).collect();
    let front: Vec<Vec<usize>> = blocks.par_iter().map(|b| border(b, &filled)).collect::<Result<_>>()?;
    let mut front = front.concat();
    for _ in 0..rings {
        if front.is_empty() {
            break;
        }
        let colors: Vec<[u8; 4]> = front
            .par_iter()
            .map(|&i| {
                let (mut sum, mut count) = ([0u32; 4], 0);
                for j in near(i).filter(|&j| filled[j]) {
                    (0..4).for_each(|k| sum[k] += u32::from(rgba[j][k]));
                    count += 1;
                }
                sum.map(|s| ((s + count / 2) / count.max(1)) as u8)
            })
            .collect();
        ctx.check()?;
        for (&i, c) in front.iter().zip(colors) {
            rgba[i] = c;
            filled[i] = true;
        }
        let mut next: Vec<usize> = Vec::with_capacity(front.len());
        for piece in front.chunks(PIECE) {
            ctx.check()?;
            next.extend(piece.iter().flat_map(|&i| near(i)).filter(|&j| !filled[j]));
        }
        sort(&mut next, ctx)?;
        next.dedup();
        front = next;
    }
    (rgba.par_chunks_mut(block).zip(filled.par_chunks(block))).try_for_each(|(texels, filled)| {
        ctx.check()?;
        texels.iter_mut().zip(filled).filter(|c| !*c.1).for_each(|(c, _)| *c = mean);
        Ok(())
    })
}
