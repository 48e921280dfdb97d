//! What the user should hear: results that cannot be right, and why.
//!
//! In: what was found. Out: a text, or nothing where all is well.

use super::constants::PIPELINE;
use crate::contour::holes::Left;
use crate::error::Error;
use crate::noise::estimate::LocalNoise;
use crate::numeric::vec3::Vec3;
use crate::numeric::wording::counted;
use crate::register::Registration;
use crate::solid::Solid;
use crate::spatial::spacing::Sampling;
use crate::uncertainty::PointUncertainty;

/// Below this share of the spacing noise makes no difference.
const NOISE_MATTERS: f64 = 0.1;
/// Noise found below this share of the rounding of coordinates is none that a measured scan could have: where
/// only one coordinate in a hundred is rounded, a tenth of the deviation is left.
const BELOW_ROUNDING: f64 = 0.1;
/// More triangles for a point than this show the voxels, not the points: at the usual voxels they are 4 to 5.
const MANY_FACES: usize = 10;

/// What to tell where the scan's residuals do not bear out the uncertainty.
pub(super) fn not_calibrated(sure: Option<&PointUncertainty>) -> Option<String> {
    let sure = sure?;
    if sure.factor.is_none() {
        return Some(
            "the uncertainty could not be checked by the scan's own residuals: there are too few points, or \
             their noise is not independent (filtered depth, for one). It is what the charts say alone and \
             may be too small"
                .into(),
        );
    }
    sure.small.then(|| {
        "points beside each other err alike by less than their uncertainty says: it is too large where the \
         surface is very smooth, and too small where views do not fit each other. If the scan is of several \
         views, name them (sweeps), so that they are moved together"
            .into()
    })
}

/// What to tell of sweeps that lie on no other.
pub(super) fn not_registered(registration: Option<&Registration>) -> Option<String> {
    let alone: Vec<String> =
        registration?.sweeps.iter().filter(|s| s.pairs == 0).map(|s| s.sweep.to_string()).collect();
    (!alone.is_empty()).then(|| {
        format!("sweeps that lie on no other or have too few points were not moved: {}", alone.join(", "))
    })
}

/// What to tell of ground that seems to be seen from below.
pub(super) fn upside_down() -> String {
    "the scan looks like ground seen from below: it is taken to be upside down, with its third axis down. If \
     that axis is up (a street, a court, a pit), give a viewpoint above it, or normals"
        .into()
}

/// What to tell of points that show no surface.
pub(super) fn volume(local: &LocalNoise) -> Option<String> {
    (!local.shows_surface).then(|| {
        format!(
            "the points fill a volume: no neighbourhood, of up to {} points, is flat. They lie on no \
             surface, or the noise hides it. Expect a surface only if they were measured on one; give the \
             noise by hand",
            local.looked_at
        )
    })
}

/// An error that says what was `told` of the scan before: where points have no surface, that is the reason
/// and the advice.
pub(super) fn explained(error: Error, told: &[String]) -> Error {
    match error {
        Error::Degenerate { what, .. } if !told.is_empty() => {
            Error::degenerate(what, capitalised(&told.join(". ")))
        }
        other => other,
    }
}

/// A text that begins a sentence.
fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// What to tell a user whose `given` noise is far below what the scan shows. In the normalised frame, whose
/// unit is `scale` long.
pub(super) fn too_little_noise(given: f64, local: f64, sampling: &Sampling, scale: f64) -> Option<String> {
    let matters = local > NOISE_MATTERS * sampling.median;
    (matters && given < PIPELINE.noise_told * local.min(sampling.median)).then(|| {
        format!(
            "the noise given is {:.3e}, but the scan shows about {:.3e}: the surface will follow the noise",
            given * scale,
            local * scale
        )
    })
}

/// Standard deviation of what rounding does to positions: to f32 where all are such numbers, else to f64.
/// Uniform over the last place of the largest coordinate.
pub(super) fn rounding(points: &[Vec3]) -> f64 {
    let largest = points.iter().flat_map(|p| p.0).fold(0.0f64, |m, x| m.max(x.abs()));
    let single = points.iter().flat_map(|p| p.0).all(|x| f64::from(x as f32) == x);
    largest * if single { f64::from(f32::EPSILON) } else { f64::EPSILON } / 12f64.sqrt()
}

/// What to tell where the noise `found` is less than the rounding of the coordinates, in the user's unit.
pub(super) fn no_noise(found: f64, rounding: f64) -> Option<String> {
    (found < BELOW_ROUNDING * rounding).then(|| {
        format!(
            "the noise found, {found:.1e}, is less than the rounding of the coordinates, {rounding:.1e}: the \
             points look computed or copied, not measured. Give the noise by hand if they are a scan"
        )
    })
}

/// What to tell of a surface much finer than its points.
pub(super) fn many_faces(faces: usize, points: usize) -> Option<String> {
    (faces > MANY_FACES * points).then(|| {
        format!(
            "the surface has {} for {}: most of it lies between points. Lower the detail, or give a \
             denser scan",
            counted(faces, "triangle"),
            counted(points, "point")
        )
    })
}

/// What to tell where more triangles are left than the user `asked` for.
pub(super) fn faces_left(asked: Option<usize>, left: usize) -> Option<String> {
    asked.filter(|&n| left > n).map(|n| {
        format!(
            "the surface has {}, not {n}: with fewer it would be farther from the points than is allowed, \
             fold, or lose its shape",
            counted(left, "triangle")
        )
    })
}

/// What to tell of a solid where the scan encloses nothing. The unit of the normalised frame is `scale` long.
pub(super) fn plates(solid: &Solid, one_sided: bool, scale: f64) -> Option<String> {
    let seam = if one_sided { ", with a bar where the one-sided surface turns over" } else { "" };
    solid.plates.then(|| {
        format!(
            "parts of the surface enclose nothing: behind them the solid is about {:.3e} thick{seam}",
            solid.thickness * scale
        )
    })
}

/// What to tell of the holes that are left, to a user who has asked to fill those with a boundary of up to
/// `asked`. Lengths in the user's unit; the `left` ones' in the normalised frame, whose unit is `scale` long.
pub(super) fn holes_left(asked: f64, left: &Left, scale: f64) -> Vec<String> {
    if asked <= 0.0 {
        return Vec::new();
    }
    let holes = |n: usize| format!("{} {}", counted(n, "hole"), if n == 1 { "is" } else { "are" });
    let long = (left.longer > 0).then(|| {
        format!(
            "{} left open: the boundary is longer than {asked}; the shortest is {:.3} long",
            holes(left.longer),
            left.shortest * scale
        )
    });
    let tangled = (left.tangled > 0).then(|| {
        format!(
            "{} left open: no filling fits that does not touch the surface elsewhere, or the boundary has \
             too many edges",
            holes(left.tangled)
        )
    });
    long.into_iter().chain(tangled).collect()
}
