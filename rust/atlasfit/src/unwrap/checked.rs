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

/// The faces of a chart to be cut out of it because rounding flipped them, or closed a slit beside them;
/// where its border touches itself, half of it. `None` if all is well.
fn spoiled(
    s: &Surface,
    c: &Chart,
    at: &[[f32; 2]],
    round: usize,
    ctx: &Context<'_>,
) -> Result<Option<Vec<bool>>> {
    let at: Vec<[f64; 2]> = at.iter().map(|p| p.map(f64::from)).collect();
    let mut bad: Vec<bool> = c.tris.iter().map(|t| !inject::positive(corners(*t, &at))).collect();
    if c.faces.len() == 1 {
        return Ok(None);
    }
    // Where the border's two sides at a vertex have come to lie on each other, the first face goes.
    let closed = inject::overwound(&c.tris, &at, ctx)?;
    for &(i, k) in &c.border {
        bad[i as usize] |= closed[c.tris[i as usize][usize::from(k)] as usize];
    }
    if bad.iter().any(|&b| b) {
        return Ok(Some(whole_cells(s, &c.faces, bad)));
    }
    Ok(inject::border_touches(&c.tris, &at, &c.border, ctx)?
        .then(|| halves(s, &c.faces, |i| c.tris[i].iter().map(|&v| at[v as usize][round % 2]).sum::<f64>())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;
    use crate::run::Run;

    /// Which faces are spoiled of a disc of eight about vertex 0, with a slit of this angle from there to its
    /// rim.
    fn spoiled_by_slit(slit: f64) -> Option<Vec<bool>> {
        let rim = |k: u32| ((std::f64::consts::TAU - slit) * f64::from(k) / 8.0).sin_cos();
        let uv: Vec<[f64; 2]> =
            std::iter::once([0.0; 2]).chain((0..9).map(rim).map(|(s, c)| [c, s])).collect();
        let tris: Vec<[u32; 3]> = (1..9).map(|k| [0, k, k + 1]).collect();
        let mesh = TriMesh::new(uv.iter().map(|p| [p[0], p[1], 0.0]).collect(), tris.clone());
        let border = (0..8).map(|f| (f, 1)).chain([(0, 0), (7, 2)]).collect();
        let chart = Chart { faces: (0..8).collect(), tris, uv, border, ..Chart::default() };
        let at: Vec<[f32; 2]> = chart.uv.iter().map(|p| p.map(|x| x as f32)).collect();
        Run::default()
            .execute(|ctx| {
                let s = Surface::new(&mesh, &UnwrapOptions::default(), ctx)?;
                spoiled(&s, &chart, &at, 0, ctx)
            })
            .expect("nothing cancels")
    }

    #[test]
    fn a_slit_that_rounding_closes_is_opened_by_the_face_beside_it() {
        assert_eq!(spoiled_by_slit(0.1), None);
        let first: Vec<bool> = (0..8).map(|f| f == 0).collect();
        assert_eq!(spoiled_by_slit(1e-9), Some(first));
    }
}
