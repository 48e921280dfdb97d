//! The Chamfer distance between two sets of points.
//!
//! In: two sets of points in one frame. Out: one number, a squared length.
//! Source: *Deep Manifold Prior*, section 3 ("Loss function"), whose sums over the points are means here:
//! section 5.1 compares sets of different sizes, and the figures of its table 1 are those of means.

use crate::error::{Error, Result};
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use rayon::prelude::*;

/// Queries per task: a few milliseconds of work between two looks at the cancel flag.
const BLOCK: usize = 1024;

/// The Chamfer distance between two sets of points: mean squared distance to the nearest point of the other
/// set, both directions added. Its unit is that of the points, squared.
///
/// # Errors
/// [`Error::EmptyInput`] where a set is empty; cancel and time limit.
///
/// ```
/// use atlasfit::{Run, Vec3, measure::chamfer};
/// let (a, b) = ([Vec3([0.0, 0.0, 0.0])], [Vec3([1.0, 0.0, 0.0]), Vec3([3.0, 0.0, 0.0])]);
/// // From a to b 1; from b to a the mean of 1 and 9.
/// assert_eq!(Run::default().execute(|ctx| chamfer(&a, &b, ctx))?, 6.0);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn chamfer(a: &[Vec3], b: &[Vec3], ctx: &Context<'_>) -> Result<f64> {
    if a.is_empty() || b.is_empty() {
        return Err(Error::empty("a set of points", "Give points on both sides"));
    }
    let one_way = |from: &[Vec3], to: &[Vec3]| -> Result<f64> {
        let boxes: Vec<Aabb> = to.iter().map(|p| Aabb::of(&[*p])).collect();
        let tree = Bvh::build(&boxes, ctx)?;
        let blocks = from
            .par_chunks(BLOCK)
            .map(|block| {
                ctx.check()?;
                ctx.advance(block.len());
                let nearest = |q: &Vec3| tree.nearest(*q, f64::INFINITY, |i| (*q).dist2(to[i as usize]));
                Ok(block.iter().filter_map(nearest).map(|n| n.1).sum::<f64>())
            })
            .collect::<Result<Vec<f64>>>()?;
        Ok(blocks.iter().sum::<f64>() / from.len() as f64)
    };
    Ok(one_way(a, b)? + one_way(b, a)?)
}
