//! How sure the denoised points and the surface are: a standard deviation along the normal for each, the
//! noise of each point, how likely it is a stray.
//!
//! In: points, fitted charts, the points on the blended charts. Out: [`PointUncertainty`], and the
//! uncertainty of a mesh's vertices from it.
//!
//! The variance of a place is that of a mixture: the mean of the posterior variances of the charts that are
//! blended there, plus the variance of their places (the law of total variance). The first part is large at
//! rims and where points are few, the second one at edges of the part and where two sheets meet. The first is
//! widened by what the scan's own residuals ask for (`calibrate`).

mod calibrate;
mod claimed;
pub(crate) mod constants;
mod gather;
mod strays;
mod vertices;

use crate::atlas::{FittedChart, Map, ProjectedPoint};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use calibrate::Factor;
use rayon::prelude::*;
pub(crate) use vertices::{distances, of_vertices};

/// How sure the points are. One entry per point of the scan; lengths as its own.
#[derive(Debug, Clone)]
pub(crate) struct PointUncertainty {
    /// Standard deviation of the denoised point along its normal; not a number for points on no chart.
    pub sd: Vec<f32>,
    /// Standard deviation of the noise that the point had.
    pub noise: Vec<f32>,
    /// Probability that the point is a stray.
    pub stray: Vec<f32>,
    /// Root mean square of the charts' curvatures, weighted by their points: one over a length.
    pub curvature: f64,
    /// The factor of the posteriors' standard deviations, 1 or more; none where the residuals do not tell it.
    pub factor: Option<f64>,
    /// Whether the residuals of points beside each other ask for less than the posteriors say.
    pub small: bool,
}

/// How sure the points of a scan are, `projected` as the charts put them.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn of_points(
    points: &[Vec3],
    fitted: &[FittedChart],
    projected: &[ProjectedPoint],
    ctx: &Context<'_>,
) -> Result<PointUncertainty> {
    ctx.stage(Stage::Project, fitted.len());
    let beside = gather::beside(projected, ctx)?;
    let said = gather::gather(points, fitted, projected, &beside, ctx)?;
    let residual: Vec<f64> = (points.par_iter().zip(projected).zip(&said))
        .map(|((p, on), s)| (*p - on.position).dot(on.normal) - s.outward)
        .collect();
    let factor = calibrate::factor(&said, &residual, &beside, ctx)?.filter(Factor::is_known);
    let small = factor.is_some_and(|f| f.is_small());
    // No posterior is made narrower.
    let factor = factor.map(|f| f.factor.max(1.0));
    let widen = factor.unwrap_or(1.0);
    let on = |i: usize| projected[i].chart != u32::MAX;
    let scaled: Vec<Option<f64>> = (0..points.len())
        .map(|i| on(i).then(|| residual[i] / said[i].noise.sqrt().max(f64::MIN_POSITIVE)))
        .collect();
    ctx.check()?;
    Ok(PointUncertainty {
        sd: (said.iter().enumerate())
            .map(|(i, s)| if on(i) { (widen * s.variance + s.apart()).sqrt() as f32 } else { f32::NAN })
            .collect(),
        noise: said.iter().map(|s| s.noise.sqrt() as f32).collect(),
        stray: strays::probabilities(&scaled).into_iter().map(|p| p as f32).collect(),
        curvature: curvature(fitted),
        factor: factor.map(f64::sqrt),
        small,
    })
}

/// Root mean square of the charts' curvatures at their middles.
fn curvature(fitted: &[FittedChart]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for f in fitted {
        let bend = match &f.chart.map {
            Map::Monge(map) => map.curvature_sum(0.0, 0.0),
            Map::Tube(tube) => 1.0 / tube.mean_radius,
        };
        if bend.is_finite() {
            sum += f.chart.support * bend * bend;
            total += f.chart.support;
        }
    }
    if total > 0.0 { (sum / total).sqrt() } else { 0.0 }
}
