//! Measuring: topology, quality of UVs, distances. Works on any mesh, not only this library's.

use crate::arrays::copy_out;
use crate::mesh::{self, atlasfit_mesh};
use crate::points::{self, atlasfit_points};
use crate::run::{atlasfit_run, core_run};
use crate::sized::{self, Sized};
use crate::status::{ATLASFIT_BUFFER_TOO_SMALL, Failure, Outcome, atlasfit_status, guard};
use atlasfit::measure::uv::Pages;
use atlasfit::measure::{self, DistanceOptions, Distances};

/// Connectivity of a mesh. Vertices in one place count as one.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_topology {
    /// sizeof(atlasfit_topology), set by the caller.
    pub struct_size: usize,
    /// Vertices in use, after welding.
    pub vertices: usize,
    /// Edges.
    pub edges: usize,
    /// Faces that name three different places.
    pub faces: usize,
    /// Faces that do not; they take no part in the other counts.
    pub degenerate_faces: usize,
    /// Vertices that no face uses.
    pub unused_vertices: usize,
    /// Parts that share no vertex.
    pub parts: usize,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Closed chains of boundary edges.
    pub boundary_loops: usize,
    /// Edges with three or more faces.
    pub non_manifold_edges: usize,
    /// Vertices whose faces make more than one fan.
    pub non_manifold_vertices: usize,
    /// Edges whose two faces run along them in the same direction.
    pub inconsistent_edges: usize,
    /// Vertices - edges + faces.
    pub euler: i64,
    /// Genus with holes filled, summed over the parts; -1 where an edge is not manifold or the surface is
    /// one-sided.
    pub genus: i64,
    /// 1 if the faces could be turned so that no edge is inconsistent, else 0.
    pub orientable: u32,
    /// 1 if there is neither boundary nor an edge with more than two faces, else 0.
    pub closed: u32,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_topology {
    const NAME: &str = "atlasfit_topology";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// The core's counts as the header's.
fn topology(t: &measure::Topology) -> atlasfit_topology {
    atlasfit_topology {
        struct_size: size_of::<atlasfit_topology>(),
        vertices: t.vertices,
        edges: t.edges,
        faces: t.faces,
        degenerate_faces: t.degenerate_faces,
        unused_vertices: t.unused_vertices,
        parts: t.parts,
        boundary_edges: t.boundary_edges,
        boundary_loops: t.boundary_loops,
        non_manifold_edges: t.non_manifold_edges,
        non_manifold_vertices: t.non_manifold_vertices,
        inconsistent_edges: t.inconsistent_edges,
        euler: t.euler,
        genus: t.genus.map_or(-1, |g| g as i64),
        orientable: u32::from(t.orientable),
        closed: u32::from(t.is_closed()),
    }
}

/// Counts a mesh's connectivity.
///
/// @param mesh The mesh.
/// @param run  How long work is run; NULL = the defaults.
/// @param out  Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_measure_topology(
    mesh: *const atlasfit_mesh,
    run: *const atlasfit_run,
    out: *mut atlasfit_topology,
) -> atlasfit_status {
    guard("atlasfit_measure_topology", || unsafe {
        sized::checked_target(out)?;
        let mut run = core_run(run)?;
        let mut mesh = mesh::mesh(mesh)?;
        let t = run.execute(|ctx| {
            mesh.cut(ctx)?;
            measure::topology(&mesh.mesh, ctx)
        })?;
        sized::write(out, topology(&t))
    })
}

/// Quality of UVs. Stretch is after one global scale that makes the summed areas equal: 1 = isometric.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_uv_quality {
    /// sizeof(atlasfit_uv_quality), set by the caller.
    pub struct_size: usize,
    /// Triangles.
    pub faces: usize,
    /// Groups of triangles joined through edges with equal UVs at both ends.
    pub charts: usize,
    /// Triangles turned against the majority of their chart.
    pub flips: usize,
    /// Triangles with area in space and none in the texture, or with UVs that are not finite.
    pub degenerate: usize,
    /// Triangles whose inside meets another one's inside in the texture, by exact predicates.
    pub overlapping_faces: usize,
    /// Length of the inner edges that are cut, divided by the square root of the surface's area.
    pub seam: f64,
    /// L2 stretch of Sander et al. 2001; infinite where every triangle has collapsed.
    pub stretch_l2: f64,
    /// L-infinity stretch of Sander et al. 2001, collapsed triangles left out.
    pub stretch_linf: f64,
    /// Median by area of max(s1, 1/s2), with s1 >= s2 the singular values of the map from surface to texture.
    pub stretch_median: f64,
    /// 95% of the area is below.
    pub stretch_p95: f64,
    /// Mean by area of s1/s2: 1 = conformal.
    pub conformal: f64,
    /// Share of the covered texels that are covered more than once; 1024 x 1024 texels for all pages side by
    /// side.
    pub overlap: f64,
    /// Share of all texels that are covered.
    pub coverage: f64,
    /// 1 if all UVs lie on their pages, in [0, 1], else 0.
    pub inside: u32,
    /// 1 if all UVs are finite, else 0.
    pub finite: u32,
    /// Share of the length of the charts' outlines in the texture that is parallel to a side of the page, to
    /// within a millionth of the page for each edge, 0 to 1.
    pub straightness: f64,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_uv_quality {
    const NAME: &str = "atlasfit_uv_quality";
    const FIRST: usize = std::mem::offset_of!(Self, straightness);
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// Measures the UVs of a mesh, atlasfit_mesh.corner_uv, whichever program made them.
///
/// @param mesh         The mesh with its UVs; face_page, page_width and page_height say what they lie on.
/// @param run          How long work is run; NULL = the defaults.
/// @param out          Filled; its struct_size must be set.
/// @param face_stretch Stretch max(s1, 1/s2) per face, of its worst triangle: infinite for one that has
///                     collapsed, 1 for one without area in space. NULL = not wanted.
/// @param capacity     Numbers that `face_stretch` has room for, at least the number of faces unless it is
///                     NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_measure_uv(
    mesh: *const atlasfit_mesh,
    run: *const atlasfit_run,
    out: *mut atlasfit_uv_quality,
    face_stretch: *mut f32,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_measure_uv", || unsafe {
        sized::checked_target(out)?;
        let mut run = core_run(run)?;
        let mut m = mesh::mesh(mesh)?;
        checked_room(face_stretch, capacity, m.faces())?;
        let each_face = !face_stretch.is_null();
        let (q, stretch) = run.execute(|ctx| {
            m.cut(ctx)?;
            let pages = Pages { of_face: m.face_page.as_deref(), size: m.page_size };
            let q = measure::uv::uv_on(&m.mesh, &pages, ctx)?;
            if !each_face {
                return Ok((q, None));
            }
            let stretch = measure::uv::face_stretch(&m.mesh, &pages, ctx)?;
            Ok((
                q,
                Some(match &m.polygons {
                    Some(cut) => cut.largest_of_faces(&stretch, 1.0),
                    None => stretch,
                }),
            ))
        })?;
        let value = atlasfit_uv_quality {
            struct_size: size_of::<atlasfit_uv_quality>(),
            faces: q.faces,
            charts: q.charts,
            flips: q.flips,
            degenerate: q.degenerate,
            overlapping_faces: q.overlapping_faces,
            seam: q.seam,
            stretch_l2: q.stretch_l2,
            stretch_linf: q.stretch_linf,
            stretch_median: q.stretch_median,
            stretch_p95: q.stretch_p95,
            conformal: q.conformal,
            overlap: q.overlap,
            coverage: q.coverage,
            inside: u32::from(q.inside),
            finite: u32::from(q.finite),
            straightness: q.straightness,
        };
        if let Some(stretch) = stretch {
            copy_out(&stretch, face_stretch, capacity, "face stretch")?;
        }
        sized::write(out, value)
    })
}

/// Checks an optional buffer before the work.
fn checked_room<T>(buffer: *mut T, capacity: usize, needed: usize) -> Outcome {
    if !buffer.is_null() && capacity < needed {
        return Err(Failure::new(
            ATLASFIT_BUFFER_TOO_SMALL,
            format!("capacity is {capacity}, but there are {needed} values"),
        ));
    }
    Ok(())
}

/// How to measure distances. Fill it with atlasfit_distance_options_init(); a NULL pointer to one means the
/// defaults.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_distance_options {
    /// sizeof(atlasfit_distance_options).
    pub struct_size: usize,
    /// Samples of each surface for accuracy and completeness. Default 60,000.
    pub samples: usize,
    /// Samples of each surface for the Chamfer distance; chamfer_floor depends on it. Default 16,000.
    pub chamfer_samples: usize,
    /// Distance below which a sample counts for the F-score; 0 = half a percent of the truth's longest side.
    /// Default 0.
    pub threshold: f64,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_distance_options {
    const NAME: &str = "atlasfit_distance_options";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        let d = DistanceOptions::default();
        Self {
            struct_size: size_of::<Self>(),
            samples: d.samples,
            chamfer_samples: d.chamfer_samples,
            threshold: d.threshold.unwrap_or(0.0),
        }
    }
}

impl atlasfit_distance_options {
    fn core(&self) -> DistanceOptions {
        DistanceOptions::default()
            .with_samples(self.samples)
            .with_chamfer_samples(self.chamfer_samples)
            .with_threshold((self.threshold != 0.0).then_some(self.threshold))
    }
}

/// Fills options with their defaults.
///
/// @param options     The struct to fill.
/// @param struct_size sizeof(atlasfit_distance_options).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_distance_options_init(
    options: *mut atlasfit_distance_options,
    struct_size: usize,
) -> atlasfit_status {
    guard("atlasfit_distance_options_init", || unsafe { sized::init(options, struct_size) })
}

/// Statistics of a set of distances, in the meshes' unit. Part of atlasfit_distance: it does not grow.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_distance_stats {
    /// Root of the mean square.
    pub rms: f64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// 95% are below.
    pub p95: f64,
    /// 99% are below.
    pub p99: f64,
    /// The largest.
    pub max: f64,
}

impl From<Distances> for atlasfit_distance_stats {
    fn from(d: Distances) -> Self {
        Self { rms: d.rms, mean: d.mean, median: d.median, p95: d.p95, p99: d.p99, max: d.max }
    }
}

/// A mesh or points against the true surface.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct atlasfit_distance {
    /// sizeof(atlasfit_distance), set by the caller.
    pub struct_size: usize,
    /// From the result to the truth.
    pub accuracy: atlasfit_distance_stats,
    /// From the truth to the result; zeros for points.
    pub completeness: atlasfit_distance_stats,
    /// Chamfer distance (Gadelha et al. 2020): squared length.
    pub chamfer: f64,
    /// Chamfer distance of two sets of samples of the truth: no result can be expected to be below.
    pub chamfer_floor: f64,
    /// Harmonic mean of the shares of samples within the threshold, both ways, in [0, 1]; 0 for points.
    pub f_score: f64,
    /// The threshold that was used; 0 for points.
    pub threshold: f64,
    /// Mean absolute cosine between the normals at nearest points, in [0, 1]; 0 for points.
    pub normal_consistency: f64,
    /// The same with sign: negative for a surface that is inside out; 0 for points.
    pub normal_orientation: f64,
    /// Points that are not finite and were left out; 0 for meshes.
    pub not_finite: usize,
}

// SAFETY: numbers, size first.
unsafe impl Sized for atlasfit_distance {
    const NAME: &str = "atlasfit_distance";
    const FIRST: usize = size_of::<Self>();
    fn defaults() -> Self {
        // SAFETY: zeros are valid numbers.
        Self { struct_size: size_of::<Self>(), ..unsafe { std::mem::zeroed() } }
    }
}

/// Measures a mesh against the true surface, by random samples that follow the run's seed.
///
/// @param mesh    The mesh to judge.
/// @param truth   The true surface, in the same frame.
/// @param options How to measure; NULL = the defaults.
/// @param run     How long work is run; NULL = the defaults.
/// @param out     Filled; its struct_size must be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_measure_surface(
    mesh: *const atlasfit_mesh,
    truth: *const atlasfit_mesh,
    options: *const atlasfit_distance_options,
    run: *const atlasfit_run,
    out: *mut atlasfit_distance,
) -> atlasfit_status {
    guard("atlasfit_measure_surface", || unsafe {
        sized::checked_target(out)?;
        let options = sized::read_or_default(options)?.core();
        let mut run = core_run(run)?;
        let (mut mesh, mut truth) = (mesh::mesh(mesh)?, mesh::mesh(truth)?);
        let d = run.execute(|ctx| {
            mesh.cut(ctx)?;
            truth.cut(ctx)?;
            measure::surface(&mesh.mesh, &truth.mesh, &options, ctx)
        })?;
        let value = atlasfit_distance {
            accuracy: d.accuracy.into(),
            completeness: d.completeness.into(),
            chamfer: d.chamfer,
            chamfer_floor: d.chamfer_floor,
            f_score: d.f_score,
            threshold: d.threshold,
            normal_consistency: d.normal_consistency,
            normal_orientation: d.normal_orientation,
            ..atlasfit_distance::defaults()
        };
        sized::write(out, value)
    })
}

/// Measures points against the true surface.
///
/// @param points         The points to judge; only their positions are read.
/// @param truth          The true surface, in the same frame.
/// @param options        How to measure; NULL = the defaults.
/// @param run            How long work is run; NULL = the defaults.
/// @param out            Filled; its struct_size must be set.
/// @param point_distance Distance to the surface per point, infinite for points that are not finite; NULL =
///                       not wanted.
/// @param capacity       Numbers that `point_distance` has room for, at least points.count unless it is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn atlasfit_measure_points(
    points: *const atlasfit_points,
    truth: *const atlasfit_mesh,
    options: *const atlasfit_distance_options,
    run: *const atlasfit_run,
    out: *mut atlasfit_distance,
    point_distance: *mut f64,
    capacity: usize,
) -> atlasfit_status {
    guard("atlasfit_measure_points", || unsafe {
        sized::checked_target(out)?;
        let options = sized::read_or_default(options)?.core();
        let mut run = core_run(run)?;
        let cloud = atlasfit::geometry::PointCloud::from_positions(points::cloud_positions(points)?);
        let mut truth = mesh::mesh(truth)?;
        checked_room(point_distance, capacity, cloud.len())?;
        let (d, each) = run.execute(|ctx| {
            truth.cut(ctx)?;
            measure::points_each(&cloud, &truth.mesh, &options, ctx)
        })?;
        let value = atlasfit_distance {
            accuracy: d.accuracy.into(),
            chamfer: d.chamfer,
            chamfer_floor: d.chamfer_floor,
            not_finite: d.not_finite,
            ..atlasfit_distance::defaults()
        };
        if !point_distance.is_null() {
            copy_out(&each, point_distance, capacity, "point distances")?;
        }
        sized::write(out, value)
    })
}
