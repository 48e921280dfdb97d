//! What can be asked of the main job, and the checks of what it is given.

use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::setters::setters;
use crate::unwrap::PAGE_TEXELS;

/// What to do with points that no chart claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Outliers {
    /// They stay where they were among the denoised points.
    #[default]
    Keep,
    /// They are left out of the denoised points, and so are the points on parts of the surface that were
    /// left out.
    Drop,
}

/// How to denoise. The defaults suit an ordinary scan.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DenoiseOptions {
    /// Standard deviation of the noise in the scan's unit; `None` estimates it, for each chart anew. Given,
    /// it decides how closely charts follow the points; patches are cut with a twentieth of the point
    /// spacing at least.
    pub noise: Option<f64>,
    /// How strongly to denoise, 0 or more: 1 = as much as the scan asks for. The charts, and the surface with
    /// them, smooth away detail below so many times the usual length; less than a quarter and more than 4
    /// times change them no further. Below 1 the points besides go only this share of the way to the surface:
    /// 0 leaves them where they are. Which points are outliers, and which lie on which sheet, stays the same.
    pub strength: f64,
    /// Fineness of the surface: 1 = what the data supports, 0.5 = voxels twice as large. 0.1 to 10.
    pub detail: f64,
    /// Number of charts to aim for; `None` = as many as the shape needs.
    pub charts: Option<usize>,
    /// Holes with a boundary shorter than this are filled, in the scan's unit; 0 fills only gaps of the
    /// sampling and, but not in tiles, places about which the points thin out, as they do where a surface
    /// turns away from every scanner.
    pub fill_holes: f64,
    /// Connected parts of the surface that have less than this share of its area, 0 to 1, are left out; 0
    /// keeps all. What is left must be one part at least: else that is an error. Their points stay among
    /// the denoised points, and their charts in the atlas, unless outliers are dropped.
    pub min_part: f64,
    /// Whether only the largest part of the surface by area is kept; the others are left out as those below
    /// [`min_part`](Self::min_part).
    pub largest: bool,
    /// Triangles that the surface should have at the most; `None` = about as many as there are points,
    /// fewer where it is flat, more where it is not; times the square of [`detail`](Self::detail). Where they
    /// cannot be had within [`max_error`](Self::max_error), the report says so.
    pub faces: Option<usize>,
    /// How far the surface may be from the vertices and the middles of the edges of the contoured one to have
    /// fewer triangles, in the scan's unit; 0 = as many triangles as it is contoured with, four to ten a
    /// point. `None` = as far as [`faces`](Self::faces) asks for; without that a quarter of the noise or a
    /// twentieth of the spacing, the larger of the two, by `detail`. A surface that is
    /// [`watertight`](Self::watertight) keeps all triangles.
    pub max_error: Option<f64>,
    /// Whether the surface is to be that of a solid, for printing: closed, two-manifold, without
    /// self-intersections. What is invented where there are no data is marked by the attribute
    /// [`EXTRAPOLATED`](super::EXTRAPOLATED) of the surface's vertices.
    pub watertight: bool,
    /// Side of the texture page in texels, for the padding between UV charts.
    pub texture_size: u32,
    /// What to do with outliers.
    pub outliers: Outliers,
    /// Where the scanner stood, in the scan's unit and frame: the surface faces it. Where more than a quarter
    /// of the points is hidden from there (one place of a moving scanner, say), connected parts face it as
    /// wholes. `None` takes what the cloud says (its normals, its scanners), and where it says nothing, looks
    /// for one.
    pub viewpoint: Option<[f64; 3]>,
    /// Whether to lay out UVs; without a surface there are none.
    pub uv: bool,
    /// Whether to build the surface. Without it denoising takes about half the time, and gives the points and
    /// charts only: the surface is empty, points beside an edge of the part stay on its rounded charts, and
    /// what is asked of the surface (`watertight`, `faces`, `max_error`, `min_part`, `largest`, `fill_holes`)
    /// is refused.
    pub surface: bool,
    /// Whether to say how sure the result is: the points get the attributes
    /// [`UNCERTAINTY`](super::UNCERTAINTY), [`NOISE`](super::NOISE) and
    /// [`OUTLIER_PROBABILITY`](super::OUTLIER_PROBABILITY), the surface's vertices
    /// [`UNCERTAINTY`](super::UNCERTAINTY) and [`EXTRAPOLATED`](super::EXTRAPOLATED). Changes nothing else.
    pub uncertainty: bool,
    /// The attribute of the cloud that tells the sweeps apart of which it was merged: whole numbers, 0 or
    /// more. The sweeps are moved together first, each by a small rigid motion
    /// ([`register`](crate::register::register)); the denoised points and the surface are where the moved
    /// ones say. `None` moves none.
    pub sweeps: Option<String>,
}

setters! {
    DenoiseOptions {
        with_noise: noise: Option<f64>,
        with_strength: strength: f64,
        with_detail: detail: f64,
        with_charts: charts: Option<usize>,
        with_fill_holes: fill_holes: f64,
        with_min_part: min_part: f64,
        with_largest: largest: bool,
        with_faces: faces: Option<usize>,
        with_max_error: max_error: Option<f64>,
        with_watertight: watertight: bool,
        with_texture_size: texture_size: u32,
        with_outliers: outliers: Outliers,
        with_viewpoint: viewpoint: Option<[f64; 3]>,
        with_uv: uv: bool,
        with_surface: surface: bool,
        with_uncertainty: uncertainty: bool,
        with_sweeps: sweeps: Option<String>,
    }
}

impl Default for DenoiseOptions {
    fn default() -> Self {
        Self {
            noise: None,
            strength: 1.0,
            detail: 1.0,
            charts: None,
            fill_holes: 0.0,
            min_part: 0.0,
            largest: false,
            faces: None,
            max_error: None,
            watertight: false,
            texture_size: 1024,
            outliers: Outliers::Keep,
            viewpoint: None,
            uv: true,
            surface: true,
            uncertainty: false,
            sweeps: None,
        }
    }
}

impl DenoiseOptions {
    /// Whether UVs are laid out.
    pub(super) fn lays_out_uv(&self) -> bool {
        self.uv && self.surface
    }
}

/// Every column has an entry per point.
pub(super) fn check_columns(cloud: &PointCloud) -> Result<()> {
    let n = cloud.len();
    let normals = cloud.normals.iter().map(|c| ("normals".to_string(), c.len(), n));
    let colors = cloud.colors.iter().map(|c| ("colors".to_string(), c.len(), n));
    let scanners = cloud.scanners.iter().map(|s| ("scanners".to_string(), s.of_point.len(), n));
    let others =
        cloud.attributes.iter().map(|a| (format!("attribute \"{}\"", a.name), a.values.len(), n * a.width));
    match normals.chain(colors).chain(scanners).chain(others).find(|(_, have, want)| have != want) {
        Some((name, have, want)) => Err(Error::invalid(
            format!("{name}: {have} values for {n} points"),
            format!("Give {want} values, or leave the column out"),
        )),
        None => Ok(()),
    }
}

pub(super) fn validate(o: &DenoiseOptions) -> Result<()> {
    if let Some(noise) = o.noise
        && !(noise > 0.0 && noise.is_finite())
    {
        return Err(Error::invalid(
            format!("noise is {noise}"),
            "Give a positive length, or none to estimate it",
        ));
    }
    if !(o.strength >= 0.0 && o.strength.is_finite()) {
        return Err(Error::invalid(
            format!("strength is {}", o.strength),
            "Give a number, 0 or more; 1 is what the scan asks for, 0 leaves points where they are",
        ));
    }
    if !(0.1..=10.0).contains(&o.detail) {
        return Err(Error::invalid(
            format!("detail is {}", o.detail),
            "Give 0.1 to 10; 1 is what the data supports",
        ));
    }
    if o.charts == Some(0) {
        return Err(Error::invalid("charts is 0", "Give at least 1, or none to choose from the data"));
    }
    validate_surface(o)?;
    if let Some(v) = o.viewpoint
        && !v.iter().all(|x| x.is_finite())
    {
        return Err(Error::invalid(format!("viewpoint is {v:?}"), "Give three finite coordinates"));
    }
    if !PAGE_TEXELS.contains(&o.texture_size) {
        return Err(Error::invalid(format!("texture_size is {}", o.texture_size), "Give 16 to 65536 texels"));
    }
    Ok(())
}

/// The ranges of what is asked of the surface.
fn validate_surface(o: &DenoiseOptions) -> Result<()> {
    if !(o.fill_holes >= 0.0 && o.fill_holes.is_finite()) {
        return Err(Error::invalid(format!("fill_holes is {}", o.fill_holes), "Give a length, 0 or more"));
    }
    if !(0.0..=1.0).contains(&o.min_part) {
        return Err(Error::invalid(
            format!("min_part is {}", o.min_part),
            "Give a share of the surface's area, 0 to 1; 0 keeps all parts",
        ));
    }
    if o.faces == Some(0) {
        return Err(Error::invalid(
            "faces is 0",
            "Give at least 1, or none for about as many as points; max_error 0 keeps all",
        ));
    }
    if let Some(e) = o.max_error
        && !(e >= 0.0 && e.is_finite())
    {
        return Err(Error::invalid(format!("max_error is {e}"), "Give a length, 0 or more, or none"));
    }
    if o.watertight && (o.faces.is_some() || o.max_error.is_some_and(|e| e > 0.0)) {
        return Err(Error::invalid(
            "a watertight surface keeps its triangles: with fewer they could meet",
            "Leave out faces and max_error, or watertight",
        ));
    }
    let asks = [
        ("watertight", o.watertight),
        ("faces", o.faces.is_some()),
        ("max_error", o.max_error.is_some()),
        ("min_part", o.min_part > 0.0),
        ("largest", o.largest),
        ("fill_holes", o.fill_holes > 0.0),
    ];
    if let Some((name, _)) = asks.iter().find(|(_, asked)| *asked && !o.surface) {
        return Err(Error::invalid(
            format!("{name} is asked of a surface that is not wanted"),
            format!("Leave out {name}, or ask for the surface"),
        ));
    }
    Ok(())
}
