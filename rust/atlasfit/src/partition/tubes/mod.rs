//! Finding thin tubes and fitting them.
//!
//! In: points, search tree, spacing, noise. Out: tube charts with their members, which points they cover, and
//! what they say of the noise. A patch that must stay flatter than its own radius holds few points on a thin
//! tube, and noise as large as the radius leaves no surface to grow a patch on; a tube's axis and radius are
//! averaged over all points around it (paper, section 3: contours as 1-manifolds).

mod clumps;
pub(crate) mod constants;
mod extent;
mod grow;
mod local;
mod radius;
mod rice;

use super::Cut;
use super::constants::PARTITION;
use crate::atlas::{FittedChart, Map};
use crate::error::Result;
use crate::numeric::dense::{Principal, principal};
use crate::numeric::scatter::{by_name, one_in};
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::prior::smoothing::Smoothing;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use constants::{BINS, TUBES};
use grow::{Candidate, Neighbourhood, grow};
use local::local_noise;
pub(crate) use radius::whitened;
use radius::{FittedTube, fit_all};
use rayon::prelude::*;
use rice::pooled_noise;

/// What was found.
pub(crate) struct Tubes {
    /// The charts.
    pub fitted: Vec<FittedChart>,
    /// Points that need no other chart.
    pub covered: Vec<bool>,
    /// The noise, where the tubes hold most of the scan.
    pub sigma: Option<f64>,
    /// The noise at each point, as a multiple of that; empty where it is the same for all, or not known.
    pub relative: Vec<f32>,
}

/// Finds and fits tubes. `known` says that the noise was given and is not to be questioned.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn find(cut: &Cut<'_>, known: bool, ctx: &Context<'_>) -> Result<Tubes> {
    let Cut { points, tree, .. } = *cut;
    let n = points.len();
    let Candidates { found: candidates, covered } = candidates(cut, ctx)?;
    if candidates.is_empty() {
        return Ok(Tubes { fitted: vec![], covered, sigma: None, relative: vec![] });
    }
    let share = covered.iter().filter(|c| **c).count() as f64 / n as f64;
    let most = share > TUBES.most && !known;
    // Tubes that see far more noise than their neighbourhoods do hold strays, unless these see it differ.
    let limit = if cut.relative.is_empty() { TUBES.noisy * cut.sigma } else { f64::INFINITY };
    let believed = |sigma: f64| if sigma > limit { cut.sigma } else { sigma };
    let sigma = if most { believed(noise_of(&candidates, points)) } else { cut.sigma };
    let mut fits = fit_all(&candidates, points, tree, |_| sigma, ctx)?;
    let mut tubes =
        Tubes { fitted: vec![], covered: vec![false; n], sigma: most.then_some(sigma), relative: vec![] };
    if most {
        // Where the radius stands well out of the noise the fits know it best.
        let mut clear: Vec<f64> =
            fits.iter().flatten().filter(|f| f.ratio < TUBES.circle).map(|f| f.fitted.chart.sigma).collect();
        if clear.len() * 2 > fits.len() {
            let sigma = believed(median(&mut clear));
            tubes.sigma = Some(sigma);
            fits = fit_all(&candidates, points, tree, |_| sigma, ctx)?;
        }
    }
    let noise = tubes.sigma.unwrap_or(cut.sigma);
    let local = if most { local_noise(&fits, noise, ctx)? } else { None };
    let noise_at = |place: Vec3| noise * local.as_ref().map_or(1.0, |l| l.relative(place));
    if let Some(local) = &local {
        fits = fit_all(&candidates, points, tree, |c| noise * local.relative(c.tube.center), ctx)?;
        tubes.relative = local.at(points, ctx)?;
    }
    let stands = |f: &FittedTube| f.fitted.chart.sigma <= TUBES.noisy * noise_at(f.center);
    for fit in fits.into_iter().flatten().filter(stands) {
        for &i in &fit.covered {
            tubes.covered[i as usize] = true;
        }
        tubes.fitted.push(fit.fitted);
    }
    Ok(tubes)
}

/// Fits the tubes among the charts again, smoother or rougher than the data say.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn refit(
    points: &[Vec3],
    fitted: &mut [FittedChart],
    smoothing: Smoothing,
    ctx: &Context<'_>,
) -> Result<()> {
    fitted
        .par_iter_mut()
        .map(|FittedChart { chart, members, expected, smoothness, .. }| {
            ctx.check()?;
            let Map::Tube(tube) = &mut chart.map else { return Ok(()) };
            let wanted = radius::refit(tube, members, points, *expected, smoothing, ctx)?;
            *smoothness = wanted.or(*smoothness);
            Ok(())
        })
        .collect()
}

/// The noise that explains the tubes' points best.
fn noise_of(tubes: &[Candidate], points: &[Vec3]) -> f64 {
    let distances =
        |c: &Candidate| c.members.iter().map(|&m| c.tube.foot(points[m as usize]).d).collect::<Vec<_>>();
    let distances: Vec<Vec<f64>> = tubes.par_iter().map(distances).collect();
    pooled_noise(&distances, median(&mut tubes.iter().map(|c| c.tube.mean_radius).collect::<Vec<_>>()))
}

/// What looks like tubes.
struct Candidates {
    found: Vec<Candidate>,
    /// Points that lie on one.
    covered: Vec<bool>,
}

/// Looks about points in random order, until each lies on a candidate or has shown that there is none.
fn candidates(cut: &Cut<'_>, ctx: &Context<'_>) -> Result<Candidates> {
    let Cut { points, tree, sampling, sigma, .. } = *cut;
    let n = points.len();
    let order = by_name(cut.rows, ctx.seed, ctx)?;
    // A point decides by itself whether it takes part.
    let thin_out = (cut.whole / TUBES.first_look).clamp(1, TUBES.thin_out) as u64;
    let takes_part = |row: u64| one_in(thin_out, row, !ctx.seed);
    let coarse: Vec<Vec3> =
        points.iter().zip(cut.rows).filter(|(_, row)| takes_part(**row)).map(|(p, _)| *p).collect();
    if coarse.is_empty() {
        return Ok(Candidates { found: Vec::new(), covered: vec![false; n] });
    }
    let coarse_tree = Neighbours::build(&coarse, ctx)?;
    let (mut covered, mut looked) = (vec![false; n], vec![false; n]);
    let mut candidates: Vec<Candidate> = Vec::new();
    let unit = |i: usize| f64::from(sampling.spacing[i]).max(0.8 * sigma);
    let look = |i: usize, found: &mut Vec<Neighbour>| {
        TUBES.scales.iter().find_map(|scale| {
            let radius = scale * unit(i);
            coarse_tree.within(points[i], radius, found);
            let near = if found.len() < TUBES.enough {
                tree.within(points[i], radius, found);
                elongated(points, found, radius)
            } else {
                elongated(&coarse, found, radius)
            };
            grow(cut, &near?, found)
        })
    };
    let mut near = Vec::new();
    let mut next = order.iter().map(|&i| i as usize);
    loop {
        ctx.check()?;
        let seeds: Vec<usize> =
            next.by_ref().filter(|&i| !covered[i] && !looked[i]).take(TUBES.at_once).collect();
        if seeds.is_empty() {
            break;
        }
        let grown: Vec<Option<Candidate>> = seeds
            .par_iter()
            .map_init(Vec::new, |found, &i| {
                ctx.check()?;
                Ok(look(i, found))
            })
            .collect::<Result<_>>()?;
        for (i, candidate) in seeds.into_iter().zip(grown) {
            // As if they had been looked at one after another.
            if covered[i] || looked[i] {
                continue;
            }
            // One that the point does not lie on is found again from those that do: strays about a tube would
            // each find it anew.
            let about = candidate.filter(|c| c.members.binary_search(&(i as u32)).is_ok());
            let Some(candidate) = about else {
                tree.within(points[i], 0.5 * TUBES.scales[0] * unit(i), &mut near);
                near.iter().for_each(|f| looked[f.index as usize] = true);
                continue;
            };
            let open = open_ends(&candidate, points);
            for &m in &candidate.members {
                let s = candidate.tube.foot(points[m as usize]).s;
                if (s > -PARTITION.core || open[0]) && (s < PARTITION.core || open[1]) {
                    covered[m as usize] = true;
                }
            }
            candidates.push(candidate);
        }
    }
    Ok(Candidates { found: candidates, covered })
}

/// The neighbourhood of these points, if it is long and round enough for a tube.
fn elongated(points: &[Vec3], found: &[Neighbour], radius: f64) -> Option<Neighbourhood> {
    if found.len() < TUBES.fewest {
        return None;
    }
    let near = found.iter().map(|f| (points[f.index as usize], 1.0));
    let Principal { mean, variances: spread, axes: [_, _, along] } = principal(near)?;
    let tube = spread[1] <= TUBES.elongated * spread[2] && spread[0] >= TUBES.round * spread[1];
    tube.then_some(Neighbourhood { mean, along, radius, spread })
}

/// Whether the data end inside the domain, at either side.
fn open_ends(candidate: &Candidate, points: &[Vec3]) -> [bool; 2] {
    let mut bins = [0usize; BINS];
    for &m in &candidate.members {
        let s = candidate.tube.foot(points[m as usize]).s;
        bins[(((s + 1.0) * 0.5 * BINS as f64).clamp(0.0, BINS as f64 - 1.0)) as usize] += 1;
    }
    let typical = *bins.iter().max().unwrap_or(&0);
    [bins[0] * 5 < typical, bins[BINS - 1] * 5 < typical]
}
