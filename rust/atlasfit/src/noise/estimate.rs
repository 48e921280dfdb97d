//! What a scan says about itself: point spacing, noise.
//!
//! In: normalised points and their search tree. Out: spacing per point and in the median, the standard
//! deviation of the noise along the surface normal. No truth, no normals needed.

use super::constants::NOISE;
use crate::error::Result;
use crate::numeric::dense::{Principal, cholesky, cholesky_solve, principal};
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use rayon::prelude::*;

/// Ratio of residual to noise on a plane at a given flatness: the principal direction with least variance
/// turns away from the normal as the neighbourhood becomes a blob (fitted to simulated planes; 1 below a
/// flatness of 0.3).
fn flatness_bias(flatness: f64) -> f64 {
    1.0 - 1.9 * (flatness - 0.3).max(0.0).powi(2)
}

/// What local quadrics say of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalNoise {
    /// Standard deviation along the normal.
    pub sigma: f64,
    /// Whether neighbourhoods of some size show a surface. Where none does, the points fill a volume as far
    /// as those reach: they have no surface, or noise that hides it.
    pub shows_surface: bool,
    /// Points of the largest neighbourhoods.
    pub looked_at: usize,
}

/// What the neighbourhoods of one size say in the median.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    flatness: f64,
    residual: f64,
}

impl Reading {
    fn shows_surface(&self) -> bool {
        self.flatness < NOISE.flat
    }
}

/// The least of the readings that show a surface. Too small a neighbourhood is a blob, too large a one bends
/// or holds two sheets: both read too high once the blob's bias is taken out, so the least reading is the
/// best.
pub(super) fn least(readings: &[Reading]) -> Option<f64> {
    let shown = readings.iter().filter(|r| r.shows_surface());
    shown.map(|r| r.residual / flatness_bias(r.flatness)).reduce(f64::min)
}

/// The power of the number of points with which the least reading grows to the next size: none where it is
/// noise, half where a crease bends the surface, three halves where a quadric cannot follow it.
pub(super) fn growth(readings: &[Reading], sizes: &[(usize, f64)]) -> f64 {
    let shown = readings.iter().zip(sizes).filter(|(r, _)| r.shows_surface());
    let shown: Vec<[f64; 2]> =
        shown.map(|(r, s)| [(s.0 as f64).ln(), (r.residual / flatness_bias(r.flatness)).ln()]).collect();
    let least = (0..shown.len()).min_by(|&a, &b| shown[a][1].total_cmp(&shown[b][1]));
    let next = least.and_then(|k| Some([shown[k], *shown.get(k + 1)?]));
    next.map_or(0.0, |[here, next]| (next[1] - here[1]) / (next[0] - here[0]))
}

/// Noise along the normal: residual of local quadrics, at the smallest neighbourhood that shows a surface.
/// `looked` are the neighbourhoods of the usual sizes.
///
/// # Errors
/// Cancelled or out of time.
pub fn noise(
    points: &[Vec3],
    tree: &Neighbours,
    looked: &Looked<'_>,
    ctx: &Context<'_>,
) -> Result<LocalNoise> {
    let mut readings = looked.readings(0..looked.at.len());
    let mut looked_at = NOISE.scales[readings.len().max(1) - 1].0;
    // Where noise is many times the spacing, small neighbourhoods are all noise. The first size that shows a
    // surface may see it askew: the next one is looked at too.
    let shown = |r: &[Reading]| r.iter().rev().skip(1).any(Reading::shows_surface);
    let largest = NOISE.largest.min((points.len() as f64 * NOISE.widest) as usize);
    while readings.len() >= NOISE.scales.len() && !shown(&readings) {
        let size = (looked_at as f64 * NOISE.wider) as usize;
        if size > largest {
            break;
        }
        let sizes = [(size, 1.0)];
        let wider = look_at(points, tree, &sizes, NOISE.samples_wider, ctx)?;
        readings.extend(wider.readings(0..wider.at.len()));
        looked_at = size;
    }
    // Where no size shows a surface, the flattest is taken.
    let least = least(&readings);
    let flattest = readings.iter().min_by(|a, b| a.flatness.total_cmp(&b.flatness));
    let sigma = least.or(flattest.map(|r| r.residual)).unwrap_or(0.0);
    Ok(LocalNoise { sigma, shows_surface: least.is_some(), looked_at })
}

/// Neighbourhoods of some sizes about a sample of the points.
#[derive(Debug)]
pub struct Looked<'a> {
    /// The sample.
    pub(super) at: Vec<usize>,
    /// Sizes, each with the ratio of the median residual to the true noise.
    pub(super) sizes: &'a [(usize, f64)],
    /// Flatness and residual of each size about each of the sample.
    about: Vec<Vec<(f64, f64)>>,
}

impl Looked<'_> {
    /// What the neighbourhoods about some of the sample say, as far as most of these have them.
    pub(super) fn readings(&self, of: impl Iterator<Item = usize> + Clone) -> Vec<Reading> {
        let median_of = |(scale, &(_, chi)): (usize, &(usize, f64))| {
            let about = of.clone().map(|k| &self.about[k]);
            let at: Vec<(f64, f64)> = about.filter_map(|a| a.get(scale).copied()).collect();
            let flatness = median(&mut at.iter().map(|a| a.0).collect::<Vec<_>>());
            let residual = median(&mut at.iter().map(|a| a.1).collect::<Vec<_>>()) / chi;
            (!at.is_empty() && at.len() * 2 >= of.clone().count()).then_some(Reading { flatness, residual })
        };
        self.sizes.iter().enumerate().map_while(median_of).collect()
    }
}

/// Looks at the neighbourhoods of the usual sizes.
///
/// # Errors
/// Cancelled or out of time.
pub fn look(points: &[Vec3], tree: &Neighbours, ctx: &Context<'_>) -> Result<Looked<'static>> {
    look_at(points, tree, &NOISE.scales, NOISE.samples, ctx)
}

/// Looks at the neighbourhoods of these sizes about so many of the points.
fn look_at<'a>(
    points: &[Vec3],
    tree: &Neighbours,
    sizes: &'a [(usize, f64)],
    samples: usize,
    ctx: &Context<'_>,
) -> Result<Looked<'a>> {
    let step = points.len().div_ceil(samples).max(1);
    let at: Vec<usize> = (0..points.len()).step_by(step).collect();
    let largest = sizes.iter().map(|s| s.0).max().unwrap_or(0);
    let about: Vec<Vec<(f64, f64)>> = at
        .par_iter()
        .map(|&i| {
            ctx.check()?;
            let mut found = Vec::new();
            tree.nearest(points[i], largest, &mut found);
            let residual = |&(k, _): &(usize, f64)| {
                let of = |q: Quadric| (q.flatness, q.residual);
                found.get(..k).map(|near| quadric(points, near).map_or((0.0, 0.0), of))
            };
            Ok(sizes.iter().map_while(residual).collect())
        })
        .collect::<Result<_>>()?;
    Ok(Looked { at, sizes, about })
}

/// The quadric through a neighbourhood.
pub(super) struct Quadric {
    /// Ratio of the neighbourhood's thickness to its lesser width (square roots of principal variances).
    flatness: f64,
    /// Standard deviation of what it leaves.
    pub residual: f64,
    /// The mean of the points.
    pub mean: Vec3,
    /// The normal of the plane that it is over.
    pub normal: Vec3,
}

/// The quadric through a neighbourhood; none where the points are on a line or in one place.
pub(super) fn quadric(points: &[Vec3], found: &[Neighbour]) -> Option<Quadric> {
    let n = found.len() as f64;
    let near = found.iter().map(|f| (points[f.index as usize], 1.0));
    let Principal { mean, variances: values, axes: vectors } = principal(near)?;
    if values[1] <= 0.0 {
        return None;
    }
    let normal = vectors[0];
    let e1 = normal.tangents().0;
    let e2 = normal.cross(e1);
    let unit = values[2].sqrt();
    let (mut a, mut b, mut zz) = ([0.0; 36], [0.0; 6], 0.0);
    for f in found {
        let d = points[f.index as usize] - mean;
        let (u, v, z) = (d.dot(e1) / unit, d.dot(e2) / unit, d.dot(normal));
        let row = [1.0, u, v, u * u, u * v, v * v];
        for i in 0..6 {
            for j in i..6 {
                a[i * 6 + j] += row[i] * row[j];
            }
            b[i] += row[i] * z;
        }
        zz += z * z;
    }
    for i in 0..6 {
        a[i * 7] += 1e-9 * n;
    }
    let flatness = (values[0].max(0.0) / values[1]).sqrt();
    if n <= 6.0 || !cholesky(&mut a, 6) {
        return Some(Quadric { flatness, residual: values[0].max(0.0).sqrt(), mean, normal });
    }
    let rhs = b;
    cholesky_solve(&a, 6, &mut b);
    let explained: f64 = rhs.iter().zip(b).map(|(x, y)| x * y).sum();
    Some(Quadric { flatness, residual: ((zz - explained).max(0.0) / (n - 6.0)).sqrt(), mean, normal })
}
