//! What the main job gives back.

use crate::atlas::Chart;
use crate::geometry::{PointCloud, TriMesh};
use crate::numeric::vec3::Vec3;
use crate::register::Registration;
use crate::run::Stage;

/// What was found and done.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Points given.
    pub points: usize,
    /// Points with a coordinate that is not finite; they are left out.
    pub not_finite: usize,
    /// Points that repeat the position of an earlier one, or are copies of it: nearer than a thousandth of
    /// the distance to the next; nearer than up to a tenth where far more of the scan's points have such
    /// neighbours than chance gives. They move with it.
    pub duplicates: usize,
    /// Points set aside because no chart claims them.
    pub outliers: usize,
    /// Outliers of a mesh that follow the surface between their neighbours, as
    /// [`denoise_vertices`](super::denoise_vertices) says; the other outliers stay where they are.
    pub followed_outliers: usize,
    /// Median distance between neighbouring points, in the scan's unit; where many points lie in rows far
    /// apart, between the points that are left when those of a row are averaged.
    pub spacing: f64,
    /// Noise (standard deviation along the normal), in the scan's unit; estimated or as given.
    pub noise: f64,
    /// Charts fitted.
    pub charts: usize,
    /// Whether some part of the surface is one-sided.
    pub one_sided: bool,
    /// Side of the finest voxels that the surface was contoured with, in the scan's unit: where points lie
    /// far apart they are wider.
    pub voxel: f64,
    /// Connected parts of the surface.
    pub parts: usize,
    /// Connected parts that were left out, as the options asked for.
    pub dropped_parts: usize,
    /// Points given that lie on those parts. They are denoised all the same, and no outliers.
    pub dropped_points: usize,
    /// Holes that were filled.
    pub filled_holes: usize,
    /// Boundary loops of the surface.
    pub boundary_loops: usize,
    /// Edges on the boundary.
    pub boundary_edges: usize,
    /// UV charts.
    pub uv_charts: usize,
    /// By how much the charts' own standard deviations were widened, as the residuals of points beside each
    /// other ask for: 1 or more. `None` where uncertainty was not asked for, or the residuals do not tell.
    pub uncertainty_factor: Option<f64>,
    /// How the sweeps were moved, where that was asked for.
    pub registration: Option<Registration>,
    /// What the user should know, in words.
    pub warnings: Vec<String>,
    /// Seconds per stage.
    pub seconds: Vec<(Stage, f64)>,
}

/// A denoised scan.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Denoised {
    /// Denoised points with normals and the scan's own attributes, in input order (points that are not finite
    /// stay as they were; outliers too unless they are dropped or follow their neighbours in a mesh).
    pub points: PointCloud,
    /// For each denoised point, the input point it came from.
    pub point_source: Vec<u32>,
    /// For each denoised point, the chart that weighs most there; `u32::MAX` for points on no chart:
    /// outliers, and those that are not finite.
    pub point_chart: Vec<u32>,
    /// The stitched surface, with normals, UVs and the scan's attributes.
    pub surface: TriMesh,
    /// The charts, in the normalised frame.
    pub charts: Vec<Chart>,
    /// Origin of the normalised frame in the scan's.
    pub origin: Vec3,
    /// Length of the normalised frame's unit in the scan's.
    pub scale: f64,
    /// What was found and done.
    pub report: Report,
}
