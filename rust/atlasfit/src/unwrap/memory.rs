//! How much memory unwrapping needs.
//!
//! In: the counts of a mesh. Out: bytes, known before anything is done.

use super::options::UnwrapOptions;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::run::{Context, total_bytes, with_threads};

/// Bytes for one triangle: adjacency, normals, its charts and their matrices, its UVs. Fitted by hand, as
/// below, to peaks of resident memory; `tests/memory.py` checks that they hold.
const BYTES_PER_FACE: u64 = 440;
/// Bytes for one triangle besides, where parts are cut open: layouts of several cuts at once, and the
/// matrices of Newton's steps. Fitted likewise, to meshes of 14,000 to 34,000 triangles.
const BYTES_PER_OPENED_FACE: u64 = 3000;
/// Bytes for each vertex that a closed surface of as many triangles does not have: triangles that share few
/// vertices make many charts, which are packed each.
const BYTES_PER_EXTRA_VERTEX: u64 = 920;
/// Bytes for one entry of a list of groups or polygons, the caller's and what is made of it, or for the
/// prices of a triangle's edges.
const BYTES_PER_ENTRY: u64 = 12;
/// Triangles for one vertex of a closed surface.
const FACES_PER_VERTEX: usize = 2;

/// Bytes that [`unwrap`](super::unwrap) needs at its peak with so many threads, the mesh's positions and
/// triangles included; other columns of the mesh come on top. A rough upper bound: a mesh may need half of
/// it. Of the options only a bound on the energy changes it by much. A run whose limit is lower is refused
/// before it starts.
///
/// ```
/// use atlasfit::unwrap::{UnwrapOptions, memory_needed};
/// let bytes = memory_needed(500_000, 1_000_000, &UnwrapOptions::default(), 2);
/// assert!((300 << 20..1 << 30).contains(&bytes));
/// ```
#[must_use]
pub fn memory_needed(vertices: usize, faces: usize, options: &UnwrapOptions, threads: usize) -> u64 {
    let priced = options.seams_hidden > 0.0 || options.seam_price.is_some();
    let lists = [options.face_group.is_some(), options.face_polygon.is_some(), priced];
    let lists = lists.into_iter().filter(|l| *l).count();
    let opened = if options.max_energy.is_some() { faces } else { 0 };
    let extra = vertices.saturating_sub(faces / FACES_PER_VERTEX);
    let work = total_bytes(&[
        (faces, BYTES_PER_FACE),
        (opened, BYTES_PER_OPENED_FACE),
        (extra, BYTES_PER_EXTRA_VERTEX),
        (lists.saturating_mul(faces), BYTES_PER_ENTRY),
    ]);
    with_threads(work, threads)
}

/// Fails where the mesh needs more than the run may use.
pub(super) fn reserve(mesh: &TriMesh, options: &UnwrapOptions, ctx: &Context<'_>) -> Result<()> {
    let bare = (24 * mesh.positions.len() + 12 * mesh.triangles.len()) as u64;
    let needed = memory_needed(mesh.positions.len(), mesh.triangles.len(), options, ctx.threads());
    ctx.reserve(
        needed.saturating_add(mesh.bytes() - bare),
        "Raise the limit, or give fewer faces: simplify the mesh first, or unwrap it in parts",
    )
}
