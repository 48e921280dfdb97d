//! What the charts say of each point of a scan, blended.
//!
//! In: points, fitted charts, the points on the blended charts. Out: for each point posterior variance,
//! disagreement of its charts, noise, and what its residuals beside its neighbours' say.

use super::claimed::{Claimed, claimed};
use super::constants::UNCERTAINTY;
use crate::atlas::{FittedChart, Map, ProjectedPoint};
use crate::error::Result;
use crate::fit::Tools;
use crate::fit::constants::FIT;
use crate::fit::leverage::{Leverage, leverage};
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbour;
use rayon::prelude::*;

/// Neighbours whose residuals are compared with a point's own; `u32::MAX` for none.
pub(super) type Beside = [u32; UNCERTAINTY.beside];

/// What the charts say of a point: means, weighted as the charts are blended. Squared lengths.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Blended {
    /// Sum of the weights.
    pub weight: f64,
    /// Variance of the point's place along its normal, by the charts' posteriors.
    pub variance: f64,
    /// How the point's place follows the noise of the points beside it, on average.
    pub covariance: f64,
    /// Variance of the noise.
    pub noise: f64,
    /// How far outside of the surface noise puts points on average, where it bends as strongly as a tube.
    pub outward: f64,
    /// Place over the blended surface, and its square.
    offset: f64,
    offset2: f64,
}

impl Blended {
    fn add(&mut self, o: &OfChart) {
        self.weight += o.weight;
        self.variance += o.weight * o.variance;
        self.covariance += o.weight * o.covariance;
        self.noise += o.weight * o.noise;
        self.outward += o.weight * o.outward;
        self.offset += o.weight * o.offset;
        self.offset2 += o.weight * o.offset * o.offset;
    }

    /// The means.
    fn normed(&self) -> Self {
        let s = 1.0 / self.weight.max(1e-300);
        Self {
            weight: self.weight,
            variance: s * self.variance,
            covariance: s * self.covariance,
            noise: s * self.noise,
            outward: s * self.outward,
            offset: s * self.offset,
            offset2: s * self.offset2,
        }
    }

    /// How far the charts lie apart: the variance of their places.
    pub(super) fn apart(&self) -> f64 {
        (self.offset2 - self.offset * self.offset).max(0.0)
    }
}

/// What one chart says of one of its points.
struct OfChart {
    point: u32,
    weight: f64,
    variance: f64,
    covariance: f64,
    noise: f64,
    outward: f64,
    offset: f64,
}

/// The nearest points of the same sheet beside each: by their places on the surface, as the nearest by the
/// scan's own would share its noise.
pub(super) fn beside(projected: &[ProjectedPoint], ctx: &Context<'_>) -> Result<Vec<Beside>> {
    let Claimed { tree, index } = claimed(projected, ctx)?;
    let one = |own: &ProjectedPoint, i: u32, found: &mut Vec<Neighbour>| {
        let mut out = [u32::MAX; UNCERTAINTY.beside];
        if own.chart == u32::MAX {
            return out;
        }
        tree.nearest(own.position, UNCERTAINTY.beside + 1, found);
        let others = found.iter().map(|f| index[f.index as usize]);
        let same = |j: &u32| projected[*j as usize].normal.dot(own.normal) > UNCERTAINTY.same_side;
        out.iter_mut().zip(others.filter(|&j| j != i).filter(same)).for_each(|(o, j)| *o = j);
        out
    };
    let blocks = projected.par_chunks(1024).enumerate().map(|(k, block)| {
        ctx.check()?;
        let mut found = Vec::new();
        Ok(block.iter().zip(1024 * k as u32..).map(|(own, i)| one(own, i, &mut found)).collect::<Vec<_>>())
    });
    Ok(blocks.collect::<Result<Vec<_>>>()?.concat())
}

/// What the charts say of each point.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn gather(
    points: &[Vec3],
    fitted: &[FittedChart],
    projected: &[ProjectedPoint],
    beside: &[Beside],
    ctx: &Context<'_>,
) -> Result<Vec<Blended>> {
    let mut out = vec![Blended::default(); points.len()];
    // A few charts at a time: what each says of its members takes memory.
    for some in fitted.chunks(UNCERTAINTY.at_once) {
        let said = some.par_iter().map_init(Tools::default, |tools, f| {
            ctx.check()?;
            let leverage = leverage(points, f, tools, ctx)?;
            Ok(of_chart(points, f, leverage.as_ref(), projected, beside))
        });
        for chart in said.collect::<Result<Vec<_>>>()? {
            chart.iter().for_each(|o| out[o.point as usize].add(o));
        }
        ctx.advance(some.len());
    }
    out.par_iter_mut().for_each(|b| *b = b.normed());
    Ok(out)
}

/// Standard deviation of the noise about a chart. That of a tube with a fitted cross-section is what robust
/// weights leave of it.
fn noise_of(f: &FittedChart) -> f64 {
    match (&f.chart.map, f.smoothness) {
        (Map::Tube(_), Some(_)) => f.chart.sigma / FIT.truncated,
        _ => f.chart.sigma,
    }
}

/// What a chart says of its members.
fn of_chart(
    points: &[Vec3],
    f: &FittedChart,
    leverage: Option<&Leverage>,
    projected: &[ProjectedPoint],
    beside: &[Beside],
) -> Vec<OfChart> {
    let noise = noise_of(f).powi(2);
    let mut order: Vec<(u32, u32)> = (f.members.iter().zip(0..)).map(|(m, k)| (m.0, k)).collect();
    order.sort_unstable();
    let place = |j: u32| order.binary_search_by_key(&j, |o| o.0).ok().map(|at| order[at].1 as usize);
    let mut out = Vec::with_capacity(f.members.len());
    for (k, &(i, robust)) in f.members.iter().enumerate() {
        let on = &projected[i as usize];
        if on.chart == u32::MAX {
            continue;
        }
        let foot = f.chart.nearest(points[i as usize]);
        // The mean distance from the axis of a circle is its radius and that much (Rice's distribution).
        let outward = match &f.chart.map {
            Map::Monge(_) => 0.0,
            Map::Tube(tube) => 0.5 * noise / tube.mean_radius * (foot.normal.dot(on.normal)).signum(),
        };
        let (variance, covariance) = match leverage {
            // As if all points told the same of a circle's radius and place. No residuals are compared.
            None => (noise * UNCERTAINTY.circle / f.chart.support.max(1.0), 0.0),
            Some(l) => {
                let near = beside[i as usize].iter().filter(|j| **j != u32::MAX);
                let count = near.clone().count().max(1) as f64;
                let follows = |j: &u32| {
                    let m = place(*j)?;
                    Some(f64::from(f.members[m].1) * l.product(k, m))
                };
                let follows: f64 = near.filter_map(follows).sum();
                (noise * l.product(k, k), noise * follows / count)
            }
        };
        out.push(OfChart {
            point: i,
            weight: (foot.weight + 1e-6) * f64::from(robust),
            variance,
            covariance,
            noise,
            outward,
            offset: (foot.position - on.position).dot(on.normal),
        });
    }
    out
}
