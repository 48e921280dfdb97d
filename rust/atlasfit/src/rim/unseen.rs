//! Holes that nobody looked into: the points about them thin out, as they do where a surface turns away from
//! every scanner, and the surface goes on without them.
//!
//! In: a surface whose boundary lies where the data end, the scan's points where the charts put them. Out:
//! the same surface with such holes filled. Where a surface ends, its points are as dense at the boundary as
//! farther in; two densities of a Poisson process are compared by their evidence.

use super::constants::RIM;
use crate::atlas::ProjectedPoint;
use crate::contour::surface::{Surface, corners};
use crate::contour::{holes, loops};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbours;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// What lies about a ring: points and area of the surface in the strip along it, and in the one farther in.
#[derive(Clone, Copy, Default)]
struct About {
    points: [f64; 2],
    area: [f64; 2],
}

/// Fills holes about which the points thin out. Returns how many it fills.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn fill(
    s: &mut Surface,
    projected: &[ProjectedPoint],
    scale: Scale,
    ctx: &Context<'_>,
) -> Result<usize> {
    let rings = loops::of(s, ctx)?;
    if rings.is_empty() {
        return Ok(0);
    }
    let about = about(s, &rings, projected, scale.unit, ctx)?;
    let wanted = rings.into_iter().zip(&about).filter_map(|(ring, about)| {
        let spacing = (about.area[0] / about.points[0]).sqrt();
        let short = holes::length(&s.positions, &ring) <= RIM.unseen * scale.gap * spacing;
        let seen_beside = about.points[0] > 0.0;
        (seen_beside && short && thins_out(about) && flatness(s, &ring) >= RIM.least_flatness).then_some(ring)
    });
    let wanted: Vec<Vec<u32>> = wanted.collect();
    holes::close(s, &wanted, ctx)
}

/// Lengths that rule which holes are filled.
#[derive(Clone, Copy)]
pub(crate) struct Scale {
    /// The longest boundary that chance leaves open, in spacings of the points about it.
    pub(crate) gap: f64,
    /// What the width of strips is measured in: the spacing of the points, or the side of a voxel.
    pub(crate) unit: f64,
}

/// Points and areas about each ring. Each point and each triangle counts for the ring that it is nearest to.
fn about(
    s: &Surface,
    rings: &[Vec<u32>],
    projected: &[ProjectedPoint],
    unit: f64,
    ctx: &Context<'_>,
) -> Result<Vec<About>> {
    let at: Vec<Vec3> = rings.iter().flatten().map(|&v| s.positions[v as usize]).collect();
    let ring_of: Vec<u32> = (rings.iter().zip(0u32..)).flat_map(|(r, i)| r.iter().map(move |_| i)).collect();
    let tree = Neighbours::build(&at, ctx)?;
    // The ring, and which strip, if any.
    let place = |p: Vec3| {
        let found = tree.nearest_one(p);
        let d = found.dist2.sqrt() / unit;
        let strip = RIM.strips.iter().position(|&[from, to]| (from..to).contains(&d));
        strip.map(|strip| (ring_of[found.index as usize] as usize, strip))
    };
    let points: Vec<Option<(usize, usize)>> = projected
        .par_iter()
        .enumerate()
        .map(|(i, p)| {
            ctx.check_at(i)?;
            Ok(if p.chart == u32::MAX { None } else { place(p.position) })
        })
        .collect::<Result<_>>()?;
    let areas: Vec<Option<(usize, usize, f64)>> = (s.triangles.par_iter())
        .enumerate()
        .map(|(i, t)| {
            ctx.check_at(i)?;
            let c = corners(&s.positions, t);
            let found = place((c[0] + c[1] + c[2]) * (1.0 / 3.0));
            Ok(found.map(|(ring, strip)| (ring, strip, 0.5 * area_vector(c).norm())))
        })
        .collect::<Result<_>>()?;
    let mut about = vec![About::default(); rings.len()];
    for (ring, strip) in points.into_iter().flatten() {
        about[ring].points[strip] += 1.0;
    }
    for (ring, strip, area) in areas.into_iter().flatten() {
        about[ring].area[strip] += area;
    }
    Ok(about)
}

/// Mean cosine of the surface's normals along a ring with that of the plane across it: 1 for a hole in a
/// plane, 0 for the end of a tube, -1 for the outline of a plate.
fn flatness(s: &Surface, ring: &[u32]) -> f64 {
    let at = |i: usize| s.positions[ring[i % ring.len()] as usize];
    let (mut area, mut normals) = (Vec3::ZERO, Vec3::ZERO);
    for (i, &v) in ring.iter().enumerate() {
        area += (at(i) - at(0)).cross(at(i + 1) - at(0));
        normals += s.normals[v as usize] * (at(i + 1) - at(i)).norm();
    }
    area.normalized().dot(normals) / holes::length(&s.positions, ring)
}

/// Whether points that get fewer towards the boundary explain the counts better than a surface that ends.
/// Given both counts together, the share of the nearer strip is binomial. A density falls to any share of
/// that farther in where points thin out, and stays the same but for `RIM.uneven` where a surface ends.
fn thins_out(about: &About) -> bool {
    let ([near, far], [a, b]) = (about.points, about.area);
    if near + far == 0.0 || a <= 0.0 || b <= 0.0 {
        return false;
    }
    let log_likelihood = |ratio: f64| {
        let share = ratio * a / (ratio * a + b);
        near * share.ln() + far * (1.0 - share).ln()
    };
    let steps = RIM.ratios;
    // Ratios from 0 to 2, at the middles of equal steps.
    let ratios = (0..2 * steps).map(|i| (f64::from(i) + 0.5) / f64::from(steps));
    let terms: Vec<(f64, f64)> = ratios.map(|r| (r, log_likelihood(r))).collect();
    let top = terms.iter().map(|t| t.1).fold(f64::NEG_INFINITY, f64::max);
    let ends = |r: f64| (-0.5 * (r.ln() / RIM.uneven).powi(2)).exp() / r;
    let whole: f64 = terms.iter().map(|t| ends(t.0)).sum();
    let end: f64 = terms.iter().map(|t| ends(t.0) / whole * (t.1 - top).exp()).sum();
    let on: f64 = terms[..steps as usize].iter().map(|t| (t.1 - top).exp() / f64::from(steps)).sum();
    on > end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_thin_out_where_they_are_fewer_at_the_boundary_than_chance_and_uneven_scans_allow() {
        let about = |near, far| About { points: [near, far], area: [100.0, 200.0] };
        for (near, far, thins) in [
            (100.0, 200.0, false),
            (90.0, 200.0, false),
            (50.0, 200.0, true),
            (3.0, 8.0, false),
            (0.0, 20.0, true),
        ] {
            assert_eq!(thins_out(&about(near, far)), thins, "{near} and {far}");
        }
        assert!(!thins_out(&About::default()));
    }
}
