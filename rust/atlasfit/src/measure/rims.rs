//! How far the boundary of a result is from that of the truth, both ways.
//!
//! In: a result and the true surface, in one frame. Out: distances between places spread evenly along both
//! boundaries, and how long these are. Lengths are in the unit of the input.

use super::distance::{DistanceOptions, check};
use super::statistics::Distances;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::neighbours::Neighbours;
use rayon::prelude::*;

/// The boundary of a result against that of the truth.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RimDistance {
    /// Boundary of the result to that of the truth.
    pub accuracy: Distances,
    /// Boundary of the truth to that of the result.
    pub completeness: Distances,
    /// Length of the result's boundary.
    pub length: f64,
    /// Length of the truth's.
    pub true_length: f64,
}

/// Measures the boundary of a mesh against that of the true surface; `None` where either has none. Each is
/// looked at in as many places as [`DistanceOptions::samples`] says. A distance may be too large by as much
/// as the places are apart.
///
/// # Errors
/// [`crate::Error::InvalidArgument`] for an option out of range, [`crate::Error::IndexOutOfRange`] for a
/// triangle that names no vertex; cancel and time limit.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure};
/// let at = |x: f64| TriMesh::new(vec![[x, 0.0, 0.0], [x + 3.0, 0.0, 0.0], [x, 4.0, 0.0]], vec![[0, 1, 2]]);
/// let options = measure::DistanceOptions::default();
/// let rims = Run::default().execute(|ctx| measure::rims(&at(0.0), &at(0.0), &options, ctx))?.unwrap();
/// assert!((rims.length - 12.0).abs() < 1e-12 && rims.accuracy.max < 1e-3);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn rims(
    result: &TriMesh,
    truth: &TriMesh,
    options: &DistanceOptions,
    ctx: &Context<'_>,
) -> Result<Option<RimDistance>> {
    check(options)?;
    result.validate()?;
    truth.validate()?;
    let (ours, theirs) = (Rim::new(result, options.samples, ctx)?, Rim::new(truth, options.samples, ctx)?);
    if ours.places.is_empty() || theirs.places.is_empty() {
        return Ok(None);
    }
    Ok(Some(RimDistance {
        accuracy: ours.distances(&theirs, ctx)?,
        completeness: theirs.distances(&ours, ctx)?,
        length: ours.length,
        true_length: theirs.length,
    }))
}

/// A boundary.
struct Rim {
    /// Places spread evenly along it, and the number of the edge that each lies on.
    places: Vec<Vec3>,
    edge_of: Vec<u32>,
    edges: Vec<[Vec3; 2]>,
    length: f64,
}

impl Rim {
    /// The boundary of a mesh, with so many places on it; none where it has no length.
    fn new(mesh: &TriMesh, samples: usize, ctx: &Context<'_>) -> Result<Self> {
        let at = |v: u32| Vec3(mesh.positions[v as usize]);
        let mut edges: Vec<[Vec3; 2]> = Edges::new(&mesh.triangles, ctx)?
            .iter()
            .filter(|edge| edge.len() == 1)
            .map(|edge| edge[0].ends().map(at))
            .collect();
        edges.retain(|[a, b]| (*b - *a).norm().is_finite());
        let lengths: Vec<f64> = edges.iter().map(|[a, b]| (*b - *a).norm()).collect();
        let length: f64 = lengths.iter().sum();
        let (mut places, mut edge_of) = (Vec::new(), Vec::new());
        if length > 0.0 {
            let step = length / samples as f64;
            let mut before = 0.0;
            for (i, ([a, b], own)) in edges.iter().zip(&lengths).enumerate() {
                ctx.check_at(i)?;
                while places.len() < samples {
                    let along = (places.len() as f64 + 0.5) * step - before;
                    if along > *own && i + 1 < edges.len() {
                        break;
                    }
                    places.push(*a + (*b - *a) * (along / own).clamp(0.0, 1.0));
                    edge_of.push(i as u32);
                }
                before += own;
            }
        }
        Ok(Self { places, edge_of, edges, length })
    }
    /// Distances of the places to another boundary: to the edge on which the nearest place lies.
    fn distances(&self, other: &Self, ctx: &Context<'_>) -> Result<Distances> {
        let tree = Neighbours::build(&other.places, ctx)?;
        let distance = |p: &Vec3| {
            let nearest = tree.nearest_one(*p).index as usize;
            let [a, b] = other.edges[other.edge_of[nearest] as usize];
            let (way, to) = (b - a, *p - a);
            let share = (to.dot(way) / way.norm2()).clamp(0.0, 1.0);
            (to - way * share).norm()
        };
        let chunks = self.places.par_chunks(1024).map(|chunk| {
            ctx.check()?;
            Ok(chunk.iter().map(distance).collect::<Vec<_>>())
        });
        Ok(Distances::of(chunks.collect::<Result<Vec<_>>>()?.concat()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// A square of this side in so many rows of triangles.
    fn square(side: f64, n: u32) -> TriMesh {
        let at = |i: u32| [i % (n + 1), i / (n + 1)].map(|k| side * f64::from(k) / f64::from(n));
        let positions = (0..(n + 1) * (n + 1)).map(at).map(|[x, y]| [x - side / 2.0, y - side / 2.0, 0.0]);
        let corner = (0..n * n).map(|i| i / n * (n + 1) + i % n);
        let triangles = corner.flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        TriMesh::new(positions.collect(), triangles.collect())
    }

    #[test]
    fn the_boundary_of_a_smaller_square_is_as_far_off_as_its_sides() {
        let measured = Run::default()
            .execute(|ctx| rims(&square(1.0, 7), &square(1.2, 5), &DistanceOptions::default(), ctx));
        let rims = measured.expect("two squares").expect("two boundaries");
        assert!((rims.length - 4.0).abs() < 1e-9 && (rims.true_length - 4.8).abs() < 1e-9);
        // From within all are 0.1 off; from without the corners are farther.
        assert!((rims.accuracy.rms - 0.1).abs() < 1e-3 && (rims.completeness.median - 0.1).abs() < 1e-3);
        assert!((rims.completeness.max - 0.1 * 2.0f64.sqrt()).abs() < 1e-3, "{:?}", rims.completeness);
    }

    #[test]
    fn what_is_closed_has_no_boundary() {
        let closed = TriMesh::new(
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        );
        let measured =
            Run::default().execute(|ctx| rims(&closed, &square(1.0, 2), &DistanceOptions::default(), ctx));
        assert!(measured.expect("two meshes").is_none());
    }
}
