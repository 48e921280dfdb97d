//! How much memory measuring needs: decided here, for every caller.
//!
//! In: counts of meshes and samples. Out: bytes, known before anything is done. The constants are measured
//! as the largest of the meshes of `tests/memory.py --measure`.

use super::distance::DistanceOptions;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::run::{Context, PER_THREAD_BYTES};

/// Bytes for one face while a topology or UVs are measured: edges, fans, patches.
const BYTES_PER_FACE: u64 = 100;
/// Bytes for one vertex while a topology is measured.
const BYTES_PER_VERTEX: u64 = 40;
/// Bytes for one face that distances are measured to: the tree over the faces.
const BYTES_PER_SEARCHED_FACE: u64 = 130;
/// Bytes for one sample of a surface, or one measured point: samples, feet, trees of the Chamfer distance.
const BYTES_PER_SAMPLE: u64 = 110;
/// Bytes for the picture that coverage and overlap are counted on.
const RASTER_BYTES: u64 = 4 << 20;

/// What else than a higher limit helps.
const ADVICE: &str = "Raise the limit, or give fewer faces and samples";

/// Bytes that [`topology`](super::topology) or [`uv`](super::uv()) need at their peak with so many threads,
/// positions and triangles included. A rough upper bound.
///
/// ```
/// use atlasfit::measure::memory_needed;
/// assert!((64 << 20..1 << 28).contains(&memory_needed(500_000, 1_000_000, 2)));
/// ```
#[must_use]
pub fn memory_needed(vertices: usize, faces: usize, threads: usize) -> u64 {
    held(vertices, faces) + work(vertices, faces, threads)
}

/// Bytes that [`surface`](super::surface()) needs at its peak for a result and a truth of so many vertices
/// and faces, which are included; for [`points`](super::points()) the result has no faces.
///
/// ```
/// use atlasfit::{measure::{DistanceOptions, distance_memory_needed}, geometry::TriMesh};
/// let mesh = TriMesh::new(vec![[0.0; 3]; 10_000], vec![[0, 1, 2]; 20_000]);
/// assert!(distance_memory_needed(&mesh, &mesh, &DistanceOptions::default(), 2) > 1 << 24);
/// ```
#[must_use]
pub fn distance_memory_needed(
    result: &TriMesh,
    truth: &TriMesh,
    options: &DistanceOptions,
    threads: usize,
) -> u64 {
    let counts = |m: &TriMesh| Counts { points: m.positions.len(), faces: m.triangles.len() };
    result.bytes() + truth.bytes() + distance_work(counts(result), counts(truth), options, threads)
}

/// How large a mesh or a cloud is.
#[derive(Clone, Copy)]
pub(super) struct Counts {
    pub points: usize,
    pub faces: usize,
}

/// Bytes of bare positions and triangles.
fn held(vertices: usize, faces: usize) -> u64 {
    24 * vertices as u64 + 12 * faces as u64
}

fn work(vertices: usize, faces: usize, threads: usize) -> u64 {
    let threads = PER_THREAD_BYTES * threads as u64;
    BYTES_PER_VERTEX * vertices as u64 + BYTES_PER_FACE * faces as u64 + RASTER_BYTES + threads
}

/// What distances need beside the meshes themselves.
fn distance_work(result: Counts, truth: Counts, options: &DistanceOptions, threads: usize) -> u64 {
    let samples = match result.faces {
        0 => 2 * result.points + options.chamfer_samples,
        _ => 2 * options.samples + 3 * options.chamfer_samples,
    };
    let searched = BYTES_PER_SEARCHED_FACE * (result.faces + truth.faces) as u64;
    let topology = work(result.points * usize::from(result.faces > 0), result.faces, threads);
    searched + topology + BYTES_PER_SAMPLE * samples as u64
}

/// Fails where a mesh cannot be measured within the run's limit.
pub(super) fn reserve(mesh: &TriMesh, ctx: &Context<'_>) -> Result<()> {
    ctx.reserve(mesh.bytes() + work(mesh.positions.len(), mesh.triangles.len(), ctx.threads()), ADVICE)
}

/// Fails where distances cannot be measured within the run's limit. `own` bytes hold the result.
pub(super) fn reserve_distances(
    own: u64,
    result: Counts,
    truth: &TriMesh,
    options: &DistanceOptions,
    ctx: &Context<'_>,
) -> Result<()> {
    let of_truth = Counts { points: truth.positions.len(), faces: truth.triangles.len() };
    let work = distance_work(result, of_truth, options, ctx.threads());
    ctx.reserve(own + truth.bytes() + work, ADVICE)
}
