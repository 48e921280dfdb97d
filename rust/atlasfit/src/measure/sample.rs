//! Uniform random samples of a surface.
//!
//! In: a mesh, a count, a seed. Out: points with the triangle that each lies on, the same for any thread
//! count.

use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::numeric::rng::Rng;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Samples that share one random stream. Another number gives other samples.
const BLOCK: usize = 4096;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Sample {
    /// Position, in the frame of the mesh.
    pub point: Vec3,
    /// Index of its triangle.
    pub triangle: u32,
}

/// `count` independent samples, uniform by area. Triangles whose area is not finite get none.
///
/// # Errors
/// [`Error::IndexOutOfRange`]; [`Error::Degenerate`] where the mesh has no area; cancel and limits.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure::sample::uniform};
/// let mesh = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// let samples = Run::default().execute(|ctx| uniform(&mesh, 100, ctx.seed, ctx))?;
/// assert!(samples.len() == 100 && samples.iter().all(|s| s.point[2] == 0.0 && s.triangle == 0));
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn uniform(mesh: &TriMesh, count: usize, seed: u64, ctx: &Context<'_>) -> Result<Vec<Sample>> {
    mesh.validate()?;
    let mut total = 0.0;
    let mut below: Vec<f64> = Vec::with_capacity(mesh.triangles.len());
    for i in 0..mesh.triangles.len() {
        ctx.check_at(i)?;
        let area = area(mesh, i);
        if area.is_finite() {
            total += area;
        }
        below.push(total);
    }
    if !(total > 0.0 && total.is_finite()) {
        return Err(Error::degenerate(
            format!("a mesh of {} triangles has no area", mesh.triangles.len()),
            "Give a mesh with a surface",
        ));
    }
    let blocks = (0..count.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            ctx.check()?;
            let mut rng = Rng::stream(seed, block as u64);
            Ok((block * BLOCK..((block + 1) * BLOCK).min(count))
                .map(|_| {
                    let at = rng.uniform() * total;
                    let i = below.partition_point(|&b| b <= at).min(below.len() - 1);
                    let [a, b, c] = mesh.triangles[i].map(|v| Vec3(mesh.positions[v as usize]));
                    let (r, s) = (rng.uniform().sqrt(), rng.uniform());
                    let p = a + (b - a) * (r * (1.0 - s)) + (c - a) * (r * s);
                    Sample { point: p, triangle: i as u32 }
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(blocks.concat())
}

/// Twice the area of triangle `i` times its normal.
#[must_use]
pub(super) fn area_vector(mesh: &TriMesh, i: usize) -> Vec3 {
    let [a, b, c] = mesh.triangles[i].map(|v| Vec3(mesh.positions[v as usize]));
    (b - a).cross(c - a)
}

/// Area of triangle `i`.
#[must_use]
pub(super) fn area(mesh: &TriMesh, i: usize) -> f64 {
    0.5 * area_vector(mesh, i).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn samples_follow_area_and_never_touch_triangles_without_area() {
        let mesh = TriMesh::new(
            vec![
                [0.0; 3],
                [3.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, -1.0, 0.0],
                [1.0, 0.0, 0.0],
                [f64::NAN; 3],
            ],
            vec![[0, 4, 1], [0, 1, 2], [0, 3, 4], [0, 1, 5]],
        );
        let sampled = || Run::default().execute(|ctx| uniform(&mesh, 40_000, 1, ctx)).unwrap();
        let samples = sampled();
        let count = |t| samples.iter().filter(|s| s.triangle == t).count();
        assert_eq!((count(0), count(3)), (0, 0));
        assert!((count(1) as f64 / 40_000.0 - 0.75).abs() < 0.01, "{}", count(1));
        let mean =
            samples.iter().filter(|s| s.triangle == 1).map(|s| s.point[0]).sum::<f64>() / count(1) as f64;
        assert!((mean - 1.0).abs() < 0.02, "the centroid of the triangle, not {mean}");
        assert_eq!(samples, sampled());
    }
}
