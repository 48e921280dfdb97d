//! The surface with fewer triangles.
//!
//! In: the surface, the scan's points on the charts, how dense they are. Out: the same surface with triangles
//! about as many as the points: where it is flat within its own uncertainty, they are larger.

use super::constants::PIPELINE;
use super::options::DenoiseOptions;
use super::warnings;
use crate::atlas::ProjectedPoint;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use crate::simplify::{Dense, Goal, simplify};
use crate::spatial::spacing::Sampling;

/// What the scan says of its surface. Lengths are in the normalised frame.
pub(super) struct Known<'a> {
    /// The scan's points on the charts.
    pub(super) projected: &'a [ProjectedPoint],
    /// How dense they are.
    pub(super) sampling: &'a Sampling,
    /// Standard deviation of their noise.
    pub(super) noise: f64,
    /// How many charts there are.
    pub(super) charts: usize,
    /// Length of the frame's unit in the scan's.
    pub(super) scale: f64,
}

/// Simplifies the surface as the options say; returns what to tell the user.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn lighten(
    s: &mut Surface,
    options: &DenoiseOptions,
    known: &Known<'_>,
    ctx: &Context<'_>,
) -> Result<Option<String>> {
    if options.max_error == Some(0.0) || options.watertight {
        return Ok(None);
    }
    let n = s.positions.len();
    let goal = if options.faces.is_none() && options.max_error.is_none() {
        let spacing = spacing_of_charts(known);
        let at = |c: &u32| spacing.get(*c as usize).copied().unwrap_or(known.sampling.median);
        let finer = |length: f64| (length / options.detail) as f32;
        let error = |h: f64| finer((PIPELINE.light_noise * known.noise).max(PIPELINE.light_spacing * h));
        Goal {
            faces: 0,
            error: s.chart.iter().map(|c| error(at(c))).collect(),
            longest: s.chart.iter().map(|c| finer(PIPELINE.light_edge * at(c))).collect(),
        }
    } else {
        // No surface is larger than the frame.
        let error = options.max_error.map_or(1.0, |e| e / known.scale) as f32;
        let (error, longest) = (ctx.filled(error, n)?, ctx.filled(f32::INFINITY, n)?);
        Goal { faces: options.faces.unwrap_or(0), error, longest }
    };
    let dense = Dense { positions: &s.positions, normals: &s.normals, triangles: &s.triangles };
    let light = simplify(&dense, &goal, ctx)?;
    s.chart = light.from.iter().map(|&v| s.chart[v as usize]).collect();
    (s.positions, s.normals, s.triangles) = (light.positions, light.normals, light.triangles);
    Ok(warnings::faces_left(options.faces, s.triangles.len()))
}

/// Mean spacing of the points of each chart; the scan's median where one has none.
fn spacing_of_charts(known: &Known<'_>) -> Vec<f64> {
    let mut sum = vec![(0.0, 0.0); known.charts];
    for (p, &h) in known.projected.iter().zip(&known.sampling.spacing) {
        if let Some((total, count)) = sum.get_mut(p.chart as usize) {
            *total += f64::from(h);
            *count += 1.0;
        }
    }
    sum.into_iter().map(|(t, n)| if n > 0.0 { t / n } else { known.sampling.median }).collect()
}
