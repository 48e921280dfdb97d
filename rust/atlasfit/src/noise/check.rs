//! A first estimate of the noise checked by growing patches with it.
//!
//! In: points, search tree, spacing, the local estimate. Out: the noise.

use super::constants::NOISE;
use super::{NoiseModel, NoiseSource};
use crate::atlas::{Patch, known};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::partition::grow::{GrowParams, explains};
use crate::partition::{PatchSize, grow_all};
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::spacing::Sampling;

/// Checks a first estimate of the noise by growing patches with it, and mends it where the local estimate was
/// misled by sheets that lie close together or by noise as large as the neighbourhoods: with too small a
/// noise few patches explain their points, with the right one most do.
///
/// # Errors
/// Cancelled or out of time.
pub fn by_patches(
    points: &[Vec3],
    tree: &Neighbours,
    sampling: &Sampling,
    estimate: f64,
    relative: &[f32],
    ctx: &Context<'_>,
) -> Result<NoiseModel> {
    let model = |sigma, source| NoiseModel::new(sigma, source, sampling.median);
    let kept = model(estimate, NoiseSource::Quadrics);
    let step = points.len().div_ceil(NOISE.trials).max(1);
    let share = |sigma: f64| -> Result<f64> {
        let seeds: Vec<usize> = (0..points.len()).step_by(step).collect();
        let params = |i: usize| {
            let sigma = sigma * known::relative_noise(relative, i);
            let spacing = f64::from(sampling.spacing[i]);
            GrowParams {
                sigma,
                spacing,
                max_radius: PatchSize::default().reach(spacing, sigma),
                earlier: None,
                only: None,
            }
        };
        let explained = |i: usize, p: &Patch| {
            p.accepted && explains(p.residual, p.radii[0].min(p.radii[1]), params(i).sigma)
        };
        let grown = grow_all(points, tree, &seeds, params, |_| (), ctx)?;
        let grown = seeds.iter().zip(&grown).filter_map(|(&i, p)| Some((i, p.as_ref()?)));
        let (yes, all) = grown.fold((0u32, 0u32), |(y, a), (i, p)| (y + u32::from(explained(i, p)), a + 1));
        Ok(if all == 0 { 0.0 } else { f64::from(yes) / f64::from(all) })
    };
    // Patches follow a tenth of the spacing whatever the noise: below that the test says nothing.
    let floor = 0.12 * sampling.median;
    if !(floor > 0.0 && estimate >= floor) {
        return Ok(kept);
    }
    let half = |below: (f64, f64), above: (f64, f64)| {
        // Linear in log sigma between two guesses.
        let t = ((0.5 - below.1) / (above.1 - below.1).max(1e-9)).clamp(0.0, 1.0);
        below.0 * (above.0 / below.0).powf(t)
    };
    let mut at = (estimate, share(estimate)?);
    let crossing = if at.1 < 0.5 {
        loop {
            let next = at.0 * NOISE.guess_step;
            // No scan's noise exceeds a tenth of its size.
            if next > 0.1 {
                break at.0;
            }
            let found = (next, share(next)?);
            if found.1 >= 0.5 {
                break half(at, found);
            }
            at = found;
        }
    } else {
        // Patches of full size explain all that a spline can follow, whatever the noise.
        let followed = PARTITION.followed * PARTITION.patch_spacings * sampling.median;
        let least = floor.max(followed / PARTITION.explained);
        loop {
            let next = at.0 / NOISE.guess_step;
            if next < least {
                return Ok(kept);
            }
            let found = (next, share(next)?);
            if found.1 < 0.5 {
                break half(found, at);
            }
            at = found;
        }
    };
    let blur = ((crossing / sampling.median - 0.4) / 0.6).clamp(0.0, 1.0);
    let tested = crossing
        / (NOISE.half_accepted_below + (NOISE.half_accepted_above - NOISE.half_accepted_below) * blur);
    // The local estimate is the finer instrument where the two agree.
    Ok(if (0.7..1.35).contains(&(estimate / tested)) { kept } else { model(tested, NoiseSource::Patches) })
}
