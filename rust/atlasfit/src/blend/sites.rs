//! What the surface is blended from: the denoised points with their strongest charts.

use crate::atlas::{BlendSite, FittedChart, Membership, ProjectedPoint, SITE_CHARTS};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::constants::SPATIAL;
use crate::spatial::spacing::Sampling;
use rayon::prelude::*;

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
    sampling: &Sampling,
    ctx: &Context<'_>,
) -> Result<Vec<BlendSite>> {
    let limit = SPATIAL.widest * sampling.median;
    let site = |i: usize| {
        if projected[i].chart == u32::MAX {
            return None;
        }
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
        Some(BlendSite {
            position: projected[i].position,
            normal: projected[i].normal,
            spacing: f64::from(sampling.spacing[i]).min(limit),
            charts,
        })
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
