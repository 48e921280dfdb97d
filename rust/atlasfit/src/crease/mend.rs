//! Places beside creases where the mesh is folded: thorns, and handles too small for the points to ask for.
//!
//! In: a surface that is cut along its creases, the creases. Out: places on them about which the mesh is to
//! be made anew, each as a corner of two sides.

use super::chains::Creases;
use super::constants::CREASE;
use super::corner::Corner;
use super::pull::pull;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// The places, no two nearer than the spacing of the points.
pub(super) fn places(s: &Surface, creases: &Creases, ctx: &Context<'_>) -> Result<Vec<Corner>> {
    let folded = s
        .triangles
        .par_chunks(CREASE.check)
        .map(|chunk| {
            ctx.check()?;
            Ok(chunk.iter().filter_map(|t| folded(s, creases, t)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    let mut places: Vec<Corner> = Vec::new();
    for (i, place) in folded.into_iter().flatten().enumerate() {
        ctx.check_at(i)?;
        if places.iter().all(|p| p.at.dist2(place.at) > place.unit * place.unit) {
            places.push(place);
        }
    }
    Ok(places)
}

/// The place on a crease next to a triangle that faces away from the side that it lies on.
fn folded(s: &Surface, creases: &Creases, t: &[u32; 3]) -> Option<Corner> {
    let corners = t.map(|v| s.positions[v as usize]);
    let normals: Vec3 = t.iter().map(|&v| s.normals[v as usize]).sum();
    let middle = corners.into_iter().sum::<Vec3>() * (1.0 / 3.0);
    let crease = pull(creases, middle, normals.normalized(), None).filter(|c| c.weight > 0.5)?;
    let facing = area_vector(corners).normalized();
    let [low, high] = crease.sides;
    let sides = if crease.across < 0.0 { [low, high] } else { [high, low] };
    if facing == Vec3::ZERO || sides.iter().any(|side| side.dot(facing) > CREASE.folded) {
        return None;
    }
    // A ridge falls below the plane of its other side.
    let ridge = sides[1].dot(crease.to - crease.on_line) < 0.0;
    Some(Corner::edge(crease.on_line, sides, ridge, crease.unit))
}
