//! Equal positions joined.
//!
//! In: positions in the user's unit. Out: the distinct finite ones, and which each given one is.

use crate::error::{Error, Result};
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// Positions of which each is named once.
#[derive(Debug, Clone)]
pub struct Distinct {
    /// The distinct finite positions, in the order of their first appearance.
    pub points: Vec<Vec3>,
    /// For each given position its place among `points`; `u32::MAX` where it is not finite.
    pub of_input: Vec<u32>,
    /// Positions with a coordinate that is not finite.
    pub not_finite: usize,
    /// Positions that repeat an earlier one.
    pub duplicates: usize,
}

/// Joins equal positions and leaves out those that are not finite.
///
/// # Errors
/// Cancelled or out of time; [`Error::InvalidArgument`] above 2^32 - 2 positions.
pub fn distinct(given: &[Vec3], ctx: &Context<'_>) -> Result<Distinct> {
    let n = given.len();
    if n >= u32::MAX as usize {
        return Err(Error::invalid(format!("{n} points"), "Give fewer points"));
    }
    // Sorting by bits is exact and fast.
    let mut order: Vec<u32> =
        (0..n as u32).filter(|&i| given[i as usize].iter().all(|x| x.is_finite())).collect();
    let bits = |i: u32| given[i as usize].0.map(|x| (x + 0.0).to_bits());
    sort_by(&mut order, |&a, &b| (bits(a), a).cmp(&(bits(b), b)), ctx)?;
    let mut first = vec![u32::MAX; n];
    for (k, group) in order.chunk_by(|&a, &b| bits(a) == bits(b)).enumerate() {
        ctx.check_at(k)?;
        for &i in group {
            first[i as usize] = group[0];
        }
    }
    let finite = order.len();
    drop(order);
    ctx.check()?;
    let mut of_input = first;
    let mut points = Vec::new();
    for i in 0..n {
        ctx.check_at(i)?;
        let f = of_input[i];
        if f == i as u32 {
            of_input[i] = points.len() as u32;
            points.push(given[i]);
        } else if f != u32::MAX {
            // The first of equal positions has the least index, so it has its place already.
            of_input[i] = of_input[f as usize];
        }
    }
    Ok(Distinct { not_finite: n - finite, duplicates: finite - points.len(), points, of_input })
}
