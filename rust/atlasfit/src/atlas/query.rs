//! Questions to a fitted atlas: the nearest point of its surface, the place of a chart's coordinates.
//!
//! In: the charts of a fit and the frame that they live in; points in the user's frame. Out: positions, unit
//! normals, chart and chart coordinates. The surface is that of the blended charts (partition of unity, as in
//! `project`), trimmed by their masks. What belongs to the other side of a thin sheet takes no part: it faces
//! away.

use crate::atlas::{Chart, Foot};
use crate::error::{Error, Result};
use crate::numeric::robust::{TUKEY, tukey};
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use crate::spatial::bvh::{Aabb, Bvh};
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Queries per task: a few milliseconds of work between two looks at the cancel flag.
const BLOCK: usize = 256;
/// The mask's value where the surface ends.
const EDGE: f64 = 0.5;
/// Steps from a place beyond the surface's edge towards the chart's centre, and halvings of the last one.
const STEPS: (usize, usize) = (8, 6);
/// Samples along one side of a chart's domain for its box, and the margin for what lies between them,
/// relative to the chart's size.
const BOX: (usize, f64) = (9, 0.05);

/// A fitted atlas.
///
/// ```
/// use atlasfit::atlas::{file, query::Atlas};
/// use atlasfit::{DenoiseOptions, Run, Vec3, denoise, geometry::PointCloud};
/// let ball = (0..500).map(|i| {
///     let (z, turn) = (1.0 - (f64::from(i) + 0.5) / 250.0, 2.4 * f64::from(i));
///     [(1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z]
/// });
/// let scan = PointCloud::from_positions(ball.collect());
/// let mut run = Run::default();
/// let fit = denoise(&scan, &DenoiseOptions::default().with_uv(false), &mut run)?;
/// let atlas = run.execute(|ctx| Atlas::new(fit.charts, fit.origin, fit.scale, ctx))?;
/// let read = run.execute(|ctx| file::from_bytes(&file::to_bytes(&atlas)?, ctx))?;
/// let found = run.execute(|ctx| read.project(&[Vec3([0.0, 0.0, 1.2])], ctx))?[0].unwrap();
/// assert!((found.position.norm() - 1.0).abs() < 0.05 && (found.distance - 0.2).abs() < 0.05);
/// let place = read.place(found.chart as usize, found.uv).unwrap();
/// assert!(place.position.dist2(found.position).sqrt() < 0.1);
/// # Ok::<(), atlasfit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Atlas {
    charts: Vec<Chart>,
    origin: Vec3,
    unit: f64,
    tree: Bvh,
}

/// A point on an atlas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnAtlas {
    /// Position in the user's frame.
    pub position: Vec3,
    /// Unit normal in the atlas's orientation.
    pub normal: Vec3,
    /// The chart that is nearest.
    pub chart: u32,
    /// Its coordinates there, in the unit disk.
    pub uv: [f64; 2],
    /// Distance from the query.
    pub distance: f64,
}

/// The place of chart coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Position in the user's frame.
    pub position: Vec3,
    /// Unit normal in the atlas's orientation.
    pub normal: Vec3,
    /// In [0, 1]; one half at the edge of the surface, less beyond.
    pub inside: f64,
}

impl Atlas {
    /// An atlas of charts in a normalised frame whose origin and unit are `origin` and `unit` in the user's.
    ///
    /// # Errors
    /// [`Error::EmptyInput`] without charts; cancel and time limit.
    pub fn new(charts: Vec<Chart>, origin: Vec3, unit: f64, ctx: &Context<'_>) -> Result<Self> {
        if charts.is_empty() {
            return Err(Error::empty("the atlas has no charts", "Fit one to a scan"));
        }
        let boxes: Vec<Aabb> = charts.par_iter().map(bounds).collect();
        let tree = Bvh::build(&boxes, ctx)?;
        Ok(Self { charts, origin, unit, tree })
    }

    /// The charts, in the normalised frame.
    #[must_use]
    pub fn charts(&self) -> &[Chart] {
        &self.charts
    }
    /// Origin of the normalised frame in the user's.
    #[must_use]
    pub fn origin(&self) -> Vec3 {
        self.origin
    }
    /// Length of the normalised frame's unit in the user's.
    #[must_use]
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// The place of (u, v) in the unit disk of a chart; `None` where there is no such chart.
    #[must_use]
    pub fn place(&self, chart: usize, uv: [f64; 2]) -> Option<Place> {
        let c = self.charts.get(chart)?;
        let foot = c.at(uv);
        Some(Place {
            position: self.back(foot.position),
            normal: (foot.normal * c.sign),
            inside: c.mask_at(uv),
        })
    }

    /// The nearest point of the surface for each query, in order; `None` for queries that are not finite.
    /// Accurate for queries nearer to the surface than it bends; farther away, where several places are about
    /// as near, one of them.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn project(&self, queries: &[Vec3], ctx: &Context<'_>) -> Result<Vec<Option<OnAtlas>>> {
        ctx.stage(Stage::Project, queries.len());
        let blocks = queries
            .par_chunks(BLOCK)
            .map(|block| {
                ctx.check()?;
                ctx.advance(block.len());
                let mut near = Vec::new();
                Ok(block.iter().map(|&q| self.nearest(q, &mut near)).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(blocks.concat())
    }

    fn back(&self, p: Vec3) -> Vec3 {
        self.origin + p * self.unit
    }

    fn nearest(&self, query: Vec3, near: &mut Vec<u32>) -> Option<OnAtlas> {
        let p = Vec3::from_fn(|k| (query[k] - self.origin[k]) / self.unit);
        if !p.iter().all(|x| x.is_finite()) {
            return None;
        }
        let (best, best2) = self.tree.nearest(p, f64::INFINITY, |i| {
            seen(&self.charts[i as usize], p).map_or(f64::INFINITY, |s| s.1)
        })?;
        let chart = &self.charts[best as usize];
        let (foot, _) = seen(chart, p)?;
        let least = best2.sqrt();
        let front = foot.normal * chart.sign;
        // Other charts of the same sheet see the point about as near.
        let limit = TUKEY * chart.sigma;
        near.clear();
        let reach = least + limit;
        let region = Aabb { min: p.map(|x| x - reach), max: p.map(|x| x + reach) };
        let _ = self.tree.meeting::<()>(&region, |i| {
            near.push(i);
            ControlFlow::Continue(())
        });
        near.sort_unstable();
        let (mut total, mut at, mut n) = (0.0, Vec3::ZERO, Vec3::ZERO);
        for &i in near.iter() {
            let c = &self.charts[i as usize];
            let Some((other, d2)) = seen(c, p) else { continue };
            let m = other.normal * c.sign;
            // The small constant keeps the nearest chart in the sum at its very rim.
            let w = (other.weight + 1e-6) * tukey(d2.sqrt() - least, limit + 1e-12);
            if w > 0.0 && m.dot(front) > 0.0 {
                at += other.position * w;
                n += m * w;
                total += w;
            }
        }
        let l = n.norm();
        let position = self.back(at * (1.0 / total));
        Some(OnAtlas {
            position,
            normal: if l > 0.0 { n * (1.0 / l) } else { front },
            chart: best,
            uv: foot.uv,
            distance: position.dist2(query).sqrt(),
        })
    }
}

fn bounds(c: &Chart) -> Aabb {
    let node = |i: usize| i as f64 * (2.0 / (BOX.0 - 1) as f64) - 1.0;
    let all = (0..BOX.0).flat_map(|i| (0..BOX.0).map(move |j| (node(i), node(j))));
    let b = all.filter(|&(u, v)| c.reach([u, v]) <= 1.05).fold(Aabb::EMPTY, |b, (u, v)| {
        let p = c.at([u, v]).position;
        b.join(&Aabb { min: p, max: p })
    });
    let margin = BOX.1 * b.longest_side();
    Aabb { min: b.min.map(|x| x - margin), max: b.max.map(|x| x + margin) }
}

/// The nearest point of a chart's trimmed surface and its squared distance; `None` where it has none.
fn seen(c: &Chart, p: Vec3) -> Option<(Foot, f64)> {
    let mut foot = c.nearest(p);
    let reach = c.reach(foot.uv);
    if reach > 1.0 {
        foot = c.at(c.shrink(foot.uv, 1.0 / reach));
    }
    if c.mask_at(foot.uv) < EDGE {
        let on = |t: f64| c.mask_at(c.shrink(foot.uv, t)) >= EDGE;
        let at = |k: usize| 1.0 - k as f64 / STEPS.0 as f64;
        let k = (1..=STEPS.0).find(|&k| on(at(k)))?;
        let (mut low, mut high) = (at(k), at(k - 1));
        for _ in 0..STEPS.1 {
            let mid = 0.5 * (low + high);
            if on(mid) { low = mid } else { high = mid }
        }
        foot = c.at(c.shrink(foot.uv, low));
    }
    Some((foot, p.dist2(foot.position)))
}
