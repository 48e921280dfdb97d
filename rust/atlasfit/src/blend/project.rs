//! Denoised points: each point moved to where its charts say the surface is.
//!
//! In: points, fitted charts with their members. Out: positions in input order, unit normals, and which
//! points no chart claims (outliers). Charts are blended by a partition of unity, so there is no step where
//! one chart ends.

use crate::atlas::{Chart, FittedChart, Membership, ProjectedPoint};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Projects every point onto the charts that it belongs to.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn project_members(
    points: &[Vec3],
    fitted: &[FittedChart],
    members: &Membership,
    ctx: &Context<'_>,
) -> Result<Vec<ProjectedPoint>> {
    points
        .par_chunks(1024)
        .enumerate()
        .map(|(chunk, block)| {
            ctx.check()?;
            Ok(block
                .iter()
                .enumerate()
                .map(|(k, &p)| project_member(p, fitted, members.of(chunk * 1024 + k)))
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()
        .map(|v| v.concat())
}

/// Projects a point onto charts, given with their weights.
pub(crate) fn project_member(p: Vec3, fitted: &[FittedChart], of: &[(u32, f32)]) -> ProjectedPoint {
    blend(p, of.iter().map(|&(c, w)| (c, &fitted[c as usize].chart, f64::from(w))))
}

fn blend<'c>(p: Vec3, charts: impl Iterator<Item = (u32, &'c Chart, f64)>) -> ProjectedPoint {
    let (mut total, mut at, mut n, mut top, mut best) = (0.0, Vec3::ZERO, Vec3::ZERO, 0.0, u32::MAX);
    for (index, chart, robust) in charts {
        let foot = chart.nearest(p);
        // The small constant keeps points on the very rim with their chart when they have no other.
        let w = (foot.weight + 1e-6) * robust;
        if w <= 0.0 {
            continue;
        }
        at += foot.position * w;
        let m = foot.normal * chart.sign;
        let m = if n.dot(m) < 0.0 { -m } else { m };
        n += m * w;
        total += w;
        if w > top {
            (top, best) = (w, index);
        }
    }
    if total <= 0.0 {
        return ProjectedPoint { position: p, normal: Vec3::ZERO, chart: u32::MAX };
    }
    let l = n.norm();
    ProjectedPoint {
        position: (at * (1.0 / total)),
        normal: if l > 0.0 { n * (1.0 / l) } else { Vec3([0.0, 0.0, 1.0]) },
        chart: best,
    }
}
