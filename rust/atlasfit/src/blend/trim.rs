//! Charts end where sheets across them say that there is no surface.
//!
//! In: oriented charts, the points on them. Out: the same charts, their masks trimmed. A chart spans gaps of
//! the sampling, and so the foot of a plate that stands on its sheet, or the mouth of a slot in it, where
//! these are narrow. There no point lies on the chart, and the points of the sheets across it face away from
//! the place above it, or towards the place below it: there is no surface between body and body, and none
//! between air and air.

use super::constants::BLEND;
use crate::atlas::mask::{SQUARES, Trimmed};
use crate::atlas::{FittedChart, Map, Monge, ProjectedPoint};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::neighbours::Neighbour;
use crate::spatial::spacing::Sampling;
use rayon::prelude::*;

/// Trims the masks of charts. `tree` is that of the scan's points.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn trim(
    fitted: &mut [FittedChart],
    projected: &[ProjectedPoint],
    tree: &Neighbours,
    sampling: &Sampling,
    ctx: &Context<'_>,
) -> Result<()> {
    fitted.par_chunks_mut(BLEND.trim_chunk).try_for_each(|charts| {
        let mut near = Vec::new();
        for FittedChart { chart, members, .. } in charts {
            ctx.check()?;
            let Map::Monge(map) = &mut chart.map else { continue };
            if members.is_empty() {
                continue;
            }
            let spacing = members.iter().map(|m| sampling.carried(m.0 as usize)).sum::<f64>();
            let spacing = spacing / members.len() as f64;
            let square = map.radii[0].max(map.radii[1]) * 2.0 / SQUARES as f64;
            let empty = (BLEND.trim_empty * spacing).max(chart.sigma).max(0.5 * square);
            let reach = BLEND.trim_reach * empty;
            tree.within(map.center, 1.1 * map.radii[0].max(map.radii[1]) + reach, &mut near);
            let sheet = spacing.max(BLEND.trim_sigmas * chart.sigma);
            let (own, across) = sides(map, chart.sign, projected, &near, [sheet, reach]);
            if !across.is_empty() {
                let contradicted = contradicted(map, &across, empty, reach);
                map.mask.trimmed = trimmed(map, &own, &contradicted, empty);
            }
        }
        Ok(())
    })
}

/// A point of a sheet that crosses a chart.
struct Across {
    /// Its place along the chart's plane.
    at: [f64; 2],
    /// Height over the chart, on the side that the chart faces.
    height: f64,
    /// Its normal along the plane.
    normal: [f64; 2],
}

/// The places along the chart's plane of points on its sheet, and the points of sheets across it: `within`
/// says how far off the chart they lie at the most.
fn sides(
    map: &Monge,
    sign: f64,
    projected: &[ProjectedPoint],
    near: &[Neighbour],
    within: [f64; 2],
) -> (Vec<[f64; 2]>, Vec<Across>) {
    let (mut own, mut across) = (Vec::new(), Vec::new());
    for p in near.iter().map(|n| &projected[n.index as usize]).filter(|p| p.chart != u32::MAX) {
        let l = map.local(p.position);
        // Beyond the domain the chart goes on as at its rim.
        let k = (1.1 / l.u.hypot(l.v)).min(1.0);
        let over = map.height_normal(l.u * k, l.v * k);
        let height = (l.z - over.height) * over.cos * sign;
        let at = [l.u * map.radii[0], l.v * map.radii[1]];
        if over.normal.dot(p.normal).abs() >= BLEND.same_way {
            if height.abs() < within[0] {
                own.push(at);
            }
        } else if height.abs() < within[1] {
            let along = |axis: Vec3| p.normal.dot(axis);
            across.push(Across { at, height, normal: [along(map.axes[0]), along(map.axes[1])] });
        }
    }
    (own, across)
}

/// The middle of a square, in domain coordinates.
fn middle(k: usize) -> f64 {
    (k as f64 + 0.5) * (2.0 / SQUARES as f64) - 1.0
}

/// How much the points across the chart speak against a surface in each square: each has a vote, less the
/// farther it is, and the nearer to the chart.
fn contradicted(map: &Monge, across: &[Across], empty: f64, reach: f64) -> Vec<f64> {
    let [a, b] = map.radii;
    let high = BLEND.trim_high * empty;
    let mut votes = vec![0.0; SQUARES * SQUARES];
    for Across { at, height, normal } in across {
        let span = |x: f64, radius: f64| {
            let square =
                |x: f64| ((x / radius + 1.0) * 0.5 * SQUARES as f64).clamp(0.0, SQUARES as f64 - 1.0);
            square(x - reach) as usize..=square(x + reach) as usize
        };
        for i in span(at[0], a) {
            for j in span(at[1], b) {
                let d = [middle(i) * a - at[0], middle(j) * b - at[1]];
                let near = 1.0 - (d[0] * d[0] + d[1] * d[1]) / (reach * reach) - (height / high).powi(2);
                if near > 0.0 {
                    let before = (normal[0] * d[0] + normal[1] * d[1]) / empty;
                    let votes = &mut votes[i * SQUARES + j];
                    *votes -= near * before.clamp(-1.0, 1.0) * (height / empty).clamp(-1.0, 1.0);
                }
            }
        }
    }
    votes
}

/// The squares that are contradicted and hold no point of the chart's sheet so far about them.
fn trimmed(map: &Monge, own: &[[f64; 2]], contradicted: &[f64], empty: f64) -> Option<Box<Trimmed>> {
    let mut out: Trimmed = [0; SQUARES];
    for (i, row) in out.iter_mut().enumerate() {
        for j in (0..SQUARES).filter(|j| contradicted[i * SQUARES + j] > BLEND.trim_votes) {
            let (x, y) = (middle(i) * map.radii[0], middle(j) * map.radii[1]);
            let far = |o: &[f64; 2]| (o[0] - x).powi(2) + (o[1] - y).powi(2) >= empty * empty;
            *row |= u32::from(own.iter().all(far)) << j;
        }
    }
    (out != [0; SQUARES]).then(|| Box::new(out))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// Half width of what stands on the sheet, in spacings.
    const HALF: f64 = 1.2;

    /// The mask at the middle and beside it of a level chart that faces up. Its points are one unit apart but
    /// for a strip; walls stand on the strip's edges, or hang from them, whose normals point from or to it.
    fn masks(up: bool, outward: bool) -> [f64; 2] {
        let mut projected = Vec::new();
        let up_ward = Vec3([0.0, 0.0, 1.0]);
        for (i, j) in (-8..=8).flat_map(|i| (-8..=8).map(move |j| (f64::from(i), f64::from(j)))) {
            let x = if i < 0.0 { i + 1.0 - HALF } else { i + HALF };
            projected.push(ProjectedPoint { position: Vec3([x, j, 0.0]), normal: up_ward, chart: 0 });
        }
        for (side, j, k) in [-1.0, 1.0].into_iter().flat_map(|side| {
            (-8..=8).flat_map(move |j| (0..5).map(move |k| (side, f64::from(j), 0.5 + f64::from(k))))
        }) {
            let position = Vec3([side * HALF, j, if up { k } else { -k }]);
            let normal = Vec3([if outward { side } else { -side }, 0.0, 0.0]);
            projected.push(ProjectedPoint { position, normal, chart: 1 });
        }
        let points: Vec<Vec3> = projected.iter().map(|p| p.position).collect();
        let mut fitted = vec![FittedChart::flat(6.0, 0.05, 0..289)];
        let sampling = Sampling::new(vec![1.0; points.len()]);
        Run::default()
            .execute(|ctx| {
                trim(&mut fitted, &projected, &Neighbours::build(&points, ctx)?, &sampling, ctx)?;
                Ok([0.0, 0.5].map(|u| fitted[0].chart.mask_at([u, 0.05])))
            })
            .unwrap()
    }

    #[test]
    fn a_sheet_ends_under_a_plate_that_stands_on_it_and_at_the_mouth_of_a_slot() {
        assert_eq!(masks(true, true), [0.0, 1.0]);
        assert_eq!(masks(false, false), [0.0, 1.0]);
    }

    #[test]
    fn the_rim_of_a_plate_and_the_floor_of_a_groove_go_on_where_no_point_happens_to_lie() {
        assert_eq!(masks(false, true), [1.0, 1.0]);
        assert_eq!(masks(true, false), [1.0, 1.0]);
    }
}
