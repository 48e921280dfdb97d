//! Arrays of what denoising made, copied as the caller has its own.

use crate::arrays::available;
use crate::buffer::{Column, atlasfit_buffer, copy_to};
use crate::handle;
use crate::result::{DenoiseResult, atlasfit_result};
use crate::status::{ATLASFIT_NOT_AVAILABLE, Failure, Outcome, atlasfit_status, guard};
use atlasfit::geometry::Attribute;
use atlasfit::pipeline::{EXTRAPOLATED, NOISE, OUTLIER_PROBABILITY, UNCERTAINTY};

/// atlasfit_result_copy(): x, y, z of each denoised point.
pub const ATLASFIT_POINT_POSITIONS: u32 = 0;
/// atlasfit_result_copy(): the normal of each denoised point.
pub const ATLASFIT_POINT_NORMALS: u32 = 1;
/// atlasfit_result_copy(): the given point that each denoised point came from.
pub const ATLASFIT_POINT_SOURCES: u32 = 2;
/// atlasfit_result_copy(): the chart of each denoised point.
pub const ATLASFIT_POINT_CHARTS: u32 = 3;
/// atlasfit_result_copy(): x, y, z of each vertex of the surface.
pub const ATLASFIT_SURFACE_POSITIONS: u32 = 4;
/// atlasfit_result_copy(): the normal of each vertex of the surface.
pub const ATLASFIT_SURFACE_NORMALS: u32 = 5;
/// atlasfit_result_copy(): the vertices of each triangle of the surface.
pub const ATLASFIT_SURFACE_TRIANGLES: u32 = 6;
/// atlasfit_result_copy(): u, v of each corner of each triangle of the surface.
pub const ATLASFIT_SURFACE_CORNER_UV: u32 = 7;
/// atlasfit_result_copy(): the UV chart of each triangle of the surface.
pub const ATLASFIT_SURFACE_FACE_CHARTS: u32 = 8;
/// atlasfit_result_copy(): red, green, blue, alpha of each vertex of the surface.
pub const ATLASFIT_SURFACE_COLORS: u32 = 9;
/// atlasfit_result_copy(), with uncertainty: the standard deviation of each denoised point's place along its
/// normal, in the points' unit. Of outliers their distance from the nearest point that is none; not a number
/// for points that are not finite.
pub const ATLASFIT_POINT_UNCERTAINTY: u32 = 10;
/// atlasfit_result_copy(), with uncertainty: the standard deviation of the noise that each denoised point
/// had, in the points' unit; 0 of outliers.
pub const ATLASFIT_POINT_NOISE: u32 = 11;
/// atlasfit_result_copy(), with uncertainty: the probability that each denoised point is on no surface, 0 to
/// 1; not a number for points that are not finite.
pub const ATLASFIT_POINT_OUTLIER_PROBABILITY: u32 = 12;
/// atlasfit_result_copy(), with uncertainty: the standard deviation of each vertex of the surface along its
/// normal, in the points' unit.
pub const ATLASFIT_SURFACE_UNCERTAINTY: u32 = 13;
/// atlasfit_result_copy(), with uncertainty or watertight: 1 for each vertex of the surface that was
/// invented, where a hole was filled or nothing was scanned near it, else 0.
pub const ATLASFIT_SURFACE_EXTRAPOLATED: u32 = 14;
/// atlasfit_result_copy(): the unit normal at each corner of each triangle of the surface, where the surface
/// has creases: there each side has its own. #ATLASFIT_NOT_AVAILABLE where those of the vertices hold.
pub const ATLASFIT_SURFACE_CORNER_NORMALS: u32 = 15;

/// An array that an option of denoising adds.
fn told(held: &DenoiseResult, array: u32) -> Outcome<(Column<'_>, usize, &'static str)> {
    let (points, surface) = (&held.denoised.points.attributes, &held.denoised.surface.attributes);
    let unsure = (held.unsure, "uncertainty");
    let ((asked, option), of, column, name) = match array {
        ATLASFIT_POINT_UNCERTAINTY => (unsure, points, UNCERTAINTY, "uncertainty of the points"),
        ATLASFIT_POINT_NOISE => (unsure, points, NOISE, "noise of the points"),
        ATLASFIT_POINT_OUTLIER_PROBABILITY => {
            (unsure, points, OUTLIER_PROBABILITY, "outlier probability of the points")
        }
        ATLASFIT_SURFACE_UNCERTAINTY => (unsure, surface, UNCERTAINTY, "uncertainty of the vertices"),
        _ => ((held.invented, "uncertainty or watertight"), surface, EXTRAPOLATED, "extrapolated vertices"),
    };
    // The points may have brought a column of that name themselves.
    if let Some(found) = Attribute::named(of, column).filter(|_| asked) {
        return Ok((Column::Doubles(&found.values), 1, name));
    }
    let why = match asked {
        true => "a shell has none. Denoise with another surface".to_owned(),
        false => format!("it was not asked for. Denoise with {option}"),
    };
    Err(Failure::new(ATLASFIT_NOT_AVAILABLE, format!("this result has no {name}: {why}")))
}

/// Copies an array of a result as the caller has its own: numbers of another type, at any stride. The arrays
/// are those of the functions above, those that uncertainty of the options adds (floats), and the normals of
/// corners.
///
/// @param array #ATLASFIT_POINT_POSITIONS to #ATLASFIT_SURFACE_CORNER_NORMALS.
/// @param to    Where and how.
/// @return #ATLASFIT_OK, #ATLASFIT_INVALID_ARGUMENT (no such array, a type that does not suit it),
///         #ATLASFIT_NOT_AVAILABLE (there is none, or it was not asked for), #ATLASFIT_BUFFER_TOO_SMALL,
///         #ATLASFIT_INDEX_OUT_OF_RANGE (an index that the type does not hold).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_result_copy(
    result: *const atlasfit_result,
    array: u32,
    to: *const atlasfit_buffer,
) -> atlasfit_status {
    guard("atlasfit_result_copy", || unsafe {
        let held = &*handle::get(result)?;
        let (points, surface) = (&held.denoised.points, &held.denoised.surface);
        let (column, width, name) = match array {
            ATLASFIT_POINT_POSITIONS => {
                (Column::Doubles(points.positions.as_flattened()), 3, "point positions")
            }
            ATLASFIT_POINT_NORMALS => {
                let all = available(&points.normals, "point normals")?;
                (Column::Floats(all.as_flattened()), 3, "point normals")
            }
            ATLASFIT_POINT_SOURCES => (Column::Indices(&held.denoised.point_source), 1, "point sources"),
            ATLASFIT_POINT_CHARTS => (Column::Indices(&held.denoised.point_chart), 1, "point charts"),
            ATLASFIT_SURFACE_POSITIONS => {
                (Column::Doubles(surface.positions.as_flattened()), 3, "surface positions")
            }
            ATLASFIT_SURFACE_NORMALS => {
                let all = available(&surface.normals, "surface normals")?;
                (Column::Floats(all.as_flattened()), 3, "surface normals")
            }
            ATLASFIT_SURFACE_TRIANGLES => (Column::Indices(surface.triangles.as_flattened()), 3, "triangles"),
            ATLASFIT_SURFACE_CORNER_UV => {
                let all = available(&surface.corner_uv, "UVs")?;
                (Column::Floats(all.as_flattened().as_flattened()), 2, "corner UVs")
            }
            ATLASFIT_SURFACE_FACE_CHARTS => {
                (Column::Indices(available(&surface.face_chart, "UV charts")?), 1, "face charts")
            }
            ATLASFIT_SURFACE_COLORS => {
                (Column::Colors(available(&surface.colors, "colours")?.as_flattened()), 4, "colours")
            }
            ATLASFIT_POINT_UNCERTAINTY..=ATLASFIT_SURFACE_EXTRAPOLATED => told(held, array)?,
            ATLASFIT_SURFACE_CORNER_NORMALS => {
                let all = available(&surface.corner_normals, "creases")?;
                (Column::Floats(all.as_flattened().as_flattened()), 3, "corner normals")
            }
            other => {
                return Err(Failure::invalid(format!(
                    "array is {other}. Give ATLASFIT_POINT_POSITIONS to ATLASFIT_SURFACE_CORNER_NORMALS"
                )));
            }
        };
        copy_to(&column, width, to, name)
    })
}
