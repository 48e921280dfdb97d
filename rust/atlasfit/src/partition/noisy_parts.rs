//! Parts of a scan that are noisier than the rest: at grazing angles, where several sweeps overlap askew.
//!
//! In: seeds whose patches the scan's noise does not explain. Out: patches grown with more noise, where a
//! whole part of the scan asks for it.

use super::Cut;
use super::constants::PARTITION;
use crate::atlas::{Patch, ProjectedPoint};
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;

/// Where the noise is larger than usual.
pub(super) struct NoisyParts {
    /// The first round's seeds.
    tree: Neighbours,
    /// Whether the usual noise explains the points about each.
    explained: Vec<bool>,
}

/// Whether a patch was grown and explains its points.
pub(super) fn accepted(patch: &Option<Patch>) -> bool {
    patch.as_ref().is_some_and(|p| p.accepted)
}

/// Whether a patch's noise is not too large for the spacing of its points. One from a stray may be wide
/// enough for its seed, and take surface whose points are much denser.
fn may_be_noisy(cut: &Cut<'_>, patch: &Patch) -> bool {
    let mut spacings: Vec<f64> =
        patch.members.iter().map(|m| f64::from(cut.sampling.spacing[*m as usize])).collect();
    patch.sigma <= PARTITION.most_noise * median(&mut spacings).max(cut.sampling.median)
}

impl NoisyParts {
    /// From seeds and what has grown from each.
    pub(super) fn new(seeds: &[Vec3], grown: &[Option<Patch>], ctx: &Context<'_>) -> Result<Self> {
        Ok(Self { tree: Neighbours::build(seeds, ctx)?, explained: grown.iter().map(accepted).collect() })
    }
    fn contains(&self, p: Vec3) -> bool {
        let mut near = Vec::new();
        self.tree.nearest(p, PARTITION.asked, &mut near);
        near.iter().filter(|n| !self.explained[n.index as usize]).count() >= PARTITION.unexplained
    }
    /// Grows the seeds in noisy parts again with more and more noise, each while it is not explained and the
    /// noise is not too large for the spacing there.
    pub(super) fn grow_again(
        &self,
        cut: &Cut<'_>,
        seeds: &[usize],
        grown: &mut [Option<Patch>],
        earlier: Option<&[ProjectedPoint]>,
        ctx: &Context<'_>,
    ) -> Result<()> {
        let mut left: Vec<usize> = (0..seeds.len())
            .filter(|&k| !accepted(&grown[k]) && self.contains(cut.points[seeds[k]]))
            .collect();
        let mut sigma = cut.sigma;
        while !left.is_empty() {
            ctx.check()?;
            sigma *= PARTITION.more_noise;
            left.retain(|&k| {
                let spacing = f64::from(cut.sampling.spacing[seeds[k]]).max(cut.sampling.median);
                sigma * cut.relative_noise(seeds[k]) <= PARTITION.most_noise * spacing
            });
            let again: Vec<usize> = left.iter().map(|&k| seeds[k]).collect();
            for (&k, patch) in left.iter().zip(cut.grow(&again, sigma, earlier, ctx)?) {
                if let Some(patch) = patch.filter(|p| p.accepted && may_be_noisy(cut, p)) {
                    grown[k] = Some(patch);
                }
            }
            left.retain(|&k| !accepted(&grown[k]));
        }
        Ok(())
    }
}
