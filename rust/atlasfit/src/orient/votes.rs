//! How the scan votes on each chart's side.
//!
//! In: charts, and for points the direction that they are known to face. Out: the votes for each chart's own
//! normal.

use super::relations::charts_at;
use crate::atlas::{FittedChart, Membership, Vote};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Each point votes on its strongest chart. `toward` holds a unit vector per point, or zero where nothing is
/// known; those that are `hidden` have no vote (none are if that is empty).
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn votes(
    points: &[Vec3],
    fitted: &[FittedChart],
    members: &Membership,
    toward: &[Vec3],
    hidden: &[bool],
    ctx: &Context<'_>,
) -> Result<Vec<Vote>> {
    let of_point = |i: usize| {
        let strongest = charts_at(points[i], members.of(i), fitted).into_iter().next()?;
        let votes = toward[i] != Vec3::ZERO && hidden.get(i) != Some(&true);
        votes.then(|| (strongest.chart, strongest.normal.dot(toward[i])))
    };
    let cast: Vec<Vec<(u32, f64)>> = points
        .par_chunks(1024)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            Ok((c * 1024..c * 1024 + chunk.len()).filter_map(of_point).collect())
        })
        .collect::<Result<_>>()?;
    let mut out = vec![Vote::default(); fitted.len()];
    for &(chart, vote) in cast.iter().flatten() {
        out[chart as usize].add(vote);
    }
    Ok(out)
}
