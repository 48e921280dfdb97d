//! Where a mesh passes through itself.
//!
//! In: a mesh, its vertices at one place joined as for its topology. Out: how many of its faces meet others
//! elsewhere than at shared vertices and edges. Exact for coordinates that are.

use super::memory::{self, ADVICE};
use super::topology::welded;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::vec3;
use crate::run::{Context, total_bytes};
use crate::spatial::faces::Faces;

/// Faces that meet others elsewhere than at shared vertices and edges, faces that lie on others among them.
/// Faces that name a place twice take no part. O(n log n) for n faces where few lie close together.
///
/// # Errors
/// [`crate::Error::IndexOutOfRange`] where a face names no vertex; [`crate::Error::OutOfMemory`] where the
/// run's memory does not suffice; cancel and time limit.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure};
/// let flat = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
/// let upright = [[0.4, 0.4, -1.0], [0.4, 0.5, 1.0], [9.0, 9.0, 0.0]];
/// let corners = [flat, upright].concat();
/// let crossed = TriMesh::new(corners, vec![[0, 1, 2], [3, 4, 5]]);
/// assert_eq!(Run::default().execute(|ctx| measure::self_intersecting(&crossed, ctx))?, 2);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn self_intersecting(mesh: &TriMesh, ctx: &Context<'_>) -> Result<usize> {
    mesh.validate()?;
    let (n, f) = (mesh.positions.len(), mesh.triangles.len());
    let work = memory::meeting_work(n, f, ctx.threads());
    ctx.reserve(total_bytes(&[(1, mesh.bytes()), (1, work)]), ADVICE)?;
    let triangles = welded(mesh, ctx)?;
    let all: Vec<u32> = (0..triangles.len() as u32).collect();
    let faces = Faces::new(vec3::of(&mesh.positions), &triangles, ctx)?;
    Ok(faces.meeting(&all, ctx)?.len())
}
