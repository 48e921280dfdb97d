//! What changed between two scans of the same thing, and what of it is more than their uncertainty allows.
//!
//! In: the surface of one scan and the points of the other, denoised, each with its standard deviation. Out:
//! for each point its signed distance from the surface, that distance's own standard deviation, and whether
//! the distance is significant: the question of M3C2 (Lague, Brodu and Leroux 2013), with both scans'
//! uncertainty from their fits in place of the roughness of neighbourhoods.

use super::locate::{Foot, Locator};
use super::memory::ADVICE;
use crate::error::{Error, Result};
use crate::geometry::names::{EXTRAPOLATED, UNCERTAINTY};
use crate::geometry::{Attribute, PointCloud, TriMesh};
use crate::numeric::special::normal_quantile;
use crate::numeric::stats::median;
use crate::numeric::vec3::{self, Vec3};
use crate::run::{Context, Stage};
use crate::setters::setters;
use crate::spatial::bvh::Aabb;
use rayon::prelude::*;

/// Cosine of the angle between the way to the surface and its normal below which a point lies beside the
/// surface's end, not over it.
const OVER: f64 = 0.7;
/// Standard deviations within which a point lies on the surface, whichever way it is off.
const ON: f64 = 3.0;
/// The largest distance, as a share of the surface's longest side, where none is given.
const REACH: f64 = 0.1;
/// Bytes for each point: its foot, distances, the columns of the result. Derived.
const BYTES_PER_POINT: u64 = 300;
/// Below this share of the points over the surface the scans do not overlap.
const OVERLAP: f64 = 0.01;

/// What counts as change.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CompareOptions {
    /// How sure a change must be, in (0, 1): 0.99 flags one in a hundred points where nothing changed.
    pub level: f64,
    /// How far the two scans' frames may be off each other, in their unit, 0 or more: distances below are no
    /// change.
    pub registration: f64,
    /// Points farther than this from the surface have no counterpart on it; `None`: a tenth of its longest
    /// side.
    pub max_distance: Option<f64>,
}

setters! {
    CompareOptions {
        with_level: level: f64,
        with_registration: registration: f64,
        with_max_distance: max_distance: Option<f64>,
    }
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self { level: 0.99, registration: 0.0, max_distance: None }
    }
}

/// What changed. One entry per point; not a number where a point has no counterpart.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// Signed distance from the surface, positive where its normal points.
    pub distance: Vec<f64>,
    /// The distance's standard deviation.
    pub uncertainty: Vec<f64>,
    /// Whether the distance is more than the uncertainty allows.
    pub significant: Vec<bool>,
    /// Points with a counterpart.
    pub compared: usize,
    /// Points with a significant distance.
    pub changed: usize,
    /// The middle one of the least distances that would be significant.
    pub detectable: f64,
    /// Root mean square of the distances.
    pub rms: f64,
    /// Middle one of the distances: far from 0 where the scans' frames differ.
    pub median: f64,
}

/// Compares denoised points with the surface of an earlier scan, in one frame. Both carry an attribute of
/// standard deviations, [`UNCERTAINTY`]; vertices of the surface whose attribute [`EXTRAPOLATED`] is not 0
/// are no counterpart.
///
/// ```
/// use atlasfit::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
/// use atlasfit::measure::{CompareOptions, compare};
/// use atlasfit::{Run, pipeline::UNCERTAINTY};
/// let sure = |n: usize| Attribute {
///     name: UNCERTAINTY.into(), width: 1, kind: ScalarKind::F32, values: vec![0.01; n],
/// };
/// let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let mut before = TriMesh::new(corners, vec![[0, 1, 2]]);
/// before.attributes.push(sure(3));
/// let mut after = PointCloud::from_positions(vec![[0.2, 0.2, 0.001], [0.3, 0.2, -0.08]]);
/// after.attributes.push(sure(2));
/// let options = CompareOptions::default();
/// let change = Run::default().execute(|ctx| compare(&before, &after, &options, ctx))?;
/// assert_eq!(change.significant, [false, true]);
/// # Ok::<(), atlasfit::Error>(())
/// ```
///
/// # Errors
/// [`Error::InvalidArgument`] for options out of range and without the attributes; [`Error::Degenerate`] for
/// scans that do not overlap; [`Error::EmptyInput`] without points or faces; cancel and limits.
pub fn compare(
    surface: &TriMesh,
    points: &PointCloud,
    options: &CompareOptions,
    ctx: &Context<'_>,
) -> Result<Comparison> {
    check(options)?;
    let of_surface = column(&surface.attributes, UNCERTAINTY, surface.positions.len(), "the surface")?;
    let of_points = column(&points.attributes, UNCERTAINTY, points.len(), "the points")?;
    let invented = Attribute::named(&surface.attributes, EXTRAPOLATED).map(|a| &a.values[..]);
    ctx.reserve(surface.bytes() + points.bytes() + BYTES_PER_POINT * points.len() as u64, ADVICE)?;
    let boxes = [&surface.positions, &points.positions].map(|p| Aabb::of(&finite(p)));
    let reach = options.max_distance.unwrap_or(REACH * boxes[0].longest_side());
    let apart = (0..3)
        .any(|k| boxes[0].min[k] - reach > boxes[1].max[k] || boxes[1].min[k] - reach > boxes[0].max[k]);
    if apart {
        return Err(no_overlap("their boxes lie apart".into()));
    }
    ctx.stage(Stage::Measure, points.len());
    let feet = Locator::new(surface, ctx)?.nearest_all(vec3::of(&points.positions), ctx)?;
    let side = side(surface, points, &feet);
    let factor = normal_quantile(0.5 + 0.5 * options.level);
    let over = |i: usize| -> [f64; 2] {
        let Some(foot) = &feet[i] else { return [f64::NAN; 2] };
        let at = Place::of(surface, foot, of_surface, invented);
        let way = Vec3(points.positions[i]) - foot.point;
        let (distance, length) = (way.dot(at.normal), way.norm());
        let sd = at.sd.hypot(of_points[i]);
        let faces_away =
            points.normals.as_ref().is_some_and(|n| side * Vec3(n[i].map(f64::from)).dot(at.normal) < 0.0);
        // On the surface it does not matter which way a point faces: one-sided surfaces face neither.
        let is_on = length <= ON * sd;
        let is_over = is_on || distance.abs() >= OVER * length && !faces_away;
        let counts = is_over && !at.invented && length <= reach && sd.is_finite();
        if counts { [distance, sd] } else { [f64::NAN; 2] }
    };
    let all: Vec<[f64; 2]> = (0..points.len()).into_par_iter().map(over).collect();
    ctx.check()?;
    summary(&all, factor, options)
}

fn summary(all: &[[f64; 2]], factor: f64, options: &CompareOptions) -> Result<Comparison> {
    let limit = |sd: f64| factor * sd + options.registration;
    let known: Vec<[f64; 2]> = all.iter().copied().filter(|[d, _]| d.is_finite()).collect();
    if (known.len() as f64) < OVERLAP * all.len() as f64 || known.is_empty() {
        return Err(no_overlap(format!(
            "{} of {} points lie over the other scan's surface",
            known.len(),
            all.len()
        )));
    }
    let significant: Vec<bool> = all.iter().map(|[d, sd]| d.abs() > limit(*sd)).collect();
    let middle = |of: &dyn Fn(&[f64; 2]) -> f64| median(&mut known.iter().map(of).collect::<Vec<_>>());
    Ok(Comparison {
        compared: known.len(),
        changed: significant.iter().filter(|s| **s).count(),
        detectable: middle(&|[_, sd]| limit(*sd)),
        rms: (known.iter().map(|[d, _]| d * d).sum::<f64>() / known.len() as f64).sqrt(),
        median: middle(&|[d, _]| *d),
        distance: all.iter().map(|a| a[0]).collect(),
        uncertainty: all.iter().map(|a| a[1]).collect(),
        significant,
    })
}

fn no_overlap(what: String) -> Error {
    Error::degenerate(
        format!("the scans do not overlap: {what}"),
        "Bring both into one frame and unit (register them), or give a larger largest distance",
    )
}

fn check(o: &CompareOptions) -> Result<()> {
    if !(o.level > 0.0 && o.level < 1.0) {
        return Err(Error::invalid(format!("level is {}", o.level), "Give a number between 0 and 1"));
    }
    for (name, length) in [("registration", Some(o.registration)), ("max_distance", o.max_distance)] {
        if let Some(length) = length
            && !(length >= 0.0 && length.is_finite())
        {
            return Err(Error::invalid(format!("{name} is {length}"), "Give a length, 0 or more"));
        }
    }
    Ok(())
}

/// The standard deviations of `count` things.
fn column<'a>(attributes: &'a [Attribute], name: &str, count: usize, of: &str) -> Result<&'a [f64]> {
    let found = Attribute::named(attributes, name).filter(|a| a.width == 1 && a.values.len() == count);
    found.map(|a| &a.values[..]).ok_or_else(|| {
        Error::invalid(format!("{of} have no attribute \"{name}\""), "Denoise both scans with uncertainty")
    })
}

fn finite(at: &[[f64; 3]]) -> Vec<Vec3> {
    at.iter().copied().map(Vec3).filter(|p| p.iter().all(|x| x.is_finite())).collect()
}

/// The corners of the triangle that a foot lies on.
fn corners(surface: &TriMesh, foot: &Foot) -> [Vec3; 3] {
    surface.triangles[foot.triangle as usize].map(|v| Vec3(surface.positions[v as usize]))
}

/// A place of the surface.
struct Place {
    normal: Vec3,
    sd: f64,
    invented: bool,
}

impl Place {
    fn of(surface: &TriMesh, foot: &Foot, sd: &[f64], invented: Option<&[f64]>) -> Self {
        let t = surface.triangles[foot.triangle as usize].map(|v| v as usize);
        let [a, b, c] = corners(surface, foot);
        let face = (b - a).cross(c - a);
        // Barycentric weights: areas opposite to the corners.
        let area = |p: Vec3, q: Vec3| (p - foot.point).cross(q - foot.point).dot(face).max(0.0);
        let weights = [area(b, c), area(c, a), area(a, b)];
        let total: f64 = weights.iter().sum();
        let weights = if total > 0.0 { weights.map(|w| w / total) } else { [1.0, 0.0, 0.0] };
        let mixed = |of: &dyn Fn(usize) -> f64| (0..3).map(|k| weights[k] * of(t[k])).sum::<f64>();
        Self {
            normal: face.normalized(),
            sd: mixed(&|v| sd[v]),
            invented: invented.is_some_and(|e| t.iter().any(|&v| e[v] != 0.0)),
        }
    }
}

/// Which way the points face: 1 as the surface, -1 against it. Open scans may be turned either way.
fn side(surface: &TriMesh, points: &PointCloud, feet: &[Option<Foot>]) -> f64 {
    let Some(normals) = &points.normals else { return 1.0 };
    let agree: f64 = (feet.iter().zip(normals))
        .filter_map(|(foot, n)| {
            let [a, b, c] = corners(surface, foot.as_ref()?);
            let with = (b - a).cross(c - a).dot(Vec3(n.map(f64::from)));
            Some(if with == 0.0 { 0.0 } else { with.signum() })
        })
        .sum();
    if agree < 0.0 { -1.0 } else { 1.0 }
}
