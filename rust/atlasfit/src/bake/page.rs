//! How large a page must be for old textures that are drawn anew.
//!
//! In: a mesh and its old textures. Out: their density, the side of a square page for it, its padding.

use super::resample::{Textures, density};
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// Free texels between charts for colours that stay apart at mip 3, where a bilinear look-up reaches 12
/// texels, from both sides. Derived.
const PADDING: u32 = 24;
/// The share of the area whose texture loses no density: the rest are often slivers of any density.
const SHARE: f64 = 0.95;
/// Share of a page that charts with so much padding cover at least, for the first guess of its size.
const COVERAGE: f64 = 0.5;
/// Sides of a page that is made for an old texture, in texels.
const SIDES: [u32; 2] = [256, 8192];

/// A page for old textures that are drawn anew.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TexturePage {
    /// Texels per unit of length that the old textures have on the mesh; 0 where no face has one.
    pub density: f64,
    /// Side of a square page that keeps it, in texels: a power of two from 256 to 8192.
    pub side: u32,
    /// Free texels between the charts of such a page.
    pub padding: u32,
}

impl TexturePage {
    /// How often a page of this `side` whose layout has so many texels per unit has to be doubled for the old
    /// density, as a factor: 1, 2, 4, as far as the largest page goes.
    #[must_use]
    pub fn enlarged(&self, side: u32, texels_per_unit: f64) -> u32 {
        let mut factor = 1;
        while f64::from(factor) * texels_per_unit < self.density && 2 * factor * side <= SIDES[1] {
            factor *= 2;
        }
        factor
    }
}

/// Free texels between charts of textures that are drawn anew, on a page of this size.
#[must_use]
pub fn texture_padding(size: [u32; 2]) -> u32 {
    PADDING.min(size[0].min(size[1]) / 8)
}

/// The page for a mesh's old textures: the densest of the `layers` decides.
///
/// # Errors
/// Those of [`density`].
pub fn texture_page(mesh: &TriMesh, layers: &[Textures<'_>], ctx: &Context<'_>) -> Result<TexturePage> {
    let mut most: f64 = 0.0;
    for layer in layers {
        most = most.max(density(mesh, layer, SHARE, ctx)?);
    }
    let side = (most * most * area(mesh) / COVERAGE).sqrt().min(f64::from(SIDES[1])) as u32;
    let side = side.max(1).next_power_of_two().clamp(SIDES[0], SIDES[1]);
    Ok(TexturePage { density: most, side, padding: texture_padding([side; 2]) })
}

/// The area of the faces whose positions are finite.
fn area(mesh: &TriMesh) -> f64 {
    let face = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| Vec3(mesh.positions[v as usize]));
        (b - a).cross(c - a).norm() / 2.0
    };
    mesh.triangles.iter().map(face).filter(|a| a.is_finite()).sum()
}
