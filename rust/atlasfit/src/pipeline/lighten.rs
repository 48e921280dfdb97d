//! The surface with fewer triangles.
//!
//! In: the surface, the scan's points on the charts, how dense they are. Out: the same surface with triangles
//! about as many as the points: where it is flat within its own uncertainty, they are larger. Those that meet
//! elsewhere than at shared vertices and edges are moved apart.

use super::constants::PIPELINE;
use super::options::DenoiseOptions;
use super::warnings;
use crate::atlas::known::relative_noise;
use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;
use crate::contour::untangle::untangle;
use crate::error::Result;
use crate::run::Context;
use crate::simplify::{Dense, Goal, bound, simplify};

/// What the scan says of its surface. Lengths are in the normalised frame.
pub(super) struct Known<'a> {
    /// The scan as the charts know it.
    pub(super) scan: KnownScan<'a>,
    /// Median spacing of its points.
    pub(super) median_spacing: f64,
    /// Standard deviation of their noise, as usual.
    pub(super) noise: f64,
    /// Length of the frame's unit in the scan's.
    pub(super) scale: f64,
}

/// Simplifies the surface as the options say, and moves faces that meet apart; returns what to tell the user.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn lighten(
    s: &mut Surface,
    projected: &[ProjectedPoint],
    options: &DenoiseOptions,
    known: &Known<'_>,
    ctx: &Context<'_>,
) -> Result<Option<String>> {
    // A solid keeps its triangles: with fewer they could meet. Those that do are moved apart as it is made.
    if options.watertight {
        return Ok(None);
    }
    if options.max_error != Some(0.0) {
        let goal = goal(s, projected, options, known, ctx)?;
        let (positions, normals, triangles) = (&s.positions, &s.normals, &s.triangles);
        let light = simplify(&Dense { positions, normals, triangles, seams: None }, &goal, ctx)?;
        s.chart = light.from.iter().map(|&v| s.chart[v as usize]).collect();
        (s.positions, s.normals, s.triangles) = (light.positions, light.normals, light.triangles);
    }
    untangle(s, ctx)?;
    Ok(warnings::faces_left(options.faces, s.triangles.len()))
}

/// How far the surface is to be simplified.
///
/// # Errors
/// Those of a limited run.
pub(super) fn goal(
    s: &Surface,
    projected: &[ProjectedPoint],
    options: &DenoiseOptions,
    known: &Known<'_>,
    ctx: &Context<'_>,
) -> Result<Goal> {
    let n = s.positions.len();
    Ok(if options.faces.is_none() && options.max_error.is_none() {
        let bounds = bounds(projected, known);
        let usual = Bounds::new(known.median_spacing, known.noise);
        let at = |c: &u32| bounds.get(*c as usize).unwrap_or(&usual);
        let finer = |length: f64| bound(length / options.detail);
        Goal {
            faces: 0,
            error: s.chart.iter().map(|c| finer(at(c).error)).collect(),
            longest: s.chart.iter().map(|c| finer(at(c).longest)).collect(),
            between: false,
        }
    } else {
        // No surface is larger than the frame.
        let error = options.max_error.map_or(1.0, |e| (e / known.scale).min(1.0));
        let error = bound(error);
        let (error, longest) = (ctx.filled(error, n)?, ctx.filled(f32::INFINITY, n)?);
        let between = options.max_error.is_some();
        Goal { faces: options.faces.unwrap_or(0), error, longest, between }
    })
}

/// How far the surface may be simplified about a chart, at a detail of 1.
struct Bounds {
    error: f64,
    longest: f64,
}

impl Bounds {
    /// Among points of this spacing and noise.
    fn new(spacing: f64, noise: f64) -> Self {
        let error = (PIPELINE.light_noise * noise).max(PIPELINE.light_spacing * spacing);
        Self { error, longest: PIPELINE.light_edge * spacing }
    }
}

/// The bounds about each chart, by the mean spacing and noise of its points.
fn bounds(projected: &[ProjectedPoint], known: &Known<'_>) -> Vec<Bounds> {
    let named = projected.iter().map(|p| p.chart).filter(|&c| c != u32::MAX);
    let charts = named.max().map_or(0, |c| c as usize + 1);
    let mut sum = vec![[0.0; 3]; charts];
    for (i, p) in projected.iter().enumerate() {
        if let Some([count, spacing, noise]) = sum.get_mut(p.chart as usize) {
            *count += 1.0;
            *spacing += f64::from(known.scan.spacing[i]);
            *noise += relative_noise(known.scan.relative_noise, i);
        }
    }
    let of = |[n, spacing, noise]: [f64; 3]| match n {
        0.0 => Bounds::new(known.median_spacing, known.noise),
        _ => Bounds::new(spacing / n, known.noise * noise / n),
    };
    sum.into_iter().map(of).collect()
}
