//! A sheet of surface as a height over a plane.
//!
//! A base plane (centre and orthonormal axes), an elliptic domain in it, and a height over the unit disk held
//! as a cubic spline.

use crate::numeric::spline::{self, COEFFS, Hessian, Slope};
use crate::numeric::vec3::Vec3;

use super::mask::Mask;
use super::{Foot, View};

/// A Monge patch.
#[derive(Debug, Clone, PartialEq)]
pub struct Monge {
    /// Centre of the domain.
    pub center: Vec3,
    /// Orthonormal axes: two of the base plane and its normal, right-handed.
    pub axes: [Vec3; 3],
    /// Half axes of the elliptic domain along the first two axes.
    pub radii: [f64; 2],
    /// Spline coefficients of the height over the unit disk.
    pub coeffs: Box<[f32; COEFFS]>,
    /// Which part of the domain carries surface.
    pub mask: Mask,
}

/// Squared domain coordinate beyond which a patch says nothing.
const OUTSIDE: f64 = 1.3;

/// The surface over a place of the domain.
#[derive(Debug, Clone, Copy)]
pub struct HeightNormal {
    /// Height over the base plane.
    pub height: f64,
    /// Cosine between the surface normal and the base normal.
    pub cos: f64,
    /// Unit normal.
    pub normal: Vec3,
}

/// A point seen from a patch.
#[derive(Debug, Clone, Copy)]
pub struct BaseCoordinates {
    /// Coordinates in the domain, the ellipse mapped to the unit disk.
    pub u: f64,
    /// Second coordinate.
    pub v: f64,
    /// Height over the base plane.
    pub z: f64,
}

impl Monge {
    /// The chart's coordinates of `p`.
    #[inline]
    #[must_use]
    pub fn local(&self, p: Vec3) -> BaseCoordinates {
        let d = p - self.center;
        BaseCoordinates {
            u: d.dot(self.axes[0]) / self.radii[0],
            v: d.dot(self.axes[1]) / self.radii[1],
            z: d.dot(self.axes[2]),
        }
    }
    /// The point of space over (u, v) at height z.
    #[inline]
    #[must_use]
    pub fn lift(&self, u: f64, v: f64, z: f64) -> Vec3 {
        let p = self.center + self.axes[0] * (u * self.radii[0]);
        p + self.axes[1] * (v * self.radii[1]) + self.axes[2] * z
    }
    /// The chart's map at (u, v).
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> Vec3 {
        self.lift(u, v, spline::value(&self.coeffs, u, v))
    }
    /// Unit normal for height slopes `hu`, `hv` with respect to domain coordinates; on the side of the third
    /// axis.
    #[inline]
    #[must_use]
    pub fn normal_of(&self, hu: f64, hv: f64) -> Vec3 {
        let (a, b) = (hu / self.radii[0], hv / self.radii[1]);
        let n = self.axes[2] + (self.axes[0] * -a + self.axes[1] * -b);
        n.normalized()
    }
    /// Height, cosine between the surface normal and the base normal, and the unit normal at (u, v).
    #[inline]
    #[must_use]
    pub fn height_normal(&self, u: f64, v: f64) -> HeightNormal {
        let Slope { value: h, du: hu, dv: hv } = spline::value_gradient(&self.coeffs, u, v);
        let (a, b) = (hu / self.radii[0], hv / self.radii[1]);
        let c = 1.0 / (1.0 + a * a + b * b).sqrt();
        let n = self.axes[2] + (self.axes[0] * -a + self.axes[1] * -b);
        HeightNormal { height: h, cos: c, normal: n * c }
    }
    /// Foot point: the domain coordinates whose surface point is nearest to `p` (Gauss-Newton from the
    /// point's own coordinates; two steps reach well below the noise on patches as flat as these).
    #[must_use]
    pub fn foot(&self, p: BaseCoordinates) -> (f64, f64) {
        let (mut u, mut v) = (p.u, p.v);
        for _ in 0..2 {
            let Slope { value: h, du: hu, dv: hv } = spline::value_gradient(&self.coeffs, u, v);
            let (a, b) = (hu / self.radii[0], hv / self.radii[1]);
            // Residuals along the base axes and along the normal; metric I + grad gradᵀ, inverted in closed
            // form.
            let (du, dv, dz) = ((p.u - u) * self.radii[0], (p.v - v) * self.radii[1], p.z - h);
            let (ru, rv) = (du + a * dz, dv + b * dz);
            let det = 1.0 + a * a + b * b;
            let (x, y) = (((1.0 + b * b) * ru - a * b * rv) / det, ((1.0 + a * a) * rv - a * b * ru) / det);
            u += x / self.radii[0];
            v += y / self.radii[1];
            let rho = (u * u + v * v).sqrt();
            if rho > 1.2 {
                u *= 1.2 / rho;
                v *= 1.2 / rho;
            }
        }
        (u, v)
    }
    /// Partition-of-unity weight of this chart at (u, v), before it is normed: 1 at the centre, falling
    /// smoothly to 0 at the rim.
    #[inline]
    #[must_use]
    pub fn weight_at(u: f64, v: f64) -> f64 {
        let t = 1.0 - (u * u + v * v);
        if t > 0.0 { t * t } else { 0.0 }
    }
    /// Sum of the principal curvatures at (u, v), positive where the surface bends towards the third axis.
    #[must_use]
    pub fn curvature_sum(&self, u: f64, v: f64) -> f64 {
        let Slope { du: hu, dv: hv, .. } = spline::value_gradient(&self.coeffs, u, v);
        let Hessian { uu, uv, vv } = spline::hessian(&self.coeffs, u, v);
        let (ru, rv) = (self.radii[0], self.radii[1]);
        let (a, b) = (hu / ru, hv / rv);
        let (xx, xy, yy) = (uu / (ru * ru), uv / (ru * rv), vv / (rv * rv));
        let g = 1.0 + a * a + b * b;
        ((1.0 + b * b) * xx - 2.0 * a * b * xy + (1.0 + a * a) * yy) / (g * g.sqrt())
    }
    /// The patch seen from `p`; nothing beyond its domain.
    #[inline]
    #[must_use]
    pub fn view(&self, p: Vec3) -> Option<View> {
        let l = self.local(p);
        if l.u * l.u + l.v * l.v >= OUTSIDE {
            return None;
        }
        let HeightNormal { height, cos: c, normal } = self.height_normal(l.u, l.v);
        Some(View {
            distance: (l.z - height) * c,
            mask: self.mask.value(l.u, l.v),
            weight: Self::weight_at(l.u, l.v),
            normal,
            radius: f64::INFINITY,
        })
    }
    /// The patch's point nearest to `p`.
    #[must_use]
    pub fn nearest(&self, p: Vec3) -> Foot {
        let (u, v) = self.foot(self.local(p));
        self.at([u, v])
    }
    /// The patch's point at (u, v).
    #[must_use]
    pub fn at(&self, uv: [f64; 2]) -> Foot {
        let [u, v] = uv;
        let Slope { value: h, du: hu, dv: hv } = spline::value_gradient(&self.coeffs, u, v);
        Foot {
            position: self.lift(u, v, h),
            normal: self.normal_of(hu, hv),
            weight: Self::weight_at(u, v),
            uv,
        }
    }
    /// Weight in the blend at `p`, without looking for the nearest point.
    #[must_use]
    pub fn weight(&self, p: Vec3) -> f64 {
        let l = self.local(p);
        Self::weight_at(l.u, l.v)
    }
    /// Unit normal over `p`.
    #[must_use]
    pub fn normal_over(&self, p: Vec3) -> Vec3 {
        let l = self.local(p);
        let Slope { du: hu, dv: hv, .. } = spline::value_gradient(&self.coeffs, l.u, l.v);
        self.normal_of(hu, hv)
    }
    /// Right-handed axes with the unit `normal` third and the first along `along`, as far as that lies in the
    /// plane.
    #[must_use]
    pub fn frame(normal: Vec3, along: Vec3) -> [Vec3; 3] {
        let e1 = along - (normal * along.dot(normal));
        let e1 = if e1.norm() > 1e-9 { e1.normalized() } else { normal.tangents().0 };
        [e1, normal.cross(e1), normal]
    }
}
