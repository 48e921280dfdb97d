//! A disk-like piece of a scan, before a chart is fitted to it.

use crate::numeric::vec3::Vec3;

/// A patch before it is fitted.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Centre.
    pub center: Vec3,
    /// Base axes and normal.
    pub axes: [Vec3; 3],
    /// Half axes of the domain.
    pub radii: [f64; 2],
    /// The quadric over the base plane: heights at (u, v) in the unit disk are q . (1, u, v, u^2, uv, v^2).
    pub quadric: [f64; 6],
    /// Points that follow the quadric, with domain coordinates inside the unit disk (and a little beyond).
    pub members: Vec<u32>,
    /// Standard deviation of the points about the quadric, its six degrees of freedom taken into account.
    pub residual: f64,
    /// Point spacing about the seed.
    pub spacing: f64,
    /// Noise that the patch was grown with, standard deviation.
    pub sigma: f64,
    /// Whether it is one of two sheets that were told apart though they lie within each other's noise.
    pub of_two: bool,
    /// Whether the quadric explains the points to within the noise. A patch that does not is a last resort.
    pub accepted: bool,
}
