//! Cutting a scan into overlapping disk-like patches that cover it.
//!
//! In: points, search tree, spacing, noise. Out: patches; every point that lies on a surface is well inside at least one.
//! Seeds are spread as a Poisson-disk sample of the points not yet covered; all patches of one round grow in parallel, so the
//! result does not depend on the number of threads.

pub mod grow;
pub mod tubes;

use crate::atlas::FittedChart;
use crate::atlas::Map;
use crate::atlas::Patch;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::rng::shuffled;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use crate::spatial::spacing::Sampling;
use crate::spatial::spacing::WIDEST;
use grow::{GrowParams, MIN_MEMBERS, Scratch, across, grow};
use rayon::prelude::*;

/// A point counts as covered by a patch when it lies within this share of the domain: there the blend weight of the patch is
/// still substantial.
const CORE: f64 = 0.72;
/// Noise may be larger in parts of a scan: at grazing angles, where several sweeps overlap askew. There a greater noise is tried, in steps of this
/// factor, ...
const LOUDER: f64 = 1.6;
/// ... up to this share of the point spacing: beyond it, two sheets of a thin wall would pass for one noisy one.
const LOUDEST: f64 = 0.6;
/// A part is loud when of this many seeds nearest to a place at least this many cannot be explained with the scan's noise. On even noise
/// one in thirty cannot.
const LOUD: (usize, usize) = (2, 6);
/// A sheet farther from a patch than this many standard deviations and this share of the patch's reach cannot keep it from growing.
const DISTURBING: (f64, f64) = (6.0, 0.15);
/// Patches smaller than this share of what they may reach wait until others are there ...
const SMALL: f64 = 0.4;
/// ... and are used, if they do not explain their points, where at least this share of them has no other.
const ALONE: f64 = 0.25;
/// Rounds of seeding. Each round seeds what the previous ones left, more densely.
const ROUNDS: usize = 5;

/// How large patches should be: in point spacings (so that a patch holds about a hundred points) and in noise standard deviations (so
/// that averaging can beat the noise), whichever is larger.
#[derive(Debug, Clone, Copy)]
pub struct PatchSize {
    /// Radius in point spacings.
    pub spacings: f64,
    /// Radius in standard deviations of the noise.
    pub sigmas: f64,
}

impl PatchSize {
    /// The size that cuts a surface of `points` points into about `charts` patches.
    #[must_use]
    pub fn for_count(self, charts: usize, points: usize) -> Self {
        // Seeds stand about 0.75 radii apart, so a patch advances the cover by about half its radius squared.
        let spacings = (points as f64 / charts as f64 / 0.5).sqrt().clamp(3.0, 40.0);
        Self { spacings, sigmas: self.sigmas }
    }
    /// The radius that a patch may have.
    #[must_use]
    pub fn reach(self, spacing: f64, sigma: f64) -> f64 {
        (self.spacings * spacing).max(self.sigmas * sigma)
    }
}

/// The default patch size.
pub const PATCH_SIZE: PatchSize = PatchSize { spacings: 6.0, sigmas: 7.0 };

/// What patches are cut from.
#[derive(Clone, Copy)]
pub struct Cut<'a> {
    /// The scan's points.
    pub points: &'a [Vec3],
    /// Their search tree.
    pub tree: &'a Neighbours,
    /// How densely they lie.
    pub sampling: &'a Sampling,
    /// Their noise, standard deviation along the normal.
    pub sigma: f64,
    /// How large patches should be.
    pub size: PatchSize,
}

impl Cut<'_> {
    /// The radius that a patch about a point may have.
    fn reach(&self, point: usize, sigma: f64) -> f64 {
        // Where points stand farther apart than this there is no surface to show, only strays.
        let widest = WIDEST * self.sampling.median;
        self.size.reach(f64::from(self.sampling.spacing[point]).min(widest), sigma)
    }
    /// Grows a patch from each of the points `seeds`.
    fn grow(
        &self,
        seeds: &[usize],
        sigma: f64,
        seen: Option<&[ProjectedPoint]>,
        ctx: &Context<'_>,
    ) -> Result<Vec<Option<Patch>>> {
        let params = |i: usize| {
            let spacing = f64::from(self.sampling.spacing[i]);
            GrowParams { sigma, spacing, max_radius: self.reach(i, sigma), seen }
        };
        grow_all(self.points, self.tree, seeds, params, |grown| ctx.advance(grown), ctx)
    }
}

/// Grows a patch from each of the points `seeds`, each with `params` of its own, in parallel, and tells how many have grown.
pub(crate) fn grow_all<'a>(
    points: &[Vec3],
    tree: &Neighbours,
    seeds: &[usize],
    params: impl Fn(usize) -> GrowParams<'a> + Sync,
    progress: impl Fn(usize) + Sync,
    ctx: &Context<'_>,
) -> Result<Vec<Option<Patch>>> {
    let grown = seeds
        .par_chunks(8)
        .map(|chunk| {
            let mut scratch = Scratch::default();
            let grow = |&i: &usize| {
                ctx.check()?;
                Ok(grow(points, tree, i, &params(i), &mut scratch))
            };
            let out = chunk.iter().map(grow).collect::<Result<Vec<_>>>()?;
            progress(chunk.len());
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(grown.concat())
}

/// Patches of a sample that the noise is learned from.
const SAMPLE: usize = 100;

/// Patches about some of the points, evenly spread over those that are not `done`.
///
/// # Errors
/// Cancelled or out of time.
pub fn sample(cut: &Cut<'_>, done: &[bool], ctx: &Context<'_>) -> Result<Vec<Patch>> {
    let order = shuffled(cut.points.len(), ctx.seed).into_iter().map(|i| i as usize);
    let seeds: Vec<usize> = order.filter(|&i| !done[i]).take(SAMPLE).collect();
    // Grown here, fitted by the caller.
    ctx.stage(crate::run::Stage::Partition, 2 * seeds.len());
    let grown = cut.grow(&seeds, cut.sigma, None, ctx)?;
    let sound: Vec<Patch> = grown.into_iter().flatten().filter(|p| p.sound).collect();
    ctx.advance(seeds.len() - sound.len());
    Ok(sound)
}

/// Cuts the scan, as far as it is not `done` by other charts. Where an earlier fit has `seen` the points, no patch takes points from the other side of a
/// wall or a gap.
///
/// # Errors
/// Cancelled or out of time.
pub fn partition(
    cut: &Cut<'_>,
    done: &[bool],
    seen: Option<&[ProjectedPoint]>,
    ctx: &Context<'_>,
) -> Result<Vec<Patch>> {
    let Cut { points, tree, sampling, sigma, .. } = *cut;
    let n = points.len();
    let sound = |p: &Option<Patch>| p.as_ref().is_some_and(|p| p.sound);
    let mut loud: Option<Loud> = None;
    let order = shuffled(n, ctx.seed);
    let mut covered = done.to_vec();
    let mut patches: Vec<Patch> = Vec::new();
    let mut found = Vec::new();
    for round in 0..ROUNDS {
        // Poisson-disk seeds among the uncovered points.
        let shrink = 0.62 * 0.6f64.powi(round as i32);
        let mut taken = covered.clone();
        let mut seeds = Vec::new();
        for &i in &order {
            let i = i as usize;
            if taken[i] {
                continue;
            }
            seeds.push(i);
            taken[i] = true;
            tree.within(points[i], shrink * cut.reach(i, sigma), &mut found);
            for f in &found {
                taken[f.index as usize] = true;
            }
            if seeds.len() % 16 == 0 {
                ctx.check()?;
            }
        }
        if seeds.is_empty() {
            break;
        }
        ctx.stage(crate::run::Stage::Partition, seeds.len());
        let mut grown = cut.grow(&seeds, sigma, seen, ctx)?;
        if loud.is_none() {
            let at: Vec<Vec3> = seeds.iter().map(|&i| points[i]).collect();
            loud =
                Some(Loud { tree: Neighbours::build(&at, ctx)?, sound: grown.iter().map(sound).collect() });
        }
        // Seeds in loud parts, each while it is not explained and the noise not too large for the spacing there.
        let mut left: Vec<usize> = (0..seeds.len())
            .filter(|&k| !sound(&grown[k]) && loud.as_ref().is_some_and(|l| l.at(points[seeds[k]])))
            .collect();
        let mut level = sigma;
        while !left.is_empty() {
            ctx.check()?;
            level *= LOUDER;
            left.retain(|&k| {
                let spacing = f64::from(sampling.spacing[seeds[k]]).max(sampling.median);
                level <= LOUDEST * spacing
            });
            let again = cut.grow(&left.iter().map(|&k| seeds[k]).collect::<Vec<_>>(), level, seen, ctx)?;
            for (&k, patch) in left.iter().zip(again) {
                if sound(&patch) {
                    grown[k] = patch;
                }
            }
            left.retain(|&k| !sound(&grown[k]));
        }
        for (seed, patch) in seeds.into_iter().zip(grown) {
            let Some(patch) = patch else { continue };
            // A patch that another of this round has made superfluous is dropped: fewer charts, same cover.
            if (covered[seed] && round > 0) || (!patch.sound && round + 1 < ROUNDS) {
                continue;
            }
            // A stray's patch stays small and stands across what lies about it: one is used only where others leave it alone.
            let alone = patch.members.iter().filter(|m| !covered[**m as usize]).count() as f64;
            let small = patch.radii[0].max(patch.radii[1]) < SMALL * cut.reach(seed, sigma);
            if small && (round == 0 || (!patch.sound && alone < ALONE * patch.members.len() as f64)) {
                continue;
            }
            for &m in &patch.members {
                let d = points[m as usize] - patch.center;
                let (u, v) = (d.dot(patch.axes[0]) / patch.radii[0], d.dot(patch.axes[1]) / patch.radii[1]);
                if u * u + v * v < CORE * CORE {
                    covered[m as usize] = true;
                }
            }
            debug_assert!(patch.members.len() >= MIN_MEMBERS);
            patches.push(patch);
        }
    }
    Ok(patches)
}

/// Leaves out the charts whose patch had another sheet within its reach: there they were kept small, or took some of its points. Returns for each point
/// whether it needs no other chart, as those that are `done` do, or nothing if all charts may stay.
///
/// # Errors
/// Cancelled or out of time.
pub fn keep(
    cut: &Cut<'_>,
    fitted: &mut Vec<FittedChart>,
    done: &[bool],
    seen: &[ProjectedPoint],
    ctx: &Context<'_>,
) -> Result<Option<Vec<bool>>> {
    let Cut { points, tree, sampling: _, sigma, .. } = *cut;
    let stays = |f: &FittedChart, found: &mut Vec<Neighbour>| {
        let Map::Monge(map) = &f.chart.map else { return true };
        let center = map.at([0.0; 2]);
        tree.nearest(center.position, 1, found);
        let reach = found.first().map_or(0.0, |n| cut.reach(n.index as usize, sigma));
        tree.within(center.position, grow::RIM * reach, found);
        let at = (center.position, center.normal * f.chart.sign);
        let disturbing = DISTURBING.0 * sigma + DISTURBING.1 * reach;
        !found.iter().any(|n| {
            let other = &seen[n.index as usize];
            (other.position - at.0).dot(at.1).abs() < disturbing && across(at, other, sigma)
        })
    };
    let stays = fitted
        .par_chunks(64)
        .map(|chunk| {
            ctx.check()?;
            let mut found = Vec::new();
            Ok(chunk.iter().map(|f| stays(f, &mut found)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    if stays.iter().all(|s| *s) {
        return Ok(None);
    }
    // Points that the charts before could not reach stay without one.
    let mut covered = vec![true; seen.len()];
    let mut of = stays.iter();
    fitted.retain(|f| {
        let stays = of.next().is_some_and(|s| *s);
        if !stays {
            f.members.iter().for_each(|&(m, _)| covered[m as usize] = false);
        }
        stays
    });
    for f in fitted.iter() {
        let Map::Monge(map) = &f.chart.map else { continue };
        for &(m, _) in &f.members {
            let l = map.local(points[m as usize]);
            covered[m as usize] |= l.u * l.u + l.v * l.v < CORE * CORE;
        }
    }
    covered.iter_mut().zip(done).for_each(|(c, d)| *c |= d);
    Ok(Some(covered))
}

/// Where in the scan the noise is larger than its usual.
struct Loud {
    /// The first round's seeds.
    tree: Neighbours,
    /// Whether the usual noise explains the points about each.
    sound: Vec<bool>,
}

impl Loud {
    fn at(&self, p: Vec3) -> bool {
        let mut near = Vec::new();
        self.tree.nearest(p, LOUD.1, &mut near);
        near.iter().filter(|n| !self.sound[n.index as usize]).count() >= LOUD.0
    }
}
