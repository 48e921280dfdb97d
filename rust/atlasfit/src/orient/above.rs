//! Whether a scan is ground, seen from above.
//!
//! In: points on the atlas, how dense they are, where the user's origin is. Out: a viewer far above, where the
//! third coordinate is up; or nothing. Ground is wider than high, and from above nearly all of it is seen. What
//! lies flat and is seen from above is seen as well from below: that the third coordinate is up is a
//! convention, which files of surveyors keep.

use super::constants::ORIENT;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// A viewer far above the points, if they are ground. Lengths are in the normalised frame; `spacing` is the
/// median one, `origin` that of the user's frame.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn viewer_above(
    projected: &[ProjectedPoint],
    spacing: f64,
    origin: Vec3,
    ctx: &Context<'_>,
) -> Result<Option<Vec3>> {
    let on = || projected.iter().filter(|p| p.chart != u32::MAX).map(|p| p.position);
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in on() {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
        }
    }
    let size = [0, 1, 2].map(|k| high[k] - low[k]);
    let flat = size[2] < ORIENT.flat * size[0].min(size[1]);
    // Depth that a camera measured lies before it: its third axis looks into the scene.
    let inside = (0..2).all(|k| low[k] < origin[k] && origin[k] < high[k]);
    if !flat || inside && origin[2] < low[2] - size[2] {
        return Ok(None);
    }
    let side = ORIENT.cell * spacing;
    let cell = |p: Vec3| [0, 1].map(|k| (p[k] / side).floor() as i64);
    let mut columns: Vec<([i64; 2], f64)> = on().map(|p| (cell(p), p[2])).collect();
    let count = columns.len();
    sort_by(&mut columns, |a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)), ctx)?;
    let mut hidden = 0;
    for (i, column) in columns.chunk_by(|a, b| a.0 == b.0).enumerate() {
        ctx.check_at(i)?;
        // What lies below the topmost gap. A wall has none.
        let gap = column.windows(2).rposition(|w| w[1].1 - w[0].1 > ORIENT.gap * side);
        hidden += gap.map_or(0, |at| at + 1);
    }
    let seen = (hidden as f64) < ORIENT.hidden * count as f64;
    Ok(seen.then_some(Vec3([0.0, 0.0, ORIENT.far_above])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::numeric::Rng;

    fn found(points: &[Vec3], origin: Vec3) -> bool {
        let on = |&position: &Vec3| ProjectedPoint { position, normal: Vec3::ZERO, chart: 0 };
        let projected: Vec<_> = points.iter().map(on).collect();
        let out = Run::default().execute(|ctx| viewer_above(&projected, 0.02, origin, ctx));
        out.expect("nothing stops it").is_some()
    }

    /// Ground with a house on it.
    fn house() -> Vec<Vec3> {
        let mut rng = Rng::new(2);
        let mut at = || rng.uniform() - 0.5;
        (0..4000)
            .map(|_| [at(), at()])
            .map(|[x, y]| Vec3([x, y, if x.abs().max(y.abs()) < 0.2 { 0.1 } else { 0.02 * (9.0 * x).sin() }]))
            .collect()
    }

    #[test]
    fn a_house_on_the_ground_is_ground_and_a_plate_with_two_sides_or_a_depth_picture_is_none() {
        let house = house();
        assert!(found(&house, Vec3([-3000.0, 50.0, -7.0])) && found(&house, Vec3::ZERO));
        assert!(!found(&house, Vec3([0.0, 0.0, -1.0])), "a camera looks along its third axis");
        let plate: Vec<Vec3> = house.iter().flat_map(|&p| [p, p - Vec3([0.0, 0.0, 0.2])]).collect();
        assert!(!found(&plate, Vec3::ZERO));
        let upright: Vec<Vec3> = house.iter().map(|p| Vec3([p[0], p[2], p[1]])).collect();
        assert!(!found(&upright, Vec3::ZERO));
    }
}
