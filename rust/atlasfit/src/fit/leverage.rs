//! How much the points of a chart say about it, and about each other's places on it.
//!
//! In: a fitted chart, its members. Out: a vector for each member. Their scalar products, times the noise's
//! variance, are the posterior covariances of the surface's places along the normal; times the weight of the
//! second point alone they say how far the first one's place follows the second one's noise.

use super::constants::FIT;
use super::sheet::{DomainPoint, Sheet, Tools, posterior};
use crate::atlas::monge::BaseCoordinates;
use crate::atlas::{FittedChart, Map};
use crate::error::Result;
use crate::numeric::spline::{self, Slope};
use crate::numeric::vec3::Vec3;
use crate::partition::tubes;
use crate::prior::basis::{BASIS, add_values};
use crate::prior::constants::MODES;
use crate::run::Context;

/// A vector for each member.
pub(crate) struct Leverage {
    rows: Vec<f64>,
    width: usize,
}

impl Leverage {
    /// The scalar product of two members' vectors.
    pub(crate) fn product(&self, a: usize, b: usize) -> f64 {
        let row = |k: usize| &self.rows[k * self.width..(k + 1) * self.width];
        row(a).iter().zip(row(b)).map(|(x, y)| x * y).sum()
    }
}

/// The vectors of a chart's members; nothing where no smoothness was fitted.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn leverage(
    points: &[Vec3],
    f: &FittedChart,
    tools: &mut Tools,
    ctx: &Context<'_>,
) -> Result<Option<Leverage>> {
    let Some(smoothness) = f.smoothness else { return Ok(None) };
    let map = match &f.chart.map {
        Map::Monge(map) => map,
        Map::Tube(tube) => {
            let rows = tubes::whitened(tube, &f.members, points, f.expected, smoothness.log_kappa, ctx)?;
            return Ok(rows.map(|(rows, width)| Leverage { rows, width }));
        }
    };
    let local: Vec<DomainPoint> = (f.members.iter())
        .map(|&(m, _)| {
            let l = map.local(points[m as usize]);
            [l.u, l.v, l.z]
        })
        .collect();
    let step = local.len().div_ceil(FIT.max_data).max(1);
    let few: Vec<DomainPoint> = local.iter().step_by(step).copied().collect();
    let weights: Vec<f64> = f.members.iter().step_by(step).map(|m| f64::from(m.1)).collect();
    let sheet = Sheet::of_chart(map.clone(), f.chart.sigma);
    let Some(posterior) = posterior(&sheet, &few, &weights, smoothness, tools) else { return Ok(None) };
    let mut rows = vec![0.0; local.len() * MODES];
    for (row, &[u, v, z]) in rows.chunks_exact_mut(MODES).zip(&local) {
        let (u, v) = map.foot(BaseCoordinates { u, v, z });
        let Slope { du, dv, .. } = spline::value_gradient(&map.coeffs, u, v);
        // From height over the base plane to along the normal.
        let cos = 1.0 / (1.0 + (du / map.radii[0]).powi(2) + (dv / map.radii[1]).powi(2)).sqrt();
        add_values(&BASIS, [u, v], cos, row);
        posterior.whiten(row);
    }
    Ok(Some(Leverage { rows, width: MODES }))
}
