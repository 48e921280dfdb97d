//! What the surface is blended from at a denoised point.

use crate::numeric::vec3::Vec3;

/// A denoised point: where it lies and which charts vouch for it there.
#[derive(Debug, Clone, Copy)]
pub struct BlendSite {
    /// Position on the atlas.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Point spacing there.
    pub spacing: f64,
    /// Its strongest charts with their blend weights; `u32::MAX` marks unused places.
    pub charts: [(u32, f32); SITE_CHARTS],
}

/// Charts kept per point. More overlap averages more, at the cost of evaluating more charts per corner.
pub const SITE_CHARTS: usize = 5;
