//! Denoised points: each point moved to where its charts say the surface is.
//!
//! In: points, fitted charts with their members. Out: positions in input order, unit normals, and which points no chart claims
//! (outliers). Charts are blended by a partition of unity, so there is no step where one chart ends.

use crate::atlas::Chart;
use crate::error::Result;
use crate::fit::Fitted;
use crate::geometry::vec3::Vec3;
use crate::run::Context;
use crate::surface::field::{ANCHOR_CHARTS, Anchor};
use rayon::prelude::*;

/// Charts whose members are listed between two checks.
const CHECK_CHARTS: usize = 256;

/// The chart memberships of every point, as compressed rows.
pub struct Membership {
    /// Row starts, one more than there are points.
    pub start: Vec<u32>,
    /// Chart and robust weight.
    pub entries: Vec<(u32, f32)>,
}

impl Membership {
    /// The charts of a point, with their robust weights.
    #[must_use]
    pub fn of(&self, point: usize) -> &[(u32, f32)] {
        &self.entries[self.start[point] as usize..self.start[point + 1] as usize]
    }
}

/// Turns the charts' member lists into per-point lists (charts ascending).
///
/// # Errors
/// Cancelled or out of time.
pub fn membership(points: usize, fitted: &[Fitted], ctx: &Context<'_>) -> Result<Membership> {
    let mut start = vec![0u32; points + 1];
    for (c, f) in fitted.iter().enumerate() {
        if c % CHECK_CHARTS == 0 {
            ctx.check()?;
        }
        for &(m, _) in &f.members {
            start[m as usize + 1] += 1;
        }
    }
    for i in 0..points {
        start[i + 1] += start[i];
    }
    let mut fill = start.clone();
    let mut entries = vec![(0u32, 0f32); start[points] as usize];
    for (c, f) in fitted.iter().enumerate() {
        if c % CHECK_CHARTS == 0 {
            ctx.check()?;
        }
        for &(m, w) in &f.members {
            entries[fill[m as usize] as usize] = (c as u32, w);
            fill[m as usize] += 1;
        }
    }
    Ok(Membership { start, entries })
}

/// A point on the atlas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projected {
    /// Position on the blended surface.
    pub position: Vec3,
    /// Unit normal in the atlas's orientation.
    pub normal: Vec3,
    /// The chart that weighs most; `u32::MAX` where no chart claims the point.
    pub chart: u32,
}

/// Projects every point onto the charts that it belongs to.
///
/// # Errors
/// Cancelled or out of time.
pub fn project_members(
    points: &[Vec3],
    fitted: &[Fitted],
    members: &Membership,
    ctx: &Context<'_>,
) -> Result<Vec<Projected>> {
    points
        .par_chunks(1024)
        .enumerate()
        .map(|(chunk, block)| {
            ctx.check()?;
            Ok(block
                .iter()
                .enumerate()
                .map(|(k, &p)| {
                    let i = chunk * 1024 + k;
                    let row = members.of(i);
                    blend(p, row.iter().map(|&(c, w)| (c, &fitted[c as usize].chart, f64::from(w))))
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()
        .map(|v| v.concat())
}

fn blend<'c>(p: Vec3, charts: impl Iterator<Item = (u32, &'c Chart, f64)>) -> Projected {
    let (mut total, mut at, mut n, mut top, mut best) = (0.0, Vec3::ZERO, Vec3::ZERO, 0.0, u32::MAX);
    for (index, chart, robust) in charts {
        let foot = chart.nearest(p);
        // The small constant keeps points on the very rim with their chart when they have no other.
        let w = (foot.taper + 1e-6) * robust;
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
        return Projected { position: p, normal: Vec3::ZERO, chart: u32::MAX };
    }
    let l = n.norm();
    Projected {
        position: (at * (1.0 / total)),
        normal: if l > 0.0 { n * (1.0 / l) } else { Vec3([0.0, 0.0, 1.0]) },
        chart: best,
    }
}

/// Points carry the surface no farther than if their spacing were this many times the median: beyond, a scan is too thin to show one, and the
/// voxels needed to bridge the gaps grow with the square.
pub(crate) const WIDEST: f64 = 6.0;

/// What the surface needs of the denoised points: position, spacing and strongest charts. Points that no chart claims are left out.
///
/// # Errors
/// Cancelled or out of time.
pub fn anchors(
    points: &[Vec3],
    projected: &[Projected],
    fitted: &[Fitted],
    members: &Membership,
    spacing: &[f32],
    median_spacing: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Anchor>> {
    let limit = WIDEST * median_spacing;
    let anchor = |i: usize| {
        if projected[i].chart == u32::MAX {
            return None;
        }
        let row = members.of(i);
        let mut best: Vec<(u32, f32)> = row
            .iter()
            .map(|&(c, w)| (c, (fitted[c as usize].chart.weight(points[i]) as f32 + 1e-6) * w))
            .collect();
        best.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut charts = [(u32::MAX, 0.0); ANCHOR_CHARTS];
        for (to, from) in charts.iter_mut().zip(best) {
            *to = from;
        }
        Some(Anchor {
            position: projected[i].position,
            normal: projected[i].normal,
            spacing: f64::from(spacing[i]).min(limit),
            charts,
        })
    };
    points
        .par_chunks(1024)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            Ok((c * 1024..c * 1024 + chunk.len()).filter_map(anchor).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()
        .map(|v| v.concat())
}
