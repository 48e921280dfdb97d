//! Networks give a surface in gaps where the points show none: what no points support is cut off.
//!
//! In: a mesh and the points that it was fitted to. Out: the mesh without the triangles that have no points
//! near.

use atlasfit::error::Result;
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit::spatial::neighbours::Neighbours;
use rayon::prelude::*;

/// Vertices or triangles per task: below a millisecond of work between two looks at the cancel flag.
const BLOCK: usize = 512;

/// The mesh without the triangles of which a corner, or the centre, has no point within `limit`, a length in
/// the unit of both. Vertices stay; UVs are dropped.
///
/// # Errors
/// [`atlasfit::Error::EmptyInput`] without points; cancelled or out of time.
///
/// ```
/// use atlasfit::{Run, Vec3, geometry::TriMesh};
/// let mesh = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// let far = [Vec3([9.0, 0.0, 0.0])];
/// let trimmed = Run::default().execute(|ctx| atlasfit_net::trim(&mesh, &far, 0.5, ctx))?;
/// assert!(trimmed.triangles.is_empty());
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn trim(mesh: &TriMesh, points: &[Vec3], limit: f64, ctx: &Context<'_>) -> Result<TriMesh> {
    let tree = Neighbours::build(points, ctx)?;
    let near = |p: Vec3| p.iter().all(|x| x.is_finite()) && tree.nearest_one(p).dist2 <= limit * limit;
    let corners = mesh
        .positions
        .par_chunks(BLOCK)
        .map(|block| {
            ctx.check()?;
            Ok(block.iter().map(|p| near(Vec3(*p))).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    let triangles = mesh
        .triangles
        .par_chunks(BLOCK)
        .map(|block| {
            ctx.check()?;
            let supported = |t: &&[u32; 3]| {
                let [a, b, c] = t.map(|v| Vec3(mesh.positions[v as usize]));
                t.iter().all(|&v| corners[v as usize]) && near((a + b + c) * (1.0 / 3.0))
            };
            Ok(block.iter().filter(supported).copied().collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    Ok(TriMesh { triangles, corner_uv: None, corner_normals: None, face_chart: None, ..mesh.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::run::Run;

    #[test]
    fn trimming_keeps_what_points_support() {
        // Two squares of two triangles each; points lie along the first one only.
        let positions: Vec<[f64; 3]> = (0..6).map(|i| [f64::from(i / 2), f64::from(i % 2), 0.0]).collect();
        let mesh = TriMesh::new(positions, vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]]);
        let points: Vec<Vec3> =
            (0..400).map(|i| Vec3([f64::from(i / 20) / 19.0, f64::from(i % 20) / 19.0, 0.01])).collect();
        let trimmed = Run::default().execute(|ctx| trim(&mesh, &points, 0.1, ctx)).unwrap();
        assert_eq!(trimmed.triangles, mesh.triangles[..2]);
    }
}
