//! Covering a scan with patches.
//!
//! In: what patches are cut from. Out: patches. Seeds are spread as a Poisson-disk sample of the points not
//! yet covered; all patches of one round grow in parallel, so the result does not depend on the number of
//! threads.

use super::Cut;
use super::constants::PARTITION;
use super::noisy_parts::NoisyParts;
use crate::atlas::{Patch, ProjectedPoint};
use crate::error::Result;
use crate::numeric::scatter::by_name;
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use std::collections::BTreeSet;

/// Patches about some of the points, evenly spread over those that are not `done`.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn sample(cut: &Cut<'_>, done: &[bool], ctx: &Context<'_>) -> Result<Vec<Patch>> {
    let order = by_name(cut.rows, ctx.seed, ctx)?.into_iter().map(|i| i as usize);
    let seeds: Vec<usize> = order.filter(|&i| !done[i]).take(PARTITION.sample).collect();
    // Grown here, fitted by the caller.
    ctx.stage(Stage::Partition, 2 * seeds.len());
    let grown = cut.grow(&seeds, cut.sigma, None, ctx)?;
    let accepted: Vec<Patch> = grown.into_iter().flatten().filter(|p| p.accepted).collect();
    ctx.advance(seeds.len() - accepted.len());
    Ok(accepted)
}

/// Cuts the scan, as far as it is not `done` by other charts. Where an `earlier` fit has projected the
/// points, no patch takes points of an opposing sheet. `thin_walls` says whether two sheets are looked for
/// where one leaves more than the noise.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn partition(
    cut: &Cut<'_>,
    done: &[bool],
    earlier: Option<&[ProjectedPoint]>,
    thin_walls: bool,
    ctx: &Context<'_>,
) -> Result<Vec<Patch>> {
    let order = by_name(cut.rows, ctx.seed, ctx)?;
    let mut cover = Cover { cut, covered: done.to_vec(), patches: Vec::new(), known: BTreeSet::new() };
    let mut noisy: Option<NoisyParts> = None;
    for round in 0..PARTITION.rounds {
        let seeds =
            cover.seeds(&order, PARTITION.first_distance * PARTITION.closer.powi(round as i32), ctx)?;
        if seeds.is_empty() {
            break;
        }
        ctx.stage(Stage::Partition, seeds.len());
        let mut grown = cut.grow(&seeds, cut.sigma, earlier, ctx)?;
        let slabs = if thin_walls {
            cut.grow_slabs(&seeds, &grown, ctx)?
        } else {
            seeds.iter().map(|_| None).collect()
        };
        if noisy.is_none() {
            let at: Vec<Vec3> = seeds.iter().map(|&i| cut.points[i]).collect();
            noisy = Some(NoisyParts::new(&at, &grown, ctx)?);
        }
        if let Some(noisy) = &noisy {
            noisy.grow_again(cut, &seeds, &mut grown, earlier, ctx)?;
        }
        for ((seed, patch), slab) in seeds.into_iter().zip(grown).zip(slabs) {
            match (slab, patch) {
                (Some(sides), _) => {
                    sides.into_iter().for_each(|(seed, patch)| cover.offer(seed, patch, round));
                }
                (None, Some(patch)) => cover.offer(seed, patch, round),
                (None, None) => {}
            }
        }
    }
    Ok(cover.patches)
}

/// The patches so far, and the points that lie well inside them.
struct Cover<'a> {
    cut: &'a Cut<'a>,
    covered: Vec<bool>,
    patches: Vec<Patch>,
    /// Centres of the patches, as bits.
    known: BTreeSet<[u64; 3]>,
}

impl Cover<'_> {
    /// Poisson-disk seeds among the uncovered points, in this order, `distance` reaches apart.
    fn seeds(&self, order: &[u32], distance: f64, ctx: &Context<'_>) -> Result<Vec<usize>> {
        let Cut { points, tree, sigma, .. } = *self.cut;
        let mut taken = self.covered.clone();
        let (mut seeds, mut found) = (Vec::new(), Vec::new());
        for &i in order {
            let i = i as usize;
            if taken[i] {
                continue;
            }
            seeds.push(i);
            taken[i] = true;
            tree.within(points[i], distance * self.cut.reach(i, sigma), &mut found);
            for f in &found {
                taken[f.index as usize] = true;
            }
            if seeds.len() % 16 == 0 {
                ctx.check()?;
            }
        }
        Ok(seeds)
    }

    /// Takes a patch of this round if it serves.
    fn offer(&mut self, seed: usize, patch: Patch, round: usize) {
        // A patch that another of this round has made superfluous is dropped: fewer charts, same cover.
        if (self.covered[seed] && round > 0) || (!patch.accepted && round + 1 < PARTITION.rounds) {
            return;
        }
        // A stray's patch stays small and stands across what lies about it: one is used only where others
        // leave it alone.
        let alone = patch.members.iter().filter(|m| !self.covered[**m as usize]).count() as f64;
        let small =
            patch.radii[0].max(patch.radii[1]) < PARTITION.small * self.cut.reach(seed, self.cut.sigma);
        if small && (round == 0 || (!patch.accepted && alone < PARTITION.alone * patch.members.len() as f64))
        {
            return;
        }
        for &m in &patch.members {
            let d = self.cut.points[m as usize] - patch.center;
            let (u, v) = (d.dot(patch.axes[0]) / patch.radii[0], d.dot(patch.axes[1]) / patch.radii[1]);
            if u * u + v * v < PARTITION.core * PARTITION.core {
                self.covered[m as usize] = true;
            }
        }
        // Seeds at the rim of a patch that cannot grow give the same patch again.
        if !self.known.insert(patch.center.0.map(f64::to_bits)) {
            self.covered[seed] = true;
            return;
        }
        debug_assert!(patch.members.len() >= PARTITION.min_members);
        self.patches.push(patch);
    }
}
