//! Which way a scan's points are known to face.
//!
//! In: what the user gave: a viewpoint, or the cloud's normals or scanners. Out: a direction per point of the
//! prepared scan, or nothing; then depth cameras tell that rounding shows, or the density of the points where
//! scanners stood, if they do, or the surface's own shape decides.

use super::constants::PIPELINE;
use super::options::DenoiseOptions;
use super::prepare::{Frame, Scan};
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::geometry::PointCloud;
use crate::noise::Camera;
use crate::numeric::vec3::Vec3;
use crate::orient::{self, Ground};
use crate::run::Context;
use crate::spatial::spacing::Sampling;

/// Which way a scan's points are known to face.
pub(super) struct Known {
    /// For each point of the scan a unit vector to the side that it faces, zero where that is not known.
    pub toward: Vec<Vec3>,
    /// Where they were seen from, in the scan's frame, if one place is said: what is hidden from there is not
    /// known.
    pub viewpoint: Option<Vec3>,
}

/// What is known of the points' sides; `None` where nothing is. A viewpoint goes before normals, and normals
/// before scanners: normals say more, and the user most.
pub(super) fn given(
    cloud: &PointCloud,
    options: &DenoiseOptions,
    scan: &Scan,
    ctx: &Context<'_>,
) -> Result<Option<Known>> {
    let Some(of_input) = directions(cloud, options) else { return Ok(None) };
    let mut toward = vec![Vec3::ZERO; scan.points.len()];
    for (i, &p) in scan.input.of_input.iter().enumerate() {
        ctx.check_at(i)?;
        if let Some(sum) = toward.get_mut(p as usize) {
            let direction = of_input(i);
            if direction.iter().all(|x| x.is_finite()) {
                *sum += direction;
            }
        }
    }
    // Points that lie on each other are one: they face the mean of their directions.
    toward.iter_mut().for_each(|t| *t = if *t == Vec3::ZERO { *t } else { t.normalized() });
    let viewpoint = options.viewpoint.map(|v| (Vec3(v) - scan.frame.origin) * (1.0 / scan.frame.scale));
    Ok(toward.iter().any(|t| *t != Vec3::ZERO).then_some(Known { toward, viewpoint }))
}

/// For each given point a unit vector to the side that it faces, zero or not finite where that is not known;
/// `None` where nothing is known of any.
pub(super) fn directions<'a>(
    cloud: &'a PointCloud,
    options: &DenoiseOptions,
) -> Option<Box<dyn Fn(usize) -> Vec3 + 'a>> {
    let from = |viewpoint: [f64; 3], i: usize| {
        let way = Vec3(viewpoint) - Vec3(cloud.positions[i]);
        // Squares of far coordinates are beyond what numbers hold.
        let longest = way.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        way.map(|x| x / longest).normalized()
    };
    Some(match (options.viewpoint, &cloud.normals, &cloud.scanners) {
        (Some(viewpoint), ..) => Box::new(move |i| from(viewpoint, i)),
        (None, Some(normals), _) => Box::new(|i| Vec3(normals[i].map(f64::from)).normalized()),
        (None, None, Some(s)) => Box::new(move |i| match s.positions.get(s.of_point[i] as usize) {
            Some(&scanner) => from(scanner, i),
            None => Vec3::ZERO,
        }),
        (None, None, None) => return None,
    })
}

/// What the search for those who saw the scan looks at.
#[derive(Clone, Copy)]
pub(super) struct Looked<'a> {
    /// The points on the charts.
    pub projected: &'a [ProjectedPoint],
    pub sampling: &'a Sampling,
    /// How many of the scanner's points were averaged for each, where some were.
    pub count: &'a [u32],
    /// The connected part of the surface that each chart is of.
    pub part: &'a [u32],
    /// Depth cameras that rounding shows.
    pub cameras: &'a [Camera],
}

/// Which way the points face that depth cameras saw, as far as these are known: each saw one side of its
/// points, before which nothing lies; if that is so of both, the side that most of them face by now. Nothing
/// where none is known, and of a camera before which the surface lies both ways: its steps are the file's.
fn toward_cameras(looked: Looked<'_>, ctx: &Context<'_>) -> Result<Option<Known>> {
    let Looked { projected, sampling, cameras, .. } = looked;
    let mut toward = vec![Vec3::ZERO; projected.len()];
    for Camera { axis, points } in cameras {
        let open = orient::open_along(*axis, points, projected, sampling.median, ctx)?;
        let facing: f64 = points.iter().map(|&p| projected[p as usize].normal.dot(*axis)).sum();
        let clear = open.unwrap_or_default().map(|open| open >= 1.0 - PIPELINE.most_hidden);
        let side = match clear {
            [true, true] => facing.signum(),
            [true, false] => 1.0,
            [false, true] => -1.0,
            [false, false] => continue,
        };
        points.iter().for_each(|&p| toward[p as usize] = *axis * side);
    }
    Ok(toward.iter().any(|t| *t != Vec3::ZERO).then_some(Known { toward, viewpoint: None }))
}

/// Where scanners stood that measured the scan, as far as the density of the points tells.
fn scanners(looked: Looked<'_>, frame: Frame, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let Looked { projected, sampling, count, part, .. } = looked;
    // What tells of a scanner is how much of the surface each of its own points stands for.
    let given = |(k, spacing): (usize, &f32)| match count.get(k) {
        Some(&count) => spacing / (count as f32).sqrt(),
        None => *spacing,
    };
    let spacing: Vec<f32> = sampling.spacing.iter().enumerate().map(given).collect();
    let one = orient::find_scanner(projected, &spacing, part, origin(frame), ctx)?;
    let mut viewers = Vec::new();
    if !one.is_some_and(|one| one.all_face) {
        viewers = orient::find_stations(projected, &spacing, part, ctx)?;
    }
    if viewers.is_empty() {
        viewers.extend(one.map(|one| one.at));
    }
    Ok(viewers)
}

/// Who saw a scan.
pub(super) enum Viewers {
    /// The points do not tell.
    None,
    /// Depth cameras, with which way the points face them.
    Cameras(Known),
    /// Scanners at these places.
    Scanners(Vec<Vec3>),
    /// Viewers above the ground, far away.
    Above(Vec3),
    /// Viewers above ground that is upside down.
    Below,
}

/// Who saw the scan: depth cameras that rounding shows, scanners, as far as the density of the points tells,
/// or viewers above the ground. `noise` is its standard deviation.
pub(super) fn viewers(looked: Looked<'_>, noise: f64, frame: Frame, ctx: &Context<'_>) -> Result<Viewers> {
    if let Some(known) = toward_cameras(looked, ctx)? {
        return Ok(Viewers::Cameras(known));
    }
    let scanners = scanners(looked, frame, ctx)?;
    if !scanners.is_empty() {
        return Ok(Viewers::Scanners(scanners));
    }
    let Looked { projected, sampling, part, .. } = looked;
    Ok(match orient::ground(projected, sampling.median, noise, part, origin(frame), ctx)? {
        Ground::None => Viewers::None,
        Ground::SeenFrom(above) => Viewers::Above(above),
        Ground::UpsideDown => Viewers::Below,
    })
}

/// The origin of the user's frame.
fn origin(frame: Frame) -> Vec3 {
    frame.origin.map(|x| -x / frame.scale)
}
