//! The surface with fewer triangles, where the user asks for it.
//!
//! In: the surface. Out: the same, simplified; each vertex with the normal and the chart of the one that it
//! came from.

use super::options::DenoiseOptions;
use super::warnings;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use crate::simplify::{Goal, simplify};

/// Simplifies the surface as the options say; returns what to tell the user. The unit of the normalised frame
/// is `scale` long.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn lighten(
    s: &mut Surface,
    options: &DenoiseOptions,
    scale: f64,
    ctx: &Context<'_>,
) -> Result<Option<String>> {
    if options.faces.is_none() && options.max_error.is_none() {
        return Ok(None);
    }
    // No surface is larger than the frame.
    let max_error = options.max_error.map_or(1.0, |e| e / scale);
    let goal = Goal { faces: options.faces.unwrap_or(0), max_error };
    let light = simplify(&s.positions, &s.triangles, &goal, ctx)?;
    s.normals = light.from.iter().map(|&v| s.normals[v as usize]).collect();
    s.chart = light.from.iter().map(|&v| s.chart[v as usize]).collect();
    s.positions = light.positions;
    s.triangles = light.triangles;
    Ok(warnings::faces_left(options.faces, s.triangles.len()))
}
