//! How densely a scan samples its surface.
//!
//! In: points and their search tree. Out: the spacing at each point, and its median.

use super::constants::SPATIAL;
use super::neighbours::Neighbours;
use crate::error::Result;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// The spacing of a scan's points.
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

/// Spacing per point.
///
/// # Errors
/// Cancelled or out of time.
pub fn spacing(points: &[Vec3], tree: &Neighbours, ctx: &Context<'_>) -> Result<Vec<f32>> {
    points
        .par_chunks(1024)
        .map(|chunk| {
            ctx.check()?;
            let mut found = Vec::new();
            let out: Vec<f32> = chunk
                .iter()
                .map(|&p| {
                    tree.nearest(p, SPATIAL.wide_k + 1, &mut found);
                    let side = |k: usize| {
                        let k = k.min(found.len() - 1);
                        (found[k].dist2 * std::f64::consts::PI / k.max(1) as f64).sqrt()
                    };
                    // Never zero: what is divided by it stays a number.
                    (side(SPATIAL.spacing_k).max(SPATIAL.wide_share * side(SPATIAL.wide_k)) as f32).max(1e-30)
                })
                .collect();
            ctx.advance(chunk.len());
            Ok(out)
        })
        .collect::<Result<Vec<_>>>()
        .map(|v| v.concat())
}
