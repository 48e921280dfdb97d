//! What the surface is blended from: the denoised points with their strongest charts.
//!
//! In: points on their charts, and how far apart they lie. Out: a site for each, or for a share of them where
//! noise is so much larger than the spacing that all would say the same.

use super::constants::BLEND;
use crate::atlas::{BlendSite, FittedChart, Membership, ProjectedPoint, SITE_CHARTS};
use crate::error::Result;
use crate::numeric::scatter::one_in;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::spacing::Sampling;
use rayon::prelude::*;

/// Points as far as sites are made of them.
#[derive(Clone, Copy)]
pub(crate) struct Spread<'a> {
    /// How densely they lie.
    pub sampling: &'a Sampling,
    /// Standard deviation of the noise. Charts show nothing finer, so that sites need lie no nearer to each
    /// other, as voxels need not.
    pub sigma: f64,
    /// The points' names, which choose those that sites are made of.
    pub names: &'a [u64],
}

impl Spread<'_> {
    /// How far a point's site stands from the next; none for a point that others stand for.
    fn spacing(&self, point: usize) -> Option<f64> {
        let own = self.sampling.carried(point);
        let share = (self.sigma / (own * BLEND.oversampled)).powi(2) as u64;
        one_in(share, self.names[point], 1).then(|| own.max(self.sigma))
    }
}

/// What the surface needs of the denoised points: position, spacing and strongest charts. Points that no
/// chart claims are left out.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn of_points(
    points: &[Vec3],
    projected: &[ProjectedPoint],
    fitted: &[FittedChart],
    members: &Membership,
    spread: Spread<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<BlendSite>> {
    let site = |i: usize| {
        if projected[i].chart == u32::MAX {
            return None;
        }
        let spacing = spread.spacing(i)?;
        let row = members.of(i);
        let mut best: Vec<(u32, f32)> = row
            .iter()
            .map(|&(c, w)| (c, (fitted[c as usize].chart.weight(points[i]) as f32 + 1e-6) * w))
            .collect();
        best.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut charts = [(u32::MAX, 0.0); SITE_CHARTS];
        for (to, from) in charts.iter_mut().zip(best) {
            *to = from;
        }
        Some(BlendSite { position: projected[i].position, normal: projected[i].normal, spacing, charts })
    };
    points
        .par_chunks(1024)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            Ok((c * 1024..c * 1024 + chunk.len()).filter_map(site).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()
        .map(|v| v.concat())
}
