//! Packing with a last check of the charts as they leave: in single precision, in place.
//!
//! In: flattened charts. Out: charts and their placements, with what rounding spoils cut out.

use super::chart::Chart;
use super::constants::UNWRAP;
use super::cut::{cut, halves, whole_cells};
use super::options::UnwrapOptions;
use super::pack::{self, PackJob, Packed, Packing};
use super::surface::Surface;
use crate::error::{Error, Result};
use crate::numeric::plane::corners;
use crate::run::Context;
use crate::spatial::inject;
use rayon::prelude::*;

/// Charts that are right in single precision.
pub(crate) struct Checked {
    pub charts: Vec<Chart>,
    /// Where they go.
    pub packed: Packed,
    /// Number of charts that had to be cut.
    pub repaired: usize,
}

/// Packs, and checks the charts once more as they leave: in single precision, in place. What rounding spoils
/// (faces far below a texel) is cut out, and everything packed again.
pub(crate) fn pack_checked(
    s: &Surface,
    mut charts: Vec<Chart>,
    options: &UnwrapOptions,
    packing: Packing<'_>,
    ctx: &Context<'_>,
) -> Result<Checked> {
    let job = PackJob {
        page: options.page_size,
        padding: options.padding_px,
        density: options.texels_per_unit.map(|t| t * s.unit),
        pages: options.most_pages(),
        occupied: options.occupied.as_deref().unwrap_or_default(),
        packer: packing,
        seed: ctx.seed,
    };
    let mut repaired = 0;
    for round in 0.. {
        let packed = pack::pack(&charts, &job, ctx)?;
        let spoiled: Vec<Option<Vec<bool>>> = (charts.par_iter().zip(&packed.placements))
            .map(|(c, p)| ctx.check().and_then(|()| spoiled(s, c, &p.positions(&c.uv), round, ctx)))
            .collect::<Result<_>>()?;
        if round == UNWRAP.repairs || spoiled.iter().all(Option::is_none) {
            return Ok(Checked { charts, packed, repaired });
        }
        let mut next = Vec::with_capacity(charts.len());
        for (c, spoiled) in charts.into_iter().zip(spoiled) {
            let Some(side) = spoiled else {
                next.push(c);
                continue;
            };
            repaired += 1;
            if round + 1 == UNWRAP.repairs {
                next.extend(c.faces.iter().map(|&f| Chart::single(s, f)));
                continue;
            }
            next.extend(cut(s, &c, &side, ctx).into_iter().map(|piece| match piece.faces[..] {
                [f] => Chart::single(s, f),
                _ => piece,
            }));
        }
        charts = next;
    }
    Err(Error::internal("the charts are still cut after the last round of repairs"))
}

/// The faces of a chart to be cut out of it because rounding flipped them; where its border touches itself,
/// half of it. `None` if all is well.
fn spoiled(
    s: &Surface,
    c: &Chart,
    at: &[[f32; 2]],
    round: usize,
    ctx: &Context<'_>,
) -> Result<Option<Vec<bool>>> {
    let at: Vec<[f64; 2]> = at.iter().map(|p| p.map(f64::from)).collect();
    let bad: Vec<bool> = c.tris.iter().map(|t| !inject::positive(corners(*t, &at))).collect();
    if c.faces.len() == 1 {
        return Ok(None);
    }
    ctx.check()?;
    if bad.iter().any(|&b| b) {
        return Ok(Some(whole_cells(s, &c.faces, bad)));
    }
    Ok(inject::border_touches(&c.tris, &at, &c.border, ctx)?
        .then(|| halves(s, &c.faces, |i| c.tris[i].iter().map(|&v| at[v as usize][round % 2]).sum::<f64>())))
}
