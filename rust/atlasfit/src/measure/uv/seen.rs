//! How much of the seams can be seen from outside.
//!
//! In: a mesh with texture coordinates per corner. Out: the share of the seams' length that is seen, by
//! places evenly spaced along the seams.

use super::charts::charts;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::measure::memory;
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use crate::spatial::outside::Outside;
use rayon::prelude::*;

/// Places along the seams. The share has a standard deviation of at most 0.5 / sqrt(2048) = 1.1 %.
const PLACES: usize = 2048;

/// The share of the seams' length that is seen from outside, in `[0, 1]`; 1 where there are no seams. A place
/// from which half of all directions, or more, lead outside is seen in full, as on a convex body. With `up`,
/// of any length but 0, nobody looks from below.
///
/// # Errors
/// As [`uv`](super::uv).
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure::uv::seams_seen};
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// let mut square = TriMesh::new(corners.map(|[x, y]| [x, y, 0.0]).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
/// let uv = |v: u32| corners[v as usize].map(|x| x as f32);
/// let cut = square.triangles.iter().enumerate().map(|(f, t)| t.map(uv).map(|[x, y]| [x, y + f as f32]));
/// square.corner_uv = Some(cut.collect());
/// assert_eq!(Run::default().execute(|ctx| seams_seen(&square, None, ctx))?, 1.0);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn seams_seen(mesh: &TriMesh, up: Option<[f64; 3]>, ctx: &Context<'_>) -> Result<f64> {
    let cuts = charts(mesh, ctx)?.cuts;
    memory::reserve(mesh, ctx)?;
    let positions = vec3::of(&mesh.positions);
    let places = places(&cuts, mesh, positions);
    if places.is_empty() {
        return Ok(1.0);
    }
    let faces = mesh.triangles.iter().map(|t| t.map(|v| positions[v as usize]));
    let faces: Vec<[Vec3; 3]> = faces.filter(|f| are_finite(f)).collect();
    let outside = Outside::new(faces, up.map(Vec3), ctx)?;
    let seen = places.par_iter().map(|place| {
        ctx.check()?;
        Ok(outside.sees(place.edge, place.along, 0, 1))
    });
    Ok(seen.collect::<Result<Vec<f64>>>()?.iter().sum::<f64>() / places.len() as f64)
}

/// A place on a seam.
struct Place {
    /// The ends of its edge.
    edge: [Vec3; 2],
    /// Where on it, in [0, 1].
    along: f64,
}

/// Places along the seams, as far apart from each other as their whole length allows.
fn places(cuts: &[u32], mesh: &TriMesh, positions: &[Vec3]) -> Vec<Place> {
    let ends = |&h: &u32| {
        let (t, k) = (mesh.triangles[h as usize / 3], h as usize % 3);
        [t[k], t[(k + 1) % 3]].map(|v| positions[v as usize])
    };
    let cuts: Vec<[Vec3; 2]> = cuts.iter().map(ends).filter(|ends| are_finite(ends)).collect();
    let step = cuts.iter().map(|[a, b]| a.dist2(*b).sqrt()).sum::<f64>() / PLACES as f64;
    let (mut places, mut before) = (Vec::with_capacity(PLACES), 0.0);
    for [a, b] in cuts {
        let length = a.dist2(b).sqrt();
        while (places.len() as f64 + 0.5) * step < before + length {
            let along = ((places.len() as f64 + 0.5) * step - before) / length;
            places.push(Place { edge: [a, b], along });
        }
        before += length;
    }
    places
}

fn are_finite(points: &[Vec3]) -> bool {
    points.iter().flat_map(|p| p.0).all(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use std::f64::consts::PI;

    /// A tube along z from `r` out to `r + 1`, closed, in four charts: inside, outside, and two ends. Its
    /// seams are the four circles.
    fn tube(r: f64, height: f64) -> TriMesh {
        const AROUND: u32 = 48;
        let profile = [[r, 0.0], [r + 1.0, 0.0], [r + 1.0, height], [r, height]];
        let mut mesh = TriMesh::default();
        for i in 0..AROUND {
            let a = 2.0 * PI * f64::from(i) / f64::from(AROUND);
            mesh.positions.extend(profile.map(|[x, z]| [x * a.cos(), x * a.sin(), z]));
        }
        let mut uv = Vec::new();
        for i in 0..AROUND {
            for side in 0..4 {
                let at =
                    |i: u32, k: u32| (4 * (i % AROUND) + k % 4, [i as f32, (2 * side + k - side) as f32]);
                let [a, b, c, d] = [at(i, side), at(i, side + 1), at(i + 1, side + 1), at(i + 1, side)];
                for t in [[a, b, c], [a, c, d]] {
                    mesh.triangles.push(t.map(|v| v.0));
                    uv.push(t.map(|v| v.1));
                }
            }
        }
        mesh.corner_uv = Some(uv);
        mesh
    }

    fn of(mesh: &TriMesh) -> f64 {
        Run::default().execute(|ctx| seams_seen(mesh, None, ctx)).unwrap()
    }

    #[test]
    fn seams_of_a_convex_body_are_seen_and_those_in_a_box_around_them_are_not() {
        let ring = tube(1.0, 0.5);
        assert!(of(&ring) > 0.9, "{}", of(&ring));
        // A closed box around it, without seams of its own.
        let mut hidden = ring;
        let n = hidden.positions.len() as u32;
        let corner = |i: u32| [i & 1, (i >> 1) & 1, i >> 2].map(|bit| 10.0 * f64::from(bit) - 5.0);
        hidden.positions.extend((0..8).map(corner));
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let uv = hidden.corner_uv.as_mut().unwrap();
        for [a, b, c, d] in quads {
            for t in [[a, b, c], [a, c, d]] {
                hidden.triangles.push(t.map(|v| n + v));
                uv.push(t.map(|v| [v as f32, 100.0]));
            }
        }
        assert_eq!(of(&hidden), 0.0);
    }

    #[test]
    fn where_it_lies_and_how_large_it_is_make_no_difference() {
        let tube = tube(0.3, 3.0);
        let seen = of(&tube);
        assert!((0.5..0.999).contains(&seen), "the inner circles are seen through the ends: {seen}");
        for (scale, shift) in [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e6)] {
            let mut moved = tube.clone();
            moved.positions.iter_mut().for_each(|p| *p = p.map(|x| scale * x + shift));
            assert!((of(&moved) - seen).abs() < 1e-3, "{scale} {shift}");
        }
    }
}
