//! How densely a scan samples its surface.
//!
//! In: points and their search tree. Out: the spacing at each point, and its median; which points are copies
//! of one place.

use super::constants::SPATIAL;
use super::neighbours::{Neighbour, Neighbours};
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// The spacing of a scan's points.
///
/// ```
/// let sampling = atlasfit::spatial::spacing::Sampling::new(vec![1.0, 4.0, 2.0]);
/// assert_eq!(sampling.median, 2.0);
/// ```
#[derive(Debug, Clone)]
pub struct Sampling {
    /// Spacing at each point: the side of the square of surface that one point stands for.
    pub spacing: Vec<f32>,
    /// Median of `spacing`.
    pub median: f64,
    /// Points carry the surface no farther than if their spacing were this.
    pub widest: f64,
}

impl Sampling {
    /// The sampling of points with these spacings, whatever is the widest of them.
    #[must_use]
    pub fn new(spacing: Vec<f32>) -> Self {
        let median = median(&mut spacing.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
        Self { spacing, median, widest: f64::INFINITY }
    }

    /// The spacing at a point, as far as it carries the surface.
    pub(crate) fn carried(&self, point: usize) -> f64 {
        f64::from(self.spacing[point]).min(self.widest)
    }
}

/// Neighbours of a point that are named: those that its spacing is taken from. Source: chosen; their use is
/// derived: 8 points on a surface of density 1/s^2 lie within r with pi r^2 = 8 s^2.
pub const NAMED: usize = 8;

/// What stands around each point.
#[derive(Debug, Clone)]
pub struct Around {
    /// Spacing per point.
    pub spacing: Vec<f32>,
    /// The nearest others of each point, nearest first; `u32::MAX` where there are no more.
    pub nearest: Vec<[u32; NAMED]>,
    /// Pairs of points that may be copies of one place: up to 31 about each point.
    pub pairs: Vec<Pair>,
}

/// A point and one of those about it that stand apart from all others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The two.
    pub points: [u32; 2],
    /// How far they stand apart: squared ratio of the distance to the farthest of them to that of the next
    /// point. In \[0, 1).
    pub leap: f64,
}

impl Around {
    fn with_capacity(points: usize) -> Self {
        let (spacing, nearest) = (Vec::with_capacity(points), Vec::with_capacity(points));
        Self { spacing, nearest, pairs: Vec::new() }
    }

    /// The pairs that are copies of one place. Of a part of a scan, not of the `whole`, only the nearest are:
    /// parts would differ in what is far more than chance.
    ///
    /// On a surface that is sampled at random, the squared ratio of the distances to the nearest two points
    /// is uniform, and that of later ones is small less often: a share `x` of all points has a leap below `x`
    /// by chance. The widest leap is taken at which far more points have one than that.
    #[must_use]
    pub fn copies(&self, whole: bool) -> Vec<[u32; 2]> {
        let least = SPATIAL.copy.powi(2);
        let mut widest = if whole { SPATIAL.apart.powi(2) } else { least };
        let by_chance = |x: f64| x * self.nearest.len() as f64;
        // The first pair of a point has its least leap.
        let firsts: Vec<f64> =
            self.pairs.chunk_by(|a, b| a.points[0] == b.points[0]).map(|of| of[0].leap).collect();
        let found = |x: f64| firsts.iter().filter(|&&leap| leap < x).count() as f64;
        while widest > least && by_chance(widest) > SPATIAL.chance * found(widest) {
            widest *= 0.5;
        }
        let widest = widest.max(least);
        self.pairs.iter().filter(|p| p.leap < widest).map(|p| p.points).collect()
    }
}

/// Looks at the nearest points of each point.
///
/// # Errors
/// Cancelled or out of time.
///
/// ```
/// use atlasfit::{Run, Vec3, spatial::{Neighbours, spacing::around}};
/// let grid: Vec<Vec3> = (0..400).map(|i| Vec3([f64::from(i % 20), f64::from(i / 20), 0.0])).collect();
/// let found = Run::default().execute(|ctx| around(&grid, &Neighbours::build(&grid, ctx)?, ctx))?;
/// assert!(found.copies(true).is_empty() && (0.5..1.5).contains(&found.spacing[210]));
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn around(points: &[Vec3], tree: &Neighbours, ctx: &Context<'_>) -> Result<Around> {
    let parts = points
        .par_chunks(1024)
        .enumerate()
        .map(|(chunk_index, chunk)| {
            ctx.check()?;
            let mut found = Vec::new();
            let mut out = Around::with_capacity(chunk.len());
            for (k, &p) in chunk.iter().enumerate() {
                tree.nearest(p, SPATIAL.wide_k + 1, &mut found);
                let side = |k: usize| {
                    let k = k.min(found.len() - 1);
                    (found[k].dist2 * std::f64::consts::PI / k.max(1) as f64).sqrt()
                };
                // Never zero: what is divided by it stays a number.
                out.spacing
                    .push((side(NAMED).max(SPATIAL.wide_share * side(SPATIAL.wide_k)) as f32).max(1e-30));
                let mut nearest = [u32::MAX; NAMED];
                nearest.iter_mut().zip(found.iter().skip(1)).for_each(|(to, f)| *to = f.index);
                out.nearest.push(nearest);
                let own = (chunk_index * 1024 + k) as u32;
                pairs(own, &found, &mut out.pairs);
            }
            ctx.advance(chunk.len());
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    let mut all = Around::with_capacity(points.len());
    for part in parts {
        all.spacing.extend(part.spacing);
        all.nearest.extend(part.nearest);
        all.pairs.extend(part.pairs);
    }
    Ok(all)
}

/// Pairs of a point with those of its neighbours, nearest first, that stand apart from the others.
fn pairs(own: u32, found: &[Neighbour], pairs: &mut Vec<Pair>) {
    let most = SPATIAL.apart * SPATIAL.apart;
    // The nearest is the point itself. Most points are done with the first look.
    if !found.last().is_some_and(|last| found.len() > 2 && found[1].dist2 < most * last.dist2) {
        return;
    }
    let first = pairs.len();
    let mut leap = f64::INFINITY;
    for k in (1..found.len() - 1).rev() {
        leap = leap.min(found[k].dist2 / found[k + 1].dist2);
        if leap < most && found[k].index != own {
            pairs.push(Pair { points: [own, found[k].index], leap });
        }
    }
    pairs[first..].reverse();
}
