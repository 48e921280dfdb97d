//! How much UVs stretch a surface.
//!
//! In: a mesh with texture coordinates per corner. Out: stretch of each face and of the whole, from the
//! singular values of the map from surface to texture after one global scale that makes the summed areas
//! equal.
//! Source: Sander, Snyder, Gortler, Hoppe 2001, "Texture mapping progressive meshes" (L2 and L-infinity
//! norms).

use super::layout::{FaceUv, Pages, is_finite, laid_out, signed_area};
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::measure::sample::area;
use crate::numeric::sort::sort_by;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// A face with less than this share of the surface's area has no area that could be stretched: a hundred
/// times the rounding of f64.
const NO_AREA: f64 = 1e-14;
/// A face whose smaller singular value is below this has collapsed in the texture: at this ratio a metre is a
/// nanometre.
const COLLAPSED: f64 = 1e-9;
/// Guard of a division by the texture's area where all faces have collapsed: far below any area.
const LEAST_AREA: f64 = 1e-300;

/// Stretch max(s1, 1/s2) of every face, with s1 >= s2 the singular values of its map from surface to texture
/// at the one scale of [`uv_on`](super::uv_on). 1 = isometric, infinite where the face has collapsed, 1 where
/// it has no area in space.
///
/// # Errors
/// As [`uv_on`](super::uv_on).
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure::uv};
/// let mut mesh = TriMesh::new(vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], vec![[0, 1, 2]]);
/// mesh.corner_uv = Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
/// let stretch = Run::default().execute(|ctx| uv::face_stretch(&mesh, &uv::Pages::default(), ctx))?;
/// assert!((stretch[0] - 1.0).abs() < 1e-6);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn face_stretch(mesh: &TriMesh, pages: &Pages<'_>, ctx: &Context<'_>) -> Result<Vec<f32>> {
    let uvs = laid_out(mesh, pages)?.uvs;
    let areas = Areas::new(mesh, &uvs, ctx)?;
    Ok((0..uvs.len())
        .into_par_iter()
        .map(|i| {
            if !areas.some(i) {
                return 1.0;
            }
            let SingularValues { s1, s2 } = singular_values(mesh, i, &uvs[i], areas.to_space);
            let value = if s2 > COLLAPSED { s1.max(s2.recip()) } else { f64::INFINITY };
            if value.is_nan() { f32::INFINITY } else { value as f32 }
        })
        .collect())
}

/// Areas of the faces.
pub(super) struct Areas {
    /// In space, squared unit of the mesh; 0 where a position is not finite.
    space: Vec<f64>,
    /// Their sum.
    pub total: f64,
    /// In the texture, signed; 0 where UVs are not finite.
    pub texture: Vec<f64>,
    /// The scale of the texture that makes the summed areas equal, faces without area in space left out.
    pub to_space: f64,
}

impl Areas {
    /// Of UVs that are laid out.
    pub fn new(mesh: &TriMesh, uvs: &[FaceUv], ctx: &Context<'_>) -> Result<Self> {
        let (mut space, mut texture) = (Vec::with_capacity(uvs.len()), Vec::with_capacity(uvs.len()));
        for (i, c) in uvs.iter().enumerate() {
            ctx.check_at(i)?;
            // One position that is not finite must say nothing about the other faces.
            space.push(Some(area(mesh, i)).filter(|a| a.is_finite()).unwrap_or(0.0));
            texture.push(if is_finite(c) { signed_area(c) } else { 0.0 });
        }
        let total = space.iter().sum();
        let mut out = Self { space, total, texture, to_space: 0.0 };
        let (mut in_space, mut in_texture) = (0.0, 0.0);
        for i in (0..uvs.len()).filter(|&i| out.some(i)) {
            ctx.check_at(i)?;
            in_space += out.space[i];
            in_texture += out.texture[i].abs();
        }
        out.to_space = (in_space / in_texture.max(LEAST_AREA)).sqrt();
        Ok(out)
    }

    /// Whether a face has area in space.
    pub fn some(&self, i: usize) -> bool {
        self.space[i] > NO_AREA * self.total
    }
}

/// Singular values of the map from a face in space to the scaled texture, s1 >= s2 >= 0.
#[derive(Clone, Copy, Default)]
pub(super) struct SingularValues {
    s1: f64,
    s2: f64,
}

/// The singular values of face `i`; `to_space` is the scale of the texture.
pub(super) fn singular_values(mesh: &TriMesh, i: usize, uv: &FaceUv, to_space: f64) -> SingularValues {
    let [p, q, r] = mesh.triangles[i].map(|v| Vec3(mesh.positions[v as usize]));
    let (a, b) = (q - p, r - p);
    let la = a.norm();
    // The face in its plane: (0, 0), (la, 0), (x, y).
    let (x, y) = (a.dot(b) / la, 2.0 * area(mesh, i) / la);
    let d = |k: usize| [0, 1].map(|c| (uv[k][c] - uv[0][c]) * to_space);
    let (d1, d2) = (d(1), d(2));
    let du = d1.map(|v| v / la);
    let dv = [(d2[0] - du[0] * x) / y, (d2[1] - du[1] * x) / y];
    let (e, g) = (du[0] * du[0] + du[1] * du[1], dv[0] * dv[0] + dv[1] * dv[1]);
    let f = du[0] * dv[0] + du[1] * dv[1];
    let root = (0.25 * (e - g) * (e - g) + f * f).sqrt();
    let s1 = (0.5 * (e + g) + root).sqrt();
    // Their product is the determinant: the difference of squares would leave nothing of a small one.
    SingularValues { s1, s2: (du[0] * dv[1] - du[1] * dv[0]).abs() / s1.max(f64::MIN_POSITIVE) }
}

/// Stretch of a whole mesh: the fields of [`UvQuality`](super::UvQuality) of the same names.
pub(super) struct Stretch {
    pub l2: f64,
    pub linf: f64,
    pub median: f64,
    pub p95: f64,
    pub conformal: f64,
    /// Faces with area in space and none in the texture.
    pub collapsed: usize,
}

/// Sums the stretch of all faces, weighted by their areas in space.
pub(super) fn stretch(singular: &[SingularValues], areas: &Areas, ctx: &Context<'_>) -> Result<Stretch> {
    let (mut weight, mut squares, mut ratio, mut linf, mut collapsed) = (0.0, 0.0, 0.0, 0.0f64, 0);
    let mut worst: Vec<(f64, f64)> = Vec::new();
    for i in (0..singular.len()).filter(|&i| areas.some(i)) {
        ctx.check_at(i)?;
        let SingularValues { s1, s2 } = singular[i];
        if s2 > COLLAPSED {
            weight += areas.space[i];
            squares += areas.space[i] * 0.5 * ((s1 * s1).recip() + (s2 * s2).recip());
            ratio += areas.space[i] * s1 / s2;
            linf = linf.max(s2.recip());
        } else {
            collapsed += 1;
        }
        // A value that is not a number counts as infinite stretch.
        let value = if s2 > COLLAPSED { s1.max(s2.recip()) } else { s1.max(COLLAPSED.recip()) };
        worst.push((if value.is_nan() { f64::INFINITY } else { value }, areas.space[i]));
    }
    sort_by(&mut worst, |a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)), ctx)?;
    let all: f64 = worst.iter().map(|w| w.1).sum();
    let quantile = |q: f64| {
        let mut below = 0.0;
        let reached = worst.iter().find(|w| {
            below += w.1;
            below >= q * all
        });
        reached.or(worst.last()).map_or(f64::INFINITY, |w| w.0)
    };
    let or_infinite = |x: f64| if weight > 0.0 { x } else { f64::INFINITY };
    Ok(Stretch {
        l2: or_infinite((squares / weight).sqrt()),
        linf: or_infinite(linf),
        median: quantile(0.5),
        p95: quantile(0.95),
        conformal: or_infinite(ratio / weight),
        collapsed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_stretch_of_a_needle_is_exact_however_large_the_other_is() {
        // 1 by 1e-9 in space, sheared far sideways in the texture at the same area: s1 is 1e9, s2 its
        // inverse.
        let mesh = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1e-9, 0.0]], vec![[0, 1, 2]]);
        let SingularValues { s1, s2 } =
            singular_values(&mesh, 0, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1e-9]], 1.0);
        assert!((s1 / 1e9 - 1.0).abs() < 1e-9 && (s2 / 1e-9 - 1.0).abs() < 1e-9, "{s1} {s2}");
    }
}
