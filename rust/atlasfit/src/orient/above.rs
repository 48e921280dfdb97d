//! Whether a scan is ground, seen from above.
//!
//! In: points on the atlas, how dense they are, where the user's origin is. Out: a viewer far above, where
//! the third coordinate is up; that it is down; or nothing. Ground is wider than high, and from above nearly
//! all of it is seen. What lies flat and is seen from above is seen as well from below: that the third
//! coordinate is up is a convention, which files of surveyors keep.

use super::constants::ORIENT;
use super::views::{Piece, Views};
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// What is known of the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ground {
    /// The points are none.
    None,
    /// They are, seen by a viewer far above, who stands there.
    SeenFrom(Vec3),
    /// They are, but with the third coordinate down: their sides were seen better from below.
    UpsideDown,
}

/// Whether the points are ground, and who sees it. `part` names the connected part of the surface that
/// each chart is of: a part's normals agree among themselves. Lengths are in the normalised frame; `spacing`
/// is the median one, `noise` its standard deviation, `origin` that of the user's frame.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn ground(
    projected: &[ProjectedPoint],
    spacing: f64,
    noise: f64,
    part: &[u32],
    origin: Vec3,
    ctx: &Context<'_>,
) -> Result<Ground> {
    let on = || projected.iter().filter(|p| p.chart != u32::MAX);
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in on().map(|p| p.position) {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
        }
    }
    let size = [0, 1, 2].map(|k| high[k] - low[k]);
    let flat = size[2] < ORIENT.flat * size[0].min(size[1]);
    // Depth that a camera measured lies before it: its third axis looks into the scene.
    let inside = (0..2).all(|k| low[k] < origin[k] && origin[k] < high[k]);
    if !flat || inside && origin[2] < low[2] - size[2] {
        return Ok(Ground::None);
    }
    let side = ORIENT.cell * spacing;
    let cell = |p: Vec3| [0, 1].map(|k| (p[k] / side).floor() as i64);
    let mut columns: Vec<([i64; 2], &ProjectedPoint)> = on().map(|p| (cell(p.position), p)).collect();
    let count = columns.len();
    let height = |p: &ProjectedPoint| p.position[2];
    sort_by(&mut columns, |a, b| a.0.cmp(&b.0).then(height(a.1).total_cmp(&height(b.1))), ctx)?;
    let apart = ORIENT.above * noise.max(spacing);
    let mut hidden = 0;
    for (i, column) in columns.chunk_by(|a, b| a.0 == b.0).enumerate() {
        ctx.check_at(i)?;
        let top = column.last().map(|last| last.1);
        hidden += column.iter().filter(|(_, p)| top.is_some_and(|top| lies_below(p, top, apart))).count();
    }
    let seen = (hidden as f64) < ORIENT.hidden * count as f64;
    if !seen {
        return Ok(Ground::None);
    }
    if seen_better_from_below(projected, spacing, part, ctx)? {
        return Ok(Ground::UpsideDown);
    }
    Ok(Ground::SeenFrom(Vec3([0.0, 0.0, ORIENT.far_above])))
}

/// Whether viewers rather saw the parts from below: of ground, with an object on it, upside down.
fn seen_better_from_below(
    projected: &[ProjectedPoint],
    side: f64,
    part: &[u32],
    ctx: &Context<'_>,
) -> Result<bool> {
    let mut pieces: Vec<Vec<Piece>> = part.iter().map(|_| Vec::new()).collect();
    let mut upward = vec![0.0; part.len()];
    for (i, p) in projected.iter().enumerate() {
        ctx.check_at(i)?;
        if let Some(of) = pieces.get_mut(p.chart as usize) {
            of.push(Piece { position: p.position, normal: p.normal, side });
            upward[part[p.chart as usize] as usize] += p.normal[2];
        }
    }
    let mut signs: Vec<f64> = part.iter().map(|&part| upward[part as usize].signum()).collect();
    let views = Views::of(&pieces.iter().map(Vec::as_slice).collect::<Vec<_>>(), ctx)?;
    let all: Vec<u32> = (0..).zip(&pieces).filter(|(_, of)| !of.is_empty()).map(|(c, _)| c).collect();
    let above = views.likelihood(&all, &signs);
    signs.iter_mut().for_each(|s| *s = -*s);
    Ok(ORIENT.seen * (views.likelihood(&all, &signs) - above) > ORIENT.not_up)
}

/// Whether a point lies on another surface than one above it, which goes the same way: not on one that is
/// steep, or meets its own.
fn lies_below(p: &ProjectedPoint, top: &ProjectedPoint, apart: f64) -> bool {
    let between = top.position - p.position;
    let along = p.normal.dot(top.normal).abs() > ORIENT.same_way;
    along && p.normal.dot(between).abs().min(top.normal.dot(between).abs()) > apart
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::numeric::Rng;

    fn found(points: &[[Vec3; 2]], origin: Vec3) -> bool {
        let on = |&[position, normal]: &[Vec3; 2]| ProjectedPoint { position, normal, chart: 0 };
        let projected: Vec<_> = points.iter().map(on).collect();
        let out = Run::default().execute(|ctx| ground(&projected, 0.02, 0.005, &[0], origin, ctx));
        matches!(out.expect("nothing stops it"), Ground::SeenFrom(_))
    }

    /// Steep ground with a house on it: places and normals.
    fn house() -> Vec<[Vec3; 2]> {
        let mut rng = Rng::new(2);
        let mut at = || rng.uniform() - 0.5;
        let ground = |x: f64| [0.05 * (9.0 * x).sin(), 0.45 * (9.0 * x).cos()];
        (0..4000)
            .map(|_| [at(), at()])
            .map(|[x, y]| match x.abs().max(y.abs()) {
                0.0..0.2 => [Vec3([x, y, 0.2]), Vec3([0.0, 0.0, 1.0])],
                _ => [Vec3([x, y, ground(x)[0]]), Vec3([-ground(x)[1], 0.0, 1.0]).normalized()],
            })
            .collect()
    }

    #[test]
    fn a_house_on_the_ground_is_ground_and_what_has_two_sides_or_a_depth_picture_is_none() {
        let house = house();
        assert!(found(&house, Vec3([-3000.0, 50.0, -7.0])) && found(&house, Vec3::ZERO));
        assert!(!found(&house, Vec3([0.0, 0.0, -1.0])), "a camera looks along its third axis");
        for thick in [0.03, 0.2] {
            let two = house.iter().flat_map(|&[p, n]| [[p, n], [p - Vec3([0.0, 0.0, thick]), -n]]);
            assert!(!found(&two.collect::<Vec<_>>(), Vec3::ZERO), "a plate {thick} thick");
        }
        let upright: Vec<[Vec3; 2]> = house.iter().map(|p| p.map(|x| Vec3([x[0], x[2], x[1]]))).collect();
        assert!(!found(&upright, Vec3::ZERO));
    }
}
