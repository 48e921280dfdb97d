//! How much memory denoising needs.
//!
//! In: the number of points; then, once they are looked at, how far apart they lie. Out: bytes, known before
//! charts are cut: first what a scan of this size usually needs, then what this one does.

use super::options::DenoiseOptions;
use super::prepare::Sampled;
use super::survey::Survey;
use super::voxels;
use crate::error::Result;
use crate::run::{Context, total_bytes, with_threads};
use crate::unwrap;

/// Bytes for one point while the surface is contoured: the user's columns, points, charts. Fitted by hand, as
/// all below, to peaks of resident memory; `tests/memory.py` checks that they hold.
const BYTES_PER_POINT: u64 = 290;
/// Bytes for one point while UVs are laid out: the user's columns, the points on the charts, the charts.
const BYTES_PER_POINT_WITH_UV: u64 = 230;
/// Bytes for one point where uncertainty is asked for: sums over its charts, its neighbours, columns.
/// Derived.
const BYTES_PER_UNSURE_POINT: u64 = 120;
/// Bytes for one vertex of the surface while it is contoured: the blocks of voxels about it, its faces.
const BYTES_PER_SURFACE_VERTEX: u64 = 350;
/// Bytes for one vertex of the surface while UVs are laid out, beside what unwrapping needs: its columns.
const BYTES_PER_HELD_VERTEX: u64 = 40;
/// Bytes for one vertex of the open surface while a solid is made of it: its triangles in a tree with the
/// series of their clusters, the lattice and its triangles, on both sides where it is a plate.
const BYTES_PER_SOLID_VERTEX: u64 = 1800;
/// Vertices of the surface for each that is left when it is simplified, at the least: usually four to five.
const LIGHTER: usize = 2;
/// Vertices of a solid for each of the open surface.
const SOLID_VERTICES: usize = 4;
/// Bytes of the pairs of a point and a block that are contoured at a time.
const PAIRS_BYTES: u64 = 60 << 20;
/// Bytes of the pairs of one point: small scans do not fill the above.
const PAIRS_BYTES_PER_POINT: u64 = 900;
/// Vertices of the surface for each square of a voxel's side on it.
const VERTICES_PER_VOXEL: f64 = 1.35;
/// Vertices of the surface for one point of an even sampling: a point stands for 1 / 0.75^2 squares.
const VERTICES_PER_POINT: f64 = 2.1;

/// What else than a higher limit helps.
const ADVICE: &str = "Raise the limit, lower the detail, leave out the UVs, or give fewer points";

/// Bytes that [`denoise`](super::denoise) needs at its peak with so many threads for an evenly sampled scan
/// of so many points, which are included. A scan whose spacing varies needs more: that is found, and refused
/// if the run's limit is lower, once its spacing is known.
///
/// ```
/// use atlasfit::pipeline::{DenoiseOptions, memory_needed};
/// let options = DenoiseOptions::default();
/// let with_uv = memory_needed(1_000_000, &options, 4);
/// assert!(with_uv > 1 << 30 && with_uv > memory_needed(1_000_000, &options.with_uv(false), 4));
/// ```
#[must_use]
pub fn memory_needed(points: usize, options: &DenoiseOptions, threads: usize) -> u64 {
    let vertices = VERTICES_PER_POINT * points as f64 * options.detail.powi(2);
    needed(points, vertices as usize, options, threads)
}

/// Bytes for so many points and a surface of so many vertices.
fn needed(points: usize, vertices: usize, options: &DenoiseOptions, threads: usize) -> u64 {
    let unsure = if options.uncertainty { total_bytes(&[(points, BYTES_PER_UNSURE_POINT)]) } else { 0 };
    plainly_needed(points, vertices, options, threads).saturating_add(unsure)
}

/// The same where no uncertainty is asked for.
fn plainly_needed(points: usize, vertices: usize, options: &DenoiseOptions, threads: usize) -> u64 {
    if !options.surface {
        return with_threads(total_bytes(&[(points, BYTES_PER_POINT)]), threads);
    }
    let pairs = total_bytes(&[(points, PAIRS_BYTES_PER_POINT)]).min(PAIRS_BYTES);
    let contouring = [(points, BYTES_PER_POINT), (vertices, BYTES_PER_SURFACE_VERTEX), (1, pairs)];
    let closing = [(points, BYTES_PER_POINT), (vertices, BYTES_PER_SOLID_VERTEX)];
    let closing = if options.watertight { total_bytes(&closing) } else { 0 };
    let contouring = with_threads(total_bytes(&contouring).max(closing), threads);
    let vertices = match options.max_error {
        _ if options.watertight => vertices.saturating_mul(SOLID_VERTICES),
        None if options.faces.is_none() => vertices / LIGHTER,
        _ => vertices,
    };
    if !options.lays_out_uv() {
        return contouring;
    }
    let how = super::finish::uv_options(options);
    let unwrapping = unwrap::memory_needed(vertices, vertices.saturating_mul(2), &how, threads);
    let with_uv = [(points, BYTES_PER_POINT_WITH_UV), (vertices, BYTES_PER_HELD_VERTEX), (1, unwrapping)];
    contouring.max(total_bytes(&with_uv))
}

/// Fails where so many points usually need more than the run may use.
pub(super) fn reserve(points: usize, extra: u64, options: &DenoiseOptions, ctx: &Context<'_>) -> Result<()> {
    ctx.reserve(memory_needed(points, options, ctx.threads()).saturating_add(extra), ADVICE)
}

/// Fails where this scan, or this tile of what is `told`, needs more than the run may use. The noise of a
/// scan is not known yet: that only makes voxels larger.
pub(super) fn reserve_sampled(
    scan: &Sampled,
    told: Option<&Survey>,
    extra: u64,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<()> {
    let voxels = voxels::of(&scan.sampling, 0.0, options.detail, told);
    let vertices = VERTICES_PER_VOXEL * voxels::squares(&scan.sampling, voxels);
    let own = needed(scan.points.len(), vertices as usize, options, ctx.threads());
    ctx.reserve(own.saturating_add(extra), ADVICE)
}
