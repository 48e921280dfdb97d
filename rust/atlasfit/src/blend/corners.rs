//! The blend itself: the charts' signed distances at the corners of one block, weighted by a partition of
//! unity.
//!
//! In: a block's charts with their signs, and the points that influence it. Out: a signed distance and a
//! blended mask at each corner. A point spreads its charts' weights around it; a chart's weight at a corner
//! is the sum of what the points there give it. Charts of another sheet have no say.

use super::blocks::{BEYOND, CORNERS, Corners, corner_at};
use super::constants::{BLEND, BLOCK};
use super::influence::influence;
use crate::atlas::{BlendSite, Chart, SITE_CHARTS, View};
use crate::numeric::vec3::Vec3;

/// What is blended at the corners of one block.
pub(super) struct BlockBlend<'a> {
    /// All charts.
    pub(super) charts: &'a [Chart],
    /// The block's charts, ascending.
    pub(super) list: &'a [u32],
    /// The sign of each of them in the block's gauge.
    pub(super) signs: &'a [f64],
    /// Side of a voxel.
    pub(super) h: f64,
    /// How far from the surface corners are known, in voxels.
    pub(super) band: f64,
}

/// A point as a block sees it.
struct NearSite {
    position: Vec3,
    /// One over its spacing squared.
    density: f64,
    /// Its charts, as places in the block's list; those that are unused have no weight.
    charts: [(u32, f32); SITE_CHARTS],
}

impl NearSite {
    fn new(site: &BlendSite, list: &[u32]) -> Self {
        Self {
            position: site.position,
            density: 1.0 / (site.spacing * site.spacing),
            charts: site.charts.map(|(c, w)| match list.binary_search(&c) {
                Ok(i) => (i as u32, w),
                Err(_) => (0, 0.0),
            }),
        }
    }
}

/// How much thicker than it is a chart of this radius is contoured on voxels of side `h`: a thinner tube
/// would pass between the corners. Its vertices are put back by as much.
pub(crate) fn thickening(radius: f64, h: f64) -> f64 {
    (BLEND.thinnest * h - radius).max(0.0)
}

/// A chart seen from a corner.
struct ChartView {
    chart: u32,
    weight: f64,
    /// Signed distance and normal, in the block's gauge.
    distance: f64,
    normal: Vec3,
    mask: f64,
}

/// The blend at one corner.
struct Blended {
    distance: f64,
    /// Blended mask, in [0, 1].
    support: f64,
    /// The chart that weighs most.
    chart: u32,
}

impl BlockBlend<'_> {
    /// The corners of the block at `at` (in blocks); `None` where charts say nothing at any of them.
    pub(super) fn corners<'s>(
        &self,
        at: [i32; 3],
        sites: impl Iterator<Item = &'s BlendSite>,
    ) -> Option<Corners> {
        let origin = at.map(|b| b * BLOCK);
        let mut out = Corners {
            value: [0.0; CORNERS],
            chart: [u32::MAX; CORNERS],
            round: [0; CORNERS],
            support: [0; CORNERS],
        };
        let near: Vec<NearSite> = sites.map(|site| NearSite::new(site, self.list)).collect();
        let mut weights = vec![0.0; self.list.len()];
        let mut views: Vec<ChartView> = Vec::new();
        let mut any = false;
        for n in 0..CORNERS {
            let i = corner_at(n);
            let p = Vec3::from_fn(|k| f64::from(origin[k] + i[k]) * self.h);
            let total = gather(&near, p, &mut weights);
            if total <= 0.0 {
                continue;
            }
            self.look(p, &weights, BLEND.least_share * total, &mut views);
            let Some(Blended { distance, support, chart }) = self.blend(&views) else { continue };
            // Rounded down: below the least support stays below it.
            out.support[n] = (255.0 * support) as u8;
            if support < BLEND.min_support || distance.abs() > self.band * self.h {
                continue;
            }
            // An exact zero would make an edge end on the surface; the sign of a tiny value decides instead.
            out.value[n] = if distance == 0.0 { f32::MIN_POSITIVE } else { distance as f32 };
            out.chart[n] = chart;
            out.round[n] = if distance.abs() > BLEND.band * self.h { BEYOND } else { 1 };
            any = true;
        }
        any.then_some(out)
    }

    /// Looks from `p` at the block's charts that weigh at least `least`.
    fn look(&self, p: Vec3, weights: &[f64], least: f64, views: &mut Vec<ChartView>) {
        views.clear();
        for ((&chart, &sign), &weight) in self.list.iter().zip(self.signs).zip(weights) {
            if weight < least {
                continue;
            }
            if let Some(View { distance, mask, normal, radius, .. }) = self.charts[chart as usize].view(p) {
                let thickened = distance - thickening(radius, self.h);
                views.push(ChartView {
                    chart,
                    weight,
                    distance: thickened * sign,
                    normal: normal * sign,
                    mask,
                });
            }
        }
    }

    /// Blends what the charts say. The chart that is near and well known leads; those of another sheet have
    /// no say.
    fn blend(&self, views: &[ChartView]) -> Option<Blended> {
        let score =
            |x: &ChartView| x.weight * (x.mask + BLEND.mask_floor) / (x.distance.abs() + BLEND.near * self.h);
        let lead = views.iter().max_by(|a, b| score(a).total_cmp(&score(b)))?;
        let (mut total, mut distance, mut support) = (0.0, 0.0, 0.0);
        let (mut top, mut best) = (0.0, u32::MAX);
        for v in views {
            let limit = BLEND.same_sheet_voxels * self.h
                + BLEND.same_sheet_sigmas * self.charts[v.chart as usize].sigma;
            let t = (1.0 - ((v.distance - lead.distance) / limit).powi(2)).max(0.0);
            // Charts that face the same way are one sheet's, however noisy.
            let w = if v.normal.dot(lead.normal) > BLEND.same_way { v.weight } else { v.weight * t * t };
            if w <= 0.0 {
                continue;
            }
            total += w;
            distance += w * v.distance;
            support += w * v.mask;
            if w > top {
                (top, best) = (w, v.chart);
            }
        }
        (total > 0.0).then(|| Blended { distance: distance / total, support: support / total, chart: best })
    }
}

/// Sums the weights that the points nearby give a block's charts at `p`; returns the sum over all charts.
fn gather(near: &[NearSite], p: Vec3, weights: &mut [f64]) -> f64 {
    weights.fill(0.0);
    let mut total = 0.0;
    for a in near {
        let k = influence(p.dist2(a.position) * a.density);
        if k <= 0.0 {
            continue;
        }
        for &(c, w) in &a.charts {
            weights[c as usize] += k * f64::from(w);
            total += k * f64::from(w);
        }
    }
    total
}
