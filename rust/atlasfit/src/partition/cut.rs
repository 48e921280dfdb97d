//! What patches are cut from, and how large they should be.

use super::constants::PARTITION;
use super::grow::{GrowParams, Scratch, grow};
use super::slab;
use crate::atlas::{Patch, ProjectedPoint, known};
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::neighbours::Neighbour;
use crate::spatial::spacing::{NAMED, Sampling};
use rayon::prelude::*;

/// How large patches should be: in point spacings, so that a patch holds about a hundred points, and in
/// standard deviations of the noise, so that averaging can beat the noise; whichever is larger.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PatchSize {
    /// Radius in point spacings.
    pub spacings: f64,
    /// Radius in standard deviations of the noise.
    pub sigmas: f64,
}

impl Default for PatchSize {
    fn default() -> Self {
        Self { spacings: PARTITION.patch_spacings, sigmas: PARTITION.patch_sigmas }
    }
}

impl PatchSize {
    /// The size that cuts a surface of `points` points into about `charts` patches.
    pub(crate) fn for_count(self, charts: usize, points: usize) -> Self {
        // Seeds stand about 0.75 radii apart, so a patch advances the cover by about half its radius squared.
        let spacings = (points as f64 / charts as f64 / 0.5).sqrt().clamp(3.0, 40.0);
        Self { spacings, sigmas: self.sigmas }
    }
    /// The radius that a patch may have.
    pub(crate) fn reach(self, spacing: f64, sigma: f64) -> f64 {
        (self.spacings * spacing).max(self.sigmas * sigma)
    }
}

/// The patches on the two sides of a thin wall, each with the point that it grew from.
pub(super) type Slab = [(usize, Patch); 2];

/// What patches are cut from.
#[derive(Clone, Copy)]
pub(crate) struct Cut<'a> {
    /// The scan's points.
    pub points: &'a [Vec3],
    /// Their search tree.
    pub tree: &'a Neighbours,
    /// How densely they lie.
    pub sampling: &'a Sampling,
    /// Their usual noise, standard deviation along the normal.
    pub sigma: f64,
    /// The noise at each point, as a multiple of the usual; empty where it is the same everywhere.
    pub relative: &'a [f32],
    /// How large patches should be.
    pub size: PatchSize,
    /// Which of the whole scan's points each is.
    pub rows: &'a [u64],
    /// Points of the whole scan, of which these may be a tile.
    pub whole: usize,
}

#[cfg(test)]
impl<'a> Cut<'a> {
    /// A whole scan with the same noise everywhere.
    pub(crate) fn whole(
        points: &'a [Vec3],
        tree: &'a Neighbours,
        sampling: &'a Sampling,
        sigma: f64,
    ) -> Self {
        let (size, whole) = (PatchSize::default(), points.len());
        Self { points, tree, sampling, sigma, relative: &[], size, rows: &[], whole }
    }
}

impl Cut<'_> {
    /// The radius that a patch about a point may have where the usual noise is `sigma`.
    pub(super) fn reach(&self, point: usize, sigma: f64) -> f64 {
        let sigma = sigma * self.relative_noise(point);
        self.size.reach(self.sampling.carried(point), sigma)
    }
    /// The radius that a patch about a point may have whose neighbours are denser: a stray's would span all
    /// of the surface that is near.
    fn reach_of_others(&self, point: usize, sigma: f64) -> f64 {
        let mut found = Vec::new();
        self.tree.nearest(self.points[point], NAMED + 1, &mut found);
        let mut spacings: Vec<f64> = found.iter().map(|f| self.sampling.carried(f.index as usize)).collect();
        let sigma = sigma * self.relative_noise(point);
        self.size.reach(PARTITION.sparser * median(&mut spacings), sigma)
    }
    /// The noise at a point, as a multiple of the usual.
    pub(crate) fn relative_noise(&self, point: usize) -> f64 {
        known::relative_noise(self.relative, point)
    }
    /// Grows a patch from each of the points `seeds`, a step of the running stage each. `earlier` is where an
    /// earlier fit put the points.
    pub(super) fn grow(
        &self,
        seeds: &[usize],
        sigma: f64,
        earlier: Option<&[ProjectedPoint]>,
        ctx: &Context<'_>,
    ) -> Result<Vec<Option<Patch>>> {
        let params = |i: usize| {
            let spacing = f64::from(self.sampling.spacing[i]);
            GrowParams {
                sigma: sigma * self.relative_noise(i),
                spacing,
                max_radius: self.reach(i, sigma).min(self.reach_of_others(i, sigma)),
                earlier,
                only: None,
            }
        };
        grow_all(self.points, self.tree, seeds, params, |grown| ctx.advance(grown), ctx)
    }
    /// Looks for two sheets about the seeds whose patches leave more residual than one sheet does, a pair of
    /// patches for each where there are two.
    pub(super) fn grow_slabs(
        &self,
        seeds: &[usize],
        grown: &[Option<Patch>],
        ctx: &Context<'_>,
    ) -> Result<Vec<Option<Slab>>> {
        let of = |k: usize, found: &mut Vec<Neighbour>, scratch: &mut Scratch| {
            let (seed, patch) = (seeds[k], grown[k].as_ref());
            let reach = self.reach(seed, self.sigma);
            let sigma = self.sigma * self.relative_noise(seed);
            if patch.is_some_and(|p| p.accepted && p.residual < PARTITION.one_sheet * sigma) {
                return Ok(None);
            }
            self.tree.within(self.points[seed], reach, found);
            // In a clump of copies there is nothing to tell apart, and much to look at.
            if found.len() > PARTITION.max_found {
                return Ok(None);
            }
            let Some(sides) = slab::sides(self.points, found, reach, sigma, patch) else { return Ok(None) };
            let mut patches = Vec::new();
            for mut side in sides {
                // The nearest come first.
                let seed = side[0] as usize;
                side.sort_unstable();
                let spacing = f64::from(self.sampling.spacing[seed]);
                let params =
                    GrowParams { sigma, spacing, max_radius: reach, earlier: None, only: Some(&side) };
                match grow(self.points, self.tree, seed, &params, scratch, ctx)? {
                    Some(patch) if patch.accepted => patches.push((seed, patch)),
                    _ => return Ok(None),
                }
            }
            Ok(Slab::try_from(patches).ok())
        };
        let order: Vec<usize> = (0..seeds.len()).collect();
        let found = order
            .par_chunks(8)
            .map(|chunk| {
                ctx.check()?;
                let (mut found, mut scratch) = (Vec::new(), Scratch::default());
                chunk.iter().map(|&k| of(k, &mut found, &mut scratch)).collect::<Result<Vec<_>>>()
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(found.into_iter().flatten().collect())
    }
}

/// Grows a patch from each of the points `seeds`, each with `params` of its own, in parallel, and tells how
/// many have grown.
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
            let grow = |&i: &usize| grow(points, tree, i, &params(i), &mut scratch, ctx);
            let out = chunk.iter().map(grow).collect::<Result<Vec<_>>>()?;
            progress(chunk.len());
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(grown.concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn no_patch_of_a_stray_spans_the_dense_surface_that_is_near() {
        // A ball of surface, and one point as far off it as it is wide.
        let golden = 2.4;
        let mut points: Vec<Vec3> = (0..3000)
            .map(|i| {
                let z = 2.0 * (f64::from(i) + 0.5) / 3000.0 - 1.0;
                let (r, angle) = ((1.0 - z * z).sqrt(), golden * f64::from(i));
                Vec3([r * angle.cos(), r * angle.sin(), z])
            })
            .collect();
        points.push(Vec3([2.0, 0.0, 0.0]));
        let mut spacing = vec![0.065; points.len()];
        spacing[3000] = 1.0;
        let sampling = Sampling::new(spacing);
        let grown = Run::default().execute(|ctx| {
            let tree = Neighbours::build(&points, ctx)?;
            Cut::whole(&points, &tree, &sampling, 0.005).grow(&[0, 3000], 0.005, None, ctx)
        });
        let grown = grown.unwrap();
        assert!(grown[0].as_ref().is_some_and(|p| p.accepted && p.members.len() > 50));
        assert!(grown[1].as_ref().is_none_or(|p| p.members.len() < 200), "{:?}", grown[1]);
    }
}
