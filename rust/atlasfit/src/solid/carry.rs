//! From the contour to a surface with normals and charts.
//!
//! In: the solid's vertices and triangles. Out: a surface without the hollows that no data bound; normals and
//! charts come from the surface where a vertex lies on it, and from its own triangles where it was invented.

use super::contour::Contour;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::faces::Faces;
use crate::spatial::sets::Sets;
use crate::spatial::triangle::{area_vector, weights};

/// The contour as a surface, and which of its vertices were invented.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn carry(
    contour: &Contour,
    faces: &Faces<'_>,
    from: &Surface,
    ctx: &Context<'_>,
) -> Result<(Surface, Vec<bool>)> {
    let hollow = hollows(contour, ctx)?;
    let mut number = vec![u32::MAX; contour.vertices.len()];
    let (mut surface, mut extrapolated) = (Surface::default(), Vec::new());
    for (i, vertex) in contour.vertices.iter().enumerate() {
        ctx.check_at(i)?;
        if hollow[i] {
            continue;
        }
        number[i] = surface.positions.len() as u32;
        surface.positions.push(vertex.position);
        extrapolated.push(vertex.on.is_none());
        let (mut normal, mut chart) = (Vec3::ZERO, u32::MAX);
        if let Some(t) = vertex.on {
            let corners = faces.triangles[t as usize];
            let shares = weights(vertex.position, &faces.corners[t as usize]);
            let nearest = (1..3).fold(0, |best, k| if shares[k] > shares[best] { k } else { best });
            chart = from.chart[corners[nearest] as usize];
            normal = corners.iter().zip(shares).map(|(&v, w)| from.normals[v as usize] * w).sum();
        }
        surface.normals.push(normal.normalized());
        surface.chart.push(chart);
    }
    let kept = contour.triangles.iter().filter(|t| !hollow[t[0] as usize]);
    surface.triangles = kept.map(|t| t.map(|v| number[v as usize])).collect();
    turn_normals(&mut surface, ctx)?;
    Ok((surface, extrapolated))
}

/// Gives invented vertices the normals of their triangles, and turns the others to their triangles' side.
fn turn_normals(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let mut sums = vec![Vec3::ZERO; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let normal = area_vector(t.map(|v| s.positions[v as usize]));
        t.iter().for_each(|&v| sums[v as usize] += normal);
    }
    for (n, sum) in s.normals.iter_mut().zip(sums) {
        *n = match n.dot(sum) {
            d if d > 0.0 => *n,
            d if d < 0.0 => -*n,
            _ => sum.normalized(),
        };
    }
    ctx.check()
}

/// For each vertex, whether its part of the contour bounds a hollow and was invented altogether.
fn hollows(contour: &Contour, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let n = contour.vertices.len();
    let mut sets = Sets::of_triangles(n, &contour.triangles, ctx)?;
    let mut volume = vec![0.0; n];
    for (i, t) in contour.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b, c] = t.map(|v| contour.vertices[v as usize].position);
        volume[sets.find(t[0]) as usize] += a.dot(b.cross(c));
    }
    let mut seen = vec![false; n];
    for (i, v) in contour.vertices.iter().enumerate() {
        ctx.check_at(i)?;
        seen[sets.find(i as u32) as usize] |= v.on.is_some();
    }
    let mut hollow = vec![false; n];
    for (i, h) in hollow.iter_mut().enumerate() {
        ctx.check_at(i)?;
        let part = sets.find(i as u32) as usize;
        *h = volume[part] < 0.0 && !seen[part];
    }
    Ok(hollow)
}
