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
}

impl Sampling {
    /// The sampling of points with these spacings.
    #[must_use]
    pub fn new(spacing: Vec<f32>) -> Self {
        let median = median(&mut spacing.iter().map(|&s| f64::from(s)).collect::<Vec<_>>());
        Self { spacing, median }
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
    /// Points that are copies of one place, in pairs: a point and another nearer than a thousandth of the
    /// distance to the next. Up to 31 about each point.
    pub copies: Vec<[u32; 2]>,
}

impl Around {
    fn with_capacity(points: usize) -> Self {
        let (spacing, nearest) = (Vec::with_capacity(points), Vec::with_capacity(points));
        Self { spacing, nearest, copies: Vec::new() }
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
/// assert!(found.copies.is_empty() && (0.5..1.5).contains(&found.spacing[210]));
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
                out.copies.extend(copies(&found).iter().map(|f| [own, f.index]).filter(|c| c[0] != c[1]));
            }
            ctx.advance(chunk.len());
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()?;
    let mut all = Around::with_capacity(points.len());
    for part in parts {
        all.spacing.extend(part.spacing);
        all.nearest.extend(part.nearest);
        all.copies.extend(part.copies);
    }
    Ok(all)
}

/// The copies of a point among its neighbours, nearest first: those before the last leap in distance.
fn copies(found: &[Neighbour]) -> &[Neighbour] {
    let leap = |k: usize| found[k].dist2 < SPATIAL.copy * SPATIAL.copy * found[k + 1].dist2;
    // The nearest is the point itself. Most points are done with the first look.
    match found.last() {
        Some(last) if found.len() > 2 && found[1].dist2 < SPATIAL.copy * SPATIAL.copy * last.dist2 => {
            let end = (1..found.len() - 1).rev().find(|&k| leap(k)).map_or(0, |k| k + 1);
            &found[..end]
        }
        _ => &[],
    }
}
