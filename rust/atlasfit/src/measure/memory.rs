//! How much memory measuring needs: decided here, for every caller.
//!
//! In: counts of meshes and samples. Out: bytes, known before anything is done. The constants are
//! fitted by hand to peaks of resident memory; `tests/memory.py` checks that they hold.

use crate::error::Result;
use crate::geometry::TriMesh;
use crate::run::{Context, total_bytes, with_threads};

/// Bytes for one face while a topology or UVs are measured: edges, fans, patches.
const BYTES_PER_FACE: u64 = 100;
/// Bytes for one vertex while a topology is measured.
const BYTES_PER_VERTEX: u64 = 40;
/// Bytes for one face that distances are measured to: the tree over the faces.
const BYTES_PER_SEARCHED_FACE: u64 = 130;
/// Bytes for one face while those that meet are found: its corners, its box, the tree over them.
const BYTES_PER_MEETING_FACE: u64 = 180;
/// Bytes for one sample of a surface, or one measured point: samples, feet, trees of the Chamfer distance.
const BYTES_PER_SAMPLE: u64 = 110;
/// Bytes for the picture that coverage and overlap are counted on.
const RASTER_BYTES: u64 = 4 << 20;

/// What else than a higher limit helps.
pub(super) const ADVICE: &str = "Raise the limit, or give fewer faces and samples";

/// Bytes that [`topology`](super::topology()) or [`uv`](super::uv()) need at their peak with so many threads,
/// positions and triangles included. A rough upper bound.
///
/// ```
/// use atlasfit::measure::memory_needed;
/// assert!((64 << 20..1 << 28).contains(&memory_needed(500_000, 1_000_000, 2)));
/// ```
#[must_use]
pub fn memory_needed(vertices: usize, faces: usize, threads: usize) -> u64 {
    total_bytes(&[(vertices, 24), (faces, 12), (1, work(vertices, faces, threads))])
}

/// How large a mesh or a cloud is.
#[derive(Clone, Copy)]
pub(super) struct Counts {
    pub points: usize,
    pub faces: usize,
}

fn work(vertices: usize, faces: usize, threads: usize) -> u64 {
    let work = total_bytes(&[(vertices, BYTES_PER_VERTEX), (faces, BYTES_PER_FACE), (1, RASTER_BYTES)]);
    with_threads(work, threads)
}

/// Bytes of work while faces that meet are found.
pub(super) fn meeting_work(vertices: usize, faces: usize, threads: usize) -> u64 {
    let work =
        total_bytes(&[(vertices, BYTES_PER_VERTEX), (faces, BYTES_PER_MEETING_FACE), (1, RASTER_BYTES)]);
    with_threads(work, threads)
}

/// Bytes of work while distances between a result and a truth are measured with so many samples in all,
/// measured points included.
pub(super) fn distance_work(result: Counts, truth: Counts, samples: usize, threads: usize) -> u64 {
    total_bytes(&[
        (result.faces, BYTES_PER_SEARCHED_FACE),
        (truth.faces, BYTES_PER_SEARCHED_FACE),
        (samples, BYTES_PER_SAMPLE),
        (1, work(result.points, result.faces, threads)),
    ])
}

/// Fails where a mesh cannot be measured within the run's limit.
pub(super) fn reserve(mesh: &TriMesh, ctx: &Context<'_>) -> Result<()> {
    let work = work(mesh.positions.len(), mesh.triangles.len(), ctx.threads());
    ctx.reserve(mesh.bytes().saturating_add(work), ADVICE)
}
