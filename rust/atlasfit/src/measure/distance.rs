//! How far a result is from the truth, both ways.
//!
//! In: a result (mesh or points) and the true surface, in one frame. Out: accuracy (result to truth),
//! completeness (truth to result), the Chamfer distance between samples of both beside its floor (truth
//! against truth), F-score, agreement of normals. Lengths are in the unit of the input.

use super::chamfer::chamfer;
use super::locate::{Foot, Locator};
use super::memory::{ADVICE, Counts, distance_work};
use super::sample::{Sample, area_vector, uniform};
use super::statistics::Distances;
use super::topology::{Topology, topology};
use crate::error::{Error, Result};
use crate::geometry::{PointCloud, TriMesh};
use crate::numeric::vec3::{self, Vec3};
use crate::run::{Context, Stage};
use crate::setters::setters;
use crate::spatial::bvh::Aabb;
use rayon::prelude::*;

/// The F-score's distance as a share of the longest side of the truth's bounding box, where no distance is
/// given.
pub const F_SCORE_SHARE: f64 = 0.005;

/// The largest number of samples of a surface: more take many gigabytes.
const MOST_SAMPLES: usize = 100_000_000;

/// What to sample and how finely.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DistanceOptions {
    /// Samples of each surface for accuracy and completeness, 1 to 100 million. Default 60,000.
    pub samples: usize,
    /// Samples of each surface for the Chamfer distance, 1 to 100 million. Its floor depends on it. Default
    /// 16,000: the paper's benchmark takes "16K points" (*Deep Manifold Prior*, section 5.1).
    pub chamfer_samples: usize,
    /// Distance below which a sample counts for the F-score, positive; `None`, the default: [`F_SCORE_SHARE`]
    /// of the truth's longest side.
    pub threshold: Option<f64>,
}

setters! {
    DistanceOptions {
        with_samples: samples: usize,
        with_chamfer_samples: chamfer_samples: usize,
        with_threshold: threshold: Option<f64>,
    }
}

impl Default for DistanceOptions {
    fn default() -> Self {
        Self { samples: 60_000, chamfer_samples: 16_000, threshold: None }
    }
}

/// A result mesh against the true surface.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SurfaceDistance {
    /// [`chamfer`] distance between samples of both: squared length.
    pub chamfer: f64,
    /// The same between two sets of samples of the truth: no result can be expected to be below.
    pub chamfer_floor: f64,
    /// Result to truth.
    pub accuracy: Distances,
    /// Truth to result.
    pub completeness: Distances,
    /// Harmonic mean of the shares of samples within the threshold, both ways, in [0, 1].
    pub f_score: f64,
    /// The threshold that was used: a length.
    pub threshold: f64,
    /// Mean absolute cosine between the result's normals and the truth's at the nearest point, in [0, 1].
    pub normal_consistency: f64,
    /// The same with sign, in [-1, 1]: negative for a surface that is inside out.
    pub normal_orientation: f64,
    /// How the result hangs together.
    pub topology: Topology,
}

/// Points against the true surface.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PointDistance {
    /// Points to truth.
    pub accuracy: Distances,
    /// Chamfer distance between the points and samples of the truth: squared length.
    pub chamfer: f64,
    /// What as many samples of the truth as there are points give instead of the points.
    pub chamfer_floor: f64,
    /// Points that were not finite and were left out.
    pub not_finite: usize,
}

/// Measures a mesh against the true surface, in one frame. The samples follow the run's seed.
///
/// # Errors
/// [`Error::EmptyInput`], [`Error::Degenerate`], [`Error::IndexOutOfRange`] for a mesh without surface;
/// [`Error::InvalidArgument`] for an option out of range; cancel and time limit.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure};
/// let at = |z: f64| TriMesh::new(vec![[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]], vec![[0, 1, 2]]);
/// let options = measure::DistanceOptions::default().with_samples(1000).with_chamfer_samples(1000);
/// let d = Run::default().execute(|ctx| measure::surface(&at(0.25), &at(0.0), &options, ctx))?;
/// assert!((d.accuracy.rms - 0.25).abs() < 1e-12 && (d.completeness.max - 0.25).abs() < 1e-12);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn surface(
    result: &TriMesh,
    truth: &TriMesh,
    options: &DistanceOptions,
    ctx: &Context<'_>,
) -> Result<SurfaceDistance> {
    check(options)?;
    ctx.reserve(distance_memory_needed(result, truth, options, ctx.threads()), ADVICE)?;
    ctx.stage(Stage::Measure, 2 * options.samples + 4 * options.chamfer_samples);
    let (to_truth, to_result) = (Locator::new(truth, ctx)?, Locator::new(result, ctx)?);
    ctx.check()?;
    let on_result = uniform(result, options.samples, ctx.seed ^ 1, ctx)?;
    let on_truth = uniform(truth, options.samples, ctx.seed ^ 2, ctx)?;
    let forth = feet(&to_truth, &on_result, ctx)?;
    let back = feet(&to_result, &on_truth, ctx)?;

    let cosines: Vec<f64> = on_result
        .par_iter()
        .zip(&forth)
        .map(|(s, f)| {
            let ours = area_vector(result, s.triangle as usize).normalized();
            ours.dot(area_vector(truth, f.triangle as usize).normalized())
        })
        .collect();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / cosines.len() as f64;

    let finite: Vec<Vec3> =
        truth.positions.iter().copied().map(Vec3).filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let threshold = options.threshold.unwrap_or_else(|| F_SCORE_SHARE * Aabb::of(&finite).longest_side());
    let within = |feet: &[Foot]| {
        feet.iter().filter(|f| f.distance2.sqrt() < threshold).count() as f64 / feet.len() as f64
    };
    let (precision, recall) = (within(&forth), within(&back));

    let (chamfer, chamfer_floor) = chamfer_and_floor(result, truth, options.chamfer_samples, ctx)?;
    Ok(SurfaceDistance {
        chamfer,
        chamfer_floor,
        accuracy: Distances::of(forth.iter().map(|f| f.distance2.sqrt()).collect()),
        completeness: Distances::of(back.iter().map(|f| f.distance2.sqrt()).collect()),
        f_score: 2.0 * precision * recall / (precision + recall).max(1e-9),
        threshold,
        normal_consistency: mean(&mut cosines.iter().map(|c| c.abs())),
        normal_orientation: mean(&mut cosines.iter().copied()),
        topology: topology(result, ctx)?,
    })
}

/// Measures points against the true surface, in one frame. The points themselves are measured, not samples of
/// them.
///
/// # Errors
/// As [`surface`].
///
/// ```
/// use atlasfit::{Run, geometry::{PointCloud, TriMesh}, measure};
/// let truth = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// let cloud = PointCloud::from_positions(vec![[0.2, 0.2, 0.5], [0.1, 0.1, -0.5]]);
/// let options = measure::DistanceOptions::default();
/// let d = Run::default().execute(|ctx| measure::points(&cloud, &truth, &options, ctx))?;
/// assert_eq!(d.accuracy.mean, 0.5);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn points(
    cloud: &PointCloud,
    truth: &TriMesh,
    options: &DistanceOptions,
    ctx: &Context<'_>,
) -> Result<PointDistance> {
    Ok(points_each(cloud, truth, options, ctx)?.0)
}

/// As [`points`], with the distance of each point to the surface, infinite for points that are not finite.
///
/// # Errors
/// As [`points`].
///
/// ```
/// use atlasfit::Run;
/// use atlasfit::geometry::{PointCloud, TriMesh};
/// use atlasfit::measure::{DistanceOptions, distance::points_each};
/// let truth = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// let cloud = PointCloud::from_positions(vec![[0.2, 0.2, 0.0], [0.2, 0.2, 0.5]]);
/// let options = DistanceOptions::default();
/// let (_, each) = Run::default().execute(|ctx| points_each(&cloud, &truth, &options, ctx))?;
/// assert!(each[0] < 1e-12 && each[1] == 0.5);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn points_each(
    cloud: &PointCloud,
    truth: &TriMesh,
    options: &DistanceOptions,
    ctx: &Context<'_>,
) -> Result<(PointDistance, Vec<f64>)> {
    check(options)?;
    let counts = Counts { points: cloud.len(), faces: 0 };
    let work = distance_work(counts, counts_of(truth), samples(counts, options), ctx.threads());
    ctx.reserve(cloud.bytes() + truth.bytes() + work, ADVICE)?;
    let finite: Vec<Vec3> =
        cloud.positions.iter().copied().map(Vec3).filter(|p| p.iter().all(|x| x.is_finite())).collect();
    if finite.is_empty() {
        return Err(Error::empty(
            format!("none of {} points is finite", cloud.len()),
            "Give points to measure",
        ));
    }
    ctx.stage(Stage::Measure, 3 * finite.len() + 2 * options.chamfer_samples);
    let feet = Locator::new(truth, ctx)?.nearest_all(vec3::of(&cloud.positions), ctx)?;
    let distance = |f: &Foot| f.distance2.sqrt();
    let samples = positions(&uniform(truth, options.chamfer_samples, ctx.seed ^ 3, ctx)?);
    let others = positions(&uniform(truth, finite.len(), ctx.seed ^ 4, ctx)?);
    let all = PointDistance {
        accuracy: Distances::of(feet.iter().flatten().map(distance).collect()),
        chamfer: chamfer(&finite, &samples, ctx)?,
        chamfer_floor: chamfer(&others, &samples, ctx)?,
        not_finite: cloud.len() - finite.len(),
    };
    Ok((all, feet.iter().map(|f| f.as_ref().map_or(f64::INFINITY, distance)).collect()))
}

/// Bytes that [`surface()`] needs at its peak with so many threads, both meshes included: a rough upper
/// bound. For [`points()`] the result is a mesh without triangles.
///
/// ```
/// use atlasfit::{geometry::TriMesh, measure::{DistanceOptions, distance_memory_needed}};
/// let mesh = TriMesh::new(vec![[0.0; 3]; 10_000], vec![[0, 1, 2]; 20_000]);
/// assert!(distance_memory_needed(&mesh, &mesh, &DistanceOptions::default(), 2) > 1 << 24);
/// ```
#[must_use]
pub fn distance_memory_needed(
    result: &TriMesh,
    truth: &TriMesh,
    options: &DistanceOptions,
    threads: usize,
) -> u64 {
    let (of_result, of_truth) = (counts_of(result), counts_of(truth));
    let work = distance_work(of_result, of_truth, samples(of_result, options), threads);
    (result.bytes() + truth.bytes()).saturating_add(work)
}

fn counts_of(mesh: &TriMesh) -> Counts {
    Counts { points: mesh.positions.len(), faces: mesh.triangles.len() }
}

/// Samples that are held at a time, measured points included.
fn samples(result: Counts, options: &DistanceOptions) -> usize {
    match result.faces {
        0 => result.points.saturating_mul(2).saturating_add(options.chamfer_samples),
        _ => options.samples.saturating_mul(2).saturating_add(options.chamfer_samples.saturating_mul(3)),
    }
}

pub(super) fn check(options: &DistanceOptions) -> Result<()> {
    if options.samples == 0 || options.chamfer_samples == 0 {
        return Err(Error::invalid("the number of samples is 0", "Give at least 1, or leave the default"));
    }
    let samples = options.samples.max(options.chamfer_samples);
    if samples > MOST_SAMPLES {
        return Err(Error::invalid(
            format!("the number of samples is {samples}"),
            format!("Give at most {MOST_SAMPLES}"),
        ));
    }
    match options.threshold {
        Some(t) if !(t > 0.0 && t.is_finite()) => Err(Error::invalid(
            format!("the F-score's threshold is {t}"),
            "Give a positive length in the unit of the meshes",
        )),
        _ => Ok(()),
    }
}

fn positions(samples: &[Sample]) -> Vec<Vec3> {
    samples.iter().map(|s| s.point).collect()
}

fn feet(locator: &Locator, samples: &[Sample], ctx: &Context<'_>) -> Result<Vec<Foot>> {
    Ok(locator.nearest_all(&positions(samples), ctx)?.into_iter().flatten().collect())
}

fn chamfer_and_floor(result: &TriMesh, truth: &TriMesh, n: usize, ctx: &Context<'_>) -> Result<(f64, f64)> {
    let ours = positions(&uniform(result, n, ctx.seed ^ 5, ctx)?);
    let one = positions(&uniform(truth, n, ctx.seed ^ 6, ctx)?);
    let two = positions(&uniform(truth, n, ctx.seed ^ 7, ctx)?);
    Ok((chamfer(&ours, &one, ctx)?, chamfer(&two, &one, ctx)?))
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{sheet, sphere};
    use super::*;
    use crate::run::Run;

    fn measure(result: &TriMesh, truth: &TriMesh) -> SurfaceDistance {
        Run::default().execute(|ctx| surface(result, truth, &DistanceOptions::default(), ctx)).unwrap()
    }

    fn moved(mesh: &TriMesh, f: impl Fn(Vec3) -> Vec3) -> TriMesh {
        TriMesh::new(mesh.positions.iter().map(|p| f(Vec3(*p)).0).collect(), mesh.triangles.clone())
    }

    #[test]
    fn the_truth_against_itself_is_exact_and_its_chamfer_is_the_floor() {
        let truth = sphere(1.0, 24);
        let d = measure(&truth, &truth);
        assert!(d.accuracy.max < 1e-12 && d.completeness.max < 1e-12);
        assert!((d.f_score - 1.0).abs() < 1e-12 && (d.normal_consistency - 1.0).abs() < 1e-9);
        assert!((d.chamfer / d.chamfer_floor - 1.0).abs() < 0.05, "{d:?}");
        assert!((d.threshold - 0.01).abs() < 1e-4, "half a percent of the diameter: {}", d.threshold);
    }

    #[test]
    fn a_sheet_lifted_by_h_is_at_distance_h_both_ways() {
        let truth = sheet(1.0, 8);
        let d = measure(&moved(&truth, |p| p + Vec3([0.0, 0.0, 0.25])), &truth);
        for value in [d.accuracy.rms, d.accuracy.median, d.completeness.rms, d.completeness.p99] {
            assert!((value - 0.25).abs() < 1e-12, "{value}");
        }
        assert_eq!(d.f_score, 0.0);
        assert!(d.chamfer > 2.0 * 0.0625);
    }

    #[test]
    fn half_a_surface_is_accurate_and_incomplete() {
        let truth = sheet(1.0, 8);
        let half = TriMesh::new(
            truth.positions.clone(),
            truth
                .triangles
                .iter()
                .copied()
                .filter(|t| t.iter().all(|&v| truth.positions[v as usize][0] <= 0.5))
                .collect(),
        );
        let d = measure(&half, &truth);
        assert!(d.accuracy.max < 1e-12);
        // Over x in (0.5, 1) the distance is x - 0.5: mean square 1/2 * (1/2)^3 / 3 / (1/2).
        assert!((d.completeness.rms - (1.0f64 / 24.0).sqrt()).abs() < 3e-3, "{:?}", d.completeness);
    }

    #[test]
    fn turning_a_surface_inside_out_changes_the_sign_only() {
        let truth = sphere(1.0, 24);
        let inside_out = TriMesh::new(
            truth.positions.clone(),
            truth.triangles.iter().map(|t| [t[0], t[2], t[1]]).collect(),
        );
        let d = measure(&inside_out, &truth);
        assert!(d.normal_orientation < -0.999 && d.normal_consistency > 0.999);
    }

    #[test]
    fn distances_scale_with_the_unit_and_do_not_depend_on_threads() {
        let truth = sphere(1.0, 16);
        let result = sphere(1.05, 12);
        let one = measure(&result, &truth);
        let far = |p: Vec3| p * 1000.0 + Vec3([1e6, 0.0, 0.0]);
        let thousand = measure(&moved(&result, far), &moved(&truth, far));
        assert!((thousand.accuracy.rms / one.accuracy.rms / 1000.0 - 1.0).abs() < 1e-6);
        assert!((thousand.chamfer / one.chamfer / 1e6 - 1.0).abs() < 1e-6);
        assert!((thousand.f_score - one.f_score).abs() < 1e-3);
        let single = Run { threads: 1, ..Run::default() }
            .execute(|ctx| surface(&result, &truth, &DistanceOptions::default(), ctx))
            .unwrap();
        assert_eq!(single, one);
    }

    #[test]
    fn points_are_measured_as_they_are_and_bad_ones_are_counted() {
        let truth = sheet(1.0, 4);
        let cloud = PointCloud::from_positions(vec![
            [0.5, 0.5, 0.1],
            [0.2, 0.9, -0.1],
            [1.3, 0.5, 0.4],
            [f64::NAN, 0.0, 0.0],
        ]);
        let d =
            Run::default().execute(|ctx| points(&cloud, &truth, &DistanceOptions::default(), ctx)).unwrap();
        assert_eq!(d.not_finite, 1);
        assert!((d.accuracy.max - 0.5).abs() < 1e-12 && (d.accuracy.median - 0.1).abs() < 1e-12);
        assert!((d.accuracy.rms - ((0.01 + 0.01 + 0.25f64) / 3.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn meshes_without_surface_are_errors() {
        let truth = sheet(1.0, 2);
        for bad in [
            TriMesh::default(),
            TriMesh::new(vec![[0.0; 3]], vec![[0, 0, 0]]),
            TriMesh::new(vec![[f64::NAN; 3]], vec![[0, 0, 0]]),
            TriMesh::new(vec![[0.0; 3]], vec![[0, 0, 7]]),
        ] {
            for (a, b) in [(&bad, &truth), (&truth, &bad)] {
                let r = Run::default().execute(|ctx| surface(a, b, &DistanceOptions::default(), ctx));
                assert!(
                    matches!(
                        r,
                        Err(Error::EmptyInput { .. }
                            | Error::Degenerate { .. }
                            | Error::IndexOutOfRange { .. })
                    ),
                    "{r:?}"
                );
            }
        }
    }
}
