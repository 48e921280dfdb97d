//! Which charts may stay once it is known which points lie on which sheet.
//!
//! In: fitted charts, the points projected onto them. Out: the charts that had no other sheet near, and which
//! points they cover.

use super::Cut;
use super::constants::PARTITION;
use super::grow::is_across;
use crate::atlas::{FittedChart, Map, ProjectedPoint};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::Neighbour;
use rayon::prelude::*;

/// What charts that may not stay leave.
pub(crate) struct Refit {
    /// For each point whether it needs no other chart.
    pub covered: Vec<bool>,
    /// The charts that were left out.
    pub left_out: Vec<FittedChart>,
}

/// Leaves out the charts whose patch had another sheet within its reach: there they were kept small, or took
/// some of its points. Points that are `done` need no other chart. Nothing if all charts stay.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn keep(
    cut: &Cut<'_>,
    fitted: &mut Vec<FittedChart>,
    done: &[bool],
    projected: &[ProjectedPoint],
    ctx: &Context<'_>,
) -> Result<Option<Refit>> {
    let stays = fitted
        .par_chunks(64)
        .map(|chunk| {
            ctx.check()?;
            let mut found = Vec::new();
            Ok(chunk.iter().map(|f| stays(cut, f, projected, &mut found)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    if stays.iter().all(|s| *s) {
        return Ok(None);
    }
    // Points that the charts before could not reach stay without one.
    let mut covered = vec![true; projected.len()];
    let mut of = stays.iter();
    let left_out: Vec<FittedChart> = fitted.extract_if(.., |_| !of.next().is_some_and(|s| *s)).collect();
    left_out.iter().flat_map(|f| &f.members).for_each(|&(m, _)| covered[m as usize] = false);
    for f in fitted.iter() {
        let Map::Monge(map) = &f.chart.map else { continue };
        for &(m, _) in &f.members {
            let l = map.local(cut.points[m as usize]);
            covered[m as usize] |= l.u * l.u + l.v * l.v < PARTITION.core * PARTITION.core;
        }
    }
    covered.iter_mut().zip(done).for_each(|(c, d)| *c |= d);
    Ok(Some(Refit { covered, left_out }))
}

/// Takes back charts that were left out where no other came instead: those most of whose points lie on no
/// chart now.
pub(crate) fn restore(fitted: &mut Vec<FittedChart>, left_out: Vec<FittedChart>, points: usize) {
    let mut covered = vec![false; points];
    fitted.iter().flat_map(|f| &f.members).for_each(|&(m, _)| covered[m as usize] = true);
    let lost = |f: &FittedChart| {
        let uncovered = f.members.iter().filter(|m| !covered[m.0 as usize]).count();
        2 * uncovered > f.members.len()
    };
    fitted.extend(left_out.into_iter().filter(lost));
}

/// Whether no other sheet lies near enough to disturb a chart. Tubes always stay.
fn stays(cut: &Cut<'_>, f: &FittedChart, projected: &[ProjectedPoint], found: &mut Vec<Neighbour>) -> bool {
    let Map::Monge(map) = &f.chart.map else { return true };
    let center = map.at([0.0; 2]);
    cut.tree.nearest(center.position, 1, found);
    let (reach, sigma) = found.first().map_or((0.0, cut.sigma), |n| {
        let point = n.index as usize;
        (cut.reach(point, cut.sigma), cut.sigma * cut.relative_noise(point))
    });
    cut.tree.within(center.position, PARTITION.rim * reach, found);
    let (place, normal) = (center.position, center.normal * f.chart.sign);
    let disturbing = PARTITION.disturbing_sigmas * sigma + PARTITION.disturbing_share * reach;
    !found.iter().any(|n| {
        let other = &projected[n.index as usize];
        let near = (other.position - place).dot(normal).abs() < disturbing;
        near && (is_across(place, normal, other, sigma) || (f.of_two && is_copy(f, other, sigma)))
    })
}

/// Whether a point lies on a second sheet that faces as the chart does: sweeps of a scanner that are
/// misaligned show one surface twice.
fn is_copy(f: &FittedChart, other: &ProjectedPoint, sigma: f64) -> bool {
    f.chart.view(other.position).is_some_and(|v| {
        let turn = v.normal.dot(other.normal) * f.chart.sign;
        turn > PARTITION.copy_turn && v.mask >= 0.5 && v.distance.abs() > PARTITION.between * sigma
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(points: std::ops::Range<u32>) -> FittedChart {
        FittedChart::flat(1.0, 1.0, points)
    }

    #[test]
    fn a_chart_that_nothing_replaced_comes_back() {
        let mut fitted = vec![of(0..10)];
        restore(&mut fitted, vec![of(5..11), of(9..14)], 20);
        let first: Vec<u32> = fitted.iter().map(|f| f.members[0].0).collect();
        assert_eq!(first, [0, 9], "most points of 5..11 lie on 0..10, most of 9..14 do not");
    }
}
