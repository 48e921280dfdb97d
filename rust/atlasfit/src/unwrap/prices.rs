//! What an edge costs as a seam.
//!
//! In: a surface, how much seams are to hide, a user's own prices. Out: a price for each edge, per unit of
//! its length. Seams go where they cost least: where the outside hardly sees them, and where the user wants
//! them.

use super::constants::PRICES;
use super::options::UnwrapOptions;
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::outside::Outside;
use rayon::prelude::*;

/// Prices by face and slot, the same on both sides of an edge: 1 is the mean by length, so that only ratios
/// count, and none is near 0. Where the surface ends it is 1. `None` where all edges cost the same.
pub(super) fn prices(
    mesh: &TriMesh,
    s: &Surface,
    options: &UnwrapOptions,
    ctx: &Context<'_>,
) -> Result<Option<Vec<[f32; 3]>>> {
    if options.seams_hidden == 0.0 && options.seam_price.is_none() {
        return Ok(None);
    }
    let outside = if options.seams_hidden > 0.0 {
        let faces = s.tri.iter().map(|t| t.map(|v| s.pos[v as usize]));
        Some(Outside::new(faces.collect(), options.up.map(Vec3), ctx)?)
    } else {
        None
    };
    // Where edges are many, fewer rays from each do: seams run along many edges.
    let few = s.faces().div_ceil(PRICES.faces_of_all_rays).clamp(1, PRICES.fewest_rays);
    let price = |f: usize, k: usize| {
        let ends = [k, (k + 1) % 3];
        let seen = outside.as_ref().map_or(1.0, |outside| {
            outside.sees(ends.map(|k| s.pos[s.tri[f][k] as usize]), 0.5, (3 * f + k) % few, few)
        });
        let own = options.seam_price.as_ref().map_or(1.0, |price| {
            ends.iter().map(|&k| 0.5 * f64::from(price[mesh.triangles[f][k] as usize])).sum()
        });
        let shown = 1.0 - options.seams_hidden * (1.0 - seen.powi(PRICES.contrast));
        shown * own
    };
    let mut out = ctx.filled([1.0f32; 3], s.faces())?;
    out.par_iter_mut().enumerate().try_for_each(|(f, out)| {
        ctx.check_at(f)?;
        for k in (0..3).filter(|&k| s.twin[f][k] != NONE && s.twin[f][k] / 3 > f as u32) {
            out[k] = price(f, k) as f32;
        }
        Ok(())
    })?;
    let (mut length, mut cost) = (0.0, 0.0);
    for f in 0..s.faces() {
        ctx.check_at(f)?;
        for k in (0..3).filter(|&k| s.twin[f][k] != NONE && s.twin[f][k] / 3 > f as u32) {
            let h = s.twin[f][k] as usize;
            out[h / 3][h % 3] = out[f][k];
            length += f64::from(s.length[f][k]);
            cost += f64::from(s.length[f][k]) * f64::from(out[f][k]);
        }
    }
    if cost == 0.0 {
        return Ok(None);
    }
    let inner = |(_, h): &(&mut f32, &u32)| **h != NONE;
    for (p, _) in out.iter_mut().flatten().zip(s.twin.as_flattened()).filter(inner) {
        *p = (f64::from(*p) * length / cost).max(PRICES.least_price) as f32;
    }
    Ok(Some(out))
}

/// The prices of a coarse stand-in, whose vertices are some of the surface's: an edge has the mean of its
/// ends, and these that of their edges.
pub(crate) fn coarse_prices(
    s: &Surface,
    coarse: &[[u32; 3]],
    ctx: &Context<'_>,
) -> Result<Option<Vec<[f32; 3]>>> {
    let Some(price) = &s.price else { return Ok(None) };
    let mut sums = ctx.filled([0.0f32; 2], s.pos.len())?;
    for (i, (t, price)) in s.tri.iter().zip(price).enumerate() {
        ctx.check_at(i)?;
        for (k, price) in price.iter().enumerate() {
            for v in [t[k], t[(k + 1) % 3]] {
                let [sum, count] = &mut sums[v as usize];
                (*sum, *count) = (*sum + price, *count + 1.0);
            }
        }
    }
    let mean = |v: u32| sums[v as usize][0] / sums[v as usize][1].max(1.0);
    Ok(Some(coarse.iter().map(|t| [0, 1, 2].map(|k| 0.5 * (mean(t[k]) + mean(t[(k + 1) % 3])))).collect()))
}
