//! Positions that are the same place.

use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// For each position the smallest index of those at the same place: equal after rounding to multiples of
/// `tolerance`, or exactly equal where that is 0. Positions that are not finite stay alone.
///
/// # Errors
/// Cancelled or out of time.
///
/// ```
/// use atlasfit::{Run, Vec3, spatial::weld::weld};
/// let at = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]].map(Vec3);
/// assert_eq!(Run::default().execute(|ctx| weld(&at, 0.0, ctx))?, [0, 1, 0]);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn weld(positions: &[Vec3], tolerance: f64, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let key = |p: &Vec3| {
        // Adding 0 makes one zero of the two that f64 has.
        p.0.map(|x| if tolerance > 0.0 { (x / tolerance).round() + 0.0 } else { x + 0.0 }.to_bits())
    };
    let mut order: Vec<([u64; 3], u32)> = Vec::with_capacity(positions.len());
    for (i, p) in positions.iter().enumerate() {
        ctx.check_at(i)?;
        if p.iter().all(|x| x.is_finite()) {
            order.push((key(p), i as u32));
        }
    }
    sort(&mut order, ctx)?;
    let mut to: Vec<u32> = (0..positions.len() as u32).collect();
    for (k, same) in order.chunk_by(|a, b| a.0 == b.0).enumerate() {
        ctx.check_at(k)?;
        for (_, i) in same {
            to[*i as usize] = same[0].1;
        }
    }
    ctx.check()?;
    Ok(to)
}
