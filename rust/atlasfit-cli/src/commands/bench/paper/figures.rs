//! Figures of one fit: the paper's Chamfer distance, overlap of charts, distortion.

use super::shapes::{COUNT, Shape};
use anyhow::Result;
use atlasfit::Context;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::{self, sample};
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::spatial::spacing::{Sampling, around};
use atlasfit_net::explicit::{Dim, NetworkAtlas};
use atlasfit_net::trim;
use serde_json::{Value, json};

/// Triangles are trimmed where they are farther from the scan than this, in spacings of its points.
const TRIM: f64 = 2.5;
/// All figures of a network's charts.
pub fn figures_of(atlas: &NetworkAtlas, dim: Dim, shape: &Shape, ctx: &Context<'_>) -> Result<Value> {
    let mut figures = json!({ "overlap": atlas.overlap(ctx)? });
    let mesh = atlas.surface();
    if dim == Dim::Contour {
        figures["cd"] = json!(cd(&on_curves(atlas, ctx), shape, ctx)?);
        return Ok(figures);
    }
    figures["cd"] = json!(surface_cd(&mesh, shape, ctx)?);
    figures["by_parameter"] = json!(cd(&by_parameter(atlas, ctx), shape, ctx)?);
    figures["distortion"] = json!(distortion(atlas));
    let trimmed = trimmed(&mesh, &shape.scan, ctx)?;
    figures["trimmed"] = trimmed_cd(&trimmed, shape, ctx)?;
    Ok(figures)
}

/// The mesh where the scan supports it.
pub fn trimmed(mesh: &TriMesh, scan: &[Vec3], ctx: &Context<'_>) -> Result<TriMesh> {
    let tree = atlasfit::spatial::neighbours::Neighbours::build(scan, ctx)?;
    let spacing = Sampling::new(around(scan, &tree, ctx)?.spacing).median;
    Ok(trim(mesh, scan, TRIM * spacing, ctx)?)
}

pub fn trimmed_cd(mesh: &TriMesh, shape: &Shape, ctx: &Context<'_>) -> Result<Value> {
    // A network that is hardly trained may have nothing near the scan.
    if mesh.triangles.is_empty() { Ok(Value::Null) } else { Ok(json!(surface_cd(mesh, shape, ctx)?)) }
}

/// [`cd`] of samples uniform by area.
pub fn surface_cd(mesh: &TriMesh, shape: &Shape, ctx: &Context<'_>) -> Result<f64> {
    let samples: Vec<Vec3> =
        sample::uniform(mesh, COUNT, ctx.seed ^ 3, ctx)?.iter().map(|s| s.point).collect();
    cd(&samples, shape, ctx)
}

/// Samples of the curves, uniform by length.
fn on_curves(atlas: &NetworkAtlas, ctx: &Context<'_>) -> Vec<Vec3> {
    let side = atlas.grid[1];
    let mut total = 0.0;
    // Length up to the end of each piece, and its two ends.
    let pieces: Vec<(f64, Vec3, Vec3)> = atlas
        .samples
        .chunks_exact(side)
        .flat_map(|chart| chart.windows(2))
        .map(|w| {
            total += w[0].dist2(w[1]).sqrt();
            (total, w[0], w[1])
        })
        .collect();
    let mut rng = Rng::stream(ctx.seed, 11);
    (0..COUNT)
        .filter_map(|_| {
            let at = rng.uniform() * total;
            let (_, a, b) = pieces.get(pieces.partition_point(|p| p.0 <= at))?;
            Some(*a + (*b - *a) * rng.uniform())
        })
        .collect()
}

/// Samples of the charts, uniform in their parameters: a bridge of few grid cells then weighs little.
fn by_parameter(atlas: &NetworkAtlas, ctx: &Context<'_>) -> Vec<Vec3> {
    let [lines, side] = atlas.grid;
    let mut rng = Rng::stream(ctx.seed, 13);
    (0..COUNT)
        .map(|_| {
            let chart = &atlas.samples[rng.below(atlas.charts) * lines * side..][..lines * side];
            let [(i, u), (j, v)] = [lines, side].map(|n| {
                let at = rng.uniform() * (n - 1) as f64;
                (at as usize, at.fract())
            });
            let along = |i: usize| chart[i * side + j] * (1.0 - v) + chart[i * side + j + 1] * v;
            along(i) * (1.0 - u) + along(i + 1) * u
        })
        .collect()
}

/// The paper's Chamfer distance to the true surface.
fn cd(samples: &[Vec3], shape: &Shape, ctx: &Context<'_>) -> Result<f64> {
    let truth: Vec<Vec3> =
        sample::uniform(&shape.truth, COUNT, ctx.seed ^ 4, ctx)?.iter().map(|s| s.point).collect();
    Ok(measure::chamfer(samples, &truth, ctx)?)
}

/// Mean over the grid's cells of the ratio of the singular values of the map's derivative: 1 where it is
/// conformal.
fn distortion(atlas: &NetworkAtlas) -> f64 {
    let [lines, side] = atlas.grid;
    let (mut sum, mut n) = (0.0, 0usize);
    for chart in atlas.samples.chunks_exact(lines * side) {
        for i in 0..lines - 1 {
            for j in 0..side - 1 {
                let p = chart[i * side + j];
                let (a, b) = (chart[(i + 1) * side + j] - p, chart[i * side + j + 1] - p);
                let (e, g) = (a.norm().powi(2), b.norm().powi(2));
                let f: f64 = (0..3).map(|k| a[k] * b[k]).sum();
                let root = ((e - g).powi(2) + 4.0 * f * f).sqrt();
                // Folded cells count as badly as any.
                sum += ((e + g + root) / (e + g - root).max(1e-12)).sqrt().min(100.0);
                n += 1;
            }
        }
    }
    sum / n.max(1) as f64
}
