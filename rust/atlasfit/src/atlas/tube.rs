//! A thin tube as a chart: an axis and a radius about it.
//!
//! The paper's contour prior (section 3) fits curves to shapes like these; here the curve carries the surface
//! about it. The axis is a cubic in its arc, the radius a cubic spline along it times a few harmonics around
//! it.

use super::{Foot, View};
use crate::numeric::spline::{SIDE, Slope, locate, spline, spline_d1};
use crate::numeric::vec3::Vec3;

/// Harmonics of the radius: the constant, and cosine and sine up to order 4. A square rod keeps its corners
/// to a thirtieth of its width.
pub const HARMONICS: usize = 9;
/// Nodes of the mask along the axis.
pub const MASK_NODES: usize = 65;
/// Beyond this domain coordinate a tube says nothing.
const OUTSIDE: f64 = 1.1;
/// The radius never falls below this share of the mean radius.
const NARROWEST: f64 = 0.2;

/// A tube.
#[derive(Debug, Clone, PartialEq)]
pub struct Tube {
    /// Origin of the axis's frame.
    pub center: Vec3,
    /// Orthonormal axes, the first along the tube.
    pub axes: [Vec3; 3],
    /// The domain reaches this far along the first axis, both ways.
    pub half_length: f64,
    /// Offsets of the axis along the second and third axes: cubics in the domain coordinate.
    pub axis: [[f64; 4]; 2],
    /// Mean radius.
    pub mean_radius: f64,
    /// Spline coefficients along the axis of each harmonic of the radius, less the mean radius.
    pub radius: Box<[[f32; HARMONICS]; SIDE]>,
    /// Where along the axis there is surface, 0 to 255.
    pub mask: Box<[u8; MASK_NODES]>,
}

/// A point in the tube's own coordinates.
#[derive(Debug, Clone, Copy)]
pub struct TubeCoordinates {
    /// Domain coordinate of the axis's nearest point.
    pub s: f64,
    /// Angle about the axis.
    pub theta: f64,
    /// Distance from the axis.
    pub d: f64,
    /// The axis's point.
    foot: Vec3,
    /// Unit vectors: along the axis, away from it, around it.
    along: Vec3,
    out: Vec3,
    around: Vec3,
    /// Change of `s` for a unit step along the axis at this distance.
    pace: f64,
}

/// The foot of a point on the axis. Vectors are in the axis's frame.
#[derive(Debug, Clone, Copy)]
pub struct AxisFoot {
    /// Domain coordinate.
    pub s: f64,
    /// Distance of the point.
    pub d: f64,
    /// The axis there, its derivatives, and what leads across it to the point.
    foot: Vec3,
    derivatives: [Vec3; 2],
    across: Vec3,
}

/// A point of a curve with its first and second derivative.
#[derive(Debug, Clone, Copy)]
pub struct CurvePoint {
    /// The point.
    pub position: Vec3,
    /// The first derivative.
    pub first: Vec3,
    /// The second derivative.
    pub second: Vec3,
}

/// How a place lies to the tube's surface.
struct Level {
    /// Signed distance along the normal.
    distance: f64,
    /// Unit normal.
    normal: Vec3,
    /// Radius there.
    radius: f64,
}

/// cos and sin of multiples of `theta`: the harmonics at an angle.
#[must_use]
pub fn harmonics(theta: f64) -> [f64; HARMONICS] {
    let (s1, c1) = theta.sin_cos();
    let mut h = [1.0; HARMONICS];
    let (mut c, mut s) = (1.0, 0.0);
    for m in 0..HARMONICS / 2 {
        (c, s) = (c * c1 - s * s1, s * c1 + c * s1);
        h[2 * m + 1] = c;
        h[2 * m + 2] = s;
    }
    h
}

/// A cubic's value, first and second derivative.
fn cubic(q: &[f64; 4], s: f64) -> [f64; 3] {
    [
        q[0] + s * (q[1] + s * (q[2] + s * q[3])),
        q[1] + s * (2.0 * q[2] + s * 3.0 * q[3]),
        2.0 * q[2] + 6.0 * q[3] * s,
    ]
}

impl Tube {
    /// The axis at `s` in its own frame: position, first and second derivative.
    fn curve_at(&self, s: f64) -> CurvePoint {
        let ([y, y1, y2], [z, z1, z2]) = (cubic(&self.axis[0], s), cubic(&self.axis[1], s));
        CurvePoint {
            position: Vec3([s * self.half_length, y, z]),
            first: Vec3([self.half_length, y1, z1]),
            second: Vec3([0.0, y2, z2]),
        }
    }
    /// A vector of the axis's frame in the atlas's.
    fn turned(&self, v: Vec3) -> Vec3 {
        let [a, b, c] = self.axes;
        a * v[0] + (b * v[1] + c * v[2])
    }
    /// The axis at `s`: position, first and second derivative.
    #[must_use]
    pub fn axis_at(&self, s: f64) -> CurvePoint {
        let CurvePoint { position, first, second } = self.curve_at(s);
        CurvePoint {
            position: self.center + self.turned(position),
            first: self.turned(first),
            second: self.turned(second),
        }
    }
    /// The axis's nearest point to `p`.
    #[must_use]
    pub fn foot(&self, p: Vec3) -> AxisFoot {
        let d = p - self.center;
        let p = Vec3(self.axes.map(|a| d.dot(a)));
        let mut s = p[0] / self.half_length;
        // The axis is nearly straight over the domain: Newton from the straight line's foot settles at once.
        for _ in 0..3 {
            let at = s.clamp(-1.5, 1.5);
            let CurvePoint { position: c, first: c1, second: c2 } = self.curve_at(at);
            let w = p - c;
            let speed2 = c1.dot(c1);
            s = at + w.dot(c1) / (speed2 - w.dot(c2)).max(0.3 * speed2);
        }
        let s = s.clamp(-1.5, 1.5);
        let CurvePoint { position: foot, first: c1, second: c2 } = self.curve_at(s);
        let w = p - foot;
        let across = w - (c1 * (w.dot(c1) / c1.dot(c1)));
        AxisFoot { s, d: across.norm(), foot, derivatives: [c1, c2], across }
    }
    /// The tube's coordinates of `p`.
    #[must_use]
    pub fn local(&self, p: Vec3) -> TubeCoordinates {
        let AxisFoot { s, d, foot, derivatives: [c1, c2], across } = self.foot(p);
        let speed2 = c1.dot(c1);
        let pace = speed2.sqrt() / (speed2 - across.dot(c2)).max(0.3 * speed2);
        let (foot, across) = (self.center + self.turned(foot), self.turned(across));
        let [along, e2, e3] = self.section(self.turned(c1));
        let (y, z) = (across.dot(e2), across.dot(e3));
        let out = if d > 0.0 { across * (1.0 / d) } else { e2 };
        TubeCoordinates { s, theta: z.atan2(y), d, foot, along, out, around: along.cross(out), pace }
    }
    /// Unit vectors along an axis with derivative `c1`, and the two across from which the angle counts.
    fn section(&self, c1: Vec3) -> [Vec3; 3] {
        let along = c1.normalized();
        let e2 = (self.axes[1] - (along * self.axes[1].dot(along))).normalized();
        [along, e2, along.cross(e2)]
    }
    /// The tube's point at domain coordinates: along the axis, and the angle over pi.
    #[must_use]
    pub fn at(&self, uv: [f64; 2]) -> Foot {
        let (s, theta) = (uv[0], uv[1] * std::f64::consts::PI);
        let CurvePoint { position: foot, first: c1, second: c2 } = self.axis_at(s);
        let [along, e2, e3] = self.section(c1);
        let out = e2 * theta.cos() + e3 * theta.sin();
        let d = self.radius_at(s, theta).value;
        let speed2 = c1.dot(c1);
        let pace = speed2.sqrt() / (speed2 - d * out.dot(c2)).max(0.3 * speed2);
        let l = TubeCoordinates { s, theta, d, foot, along, out, around: along.cross(out), pace };
        let Level { normal, radius: r, .. } = self.level(&l);
        Foot { position: foot + out * r, normal, weight: Self::weight_at(s), uv }
    }
    /// Radius and its derivatives with respect to `s` and the angle.
    #[must_use]
    pub fn radius_at(&self, s: f64, theta: f64) -> Slope {
        let (i, t) = locate(s);
        let (b, b1) = (spline(t), spline_d1(t));
        let h = harmonics(theta);
        let (mut r, mut rs, mut rt) = (self.mean_radius, 0.0, 0.0);
        for k in 0..4 {
            let row = &self.radius[i + k];
            let mut along = f64::from(row[0]);
            let mut turn = 0.0;
            for m in 1..=HARMONICS / 2 {
                let (c, s) = (f64::from(row[2 * m - 1]), f64::from(row[2 * m]));
                along += c * h[2 * m - 1] + s * h[2 * m];
                turn += m as f64 * (s * h[2 * m - 1] - c * h[2 * m]);
            }
            r += b[k] * along;
            rs += b1[k] * along;
            rt += b[k] * turn;
        }
        if r < NARROWEST * self.mean_radius {
            return Slope { value: NARROWEST * self.mean_radius, du: 0.0, dv: 0.0 };
        }
        Slope { value: r, du: rs * (SIDE - 3) as f64 * 0.5, dv: rt }
    }
    /// Distance along the normal and the unit normal at a point with local coordinates `l`.
    fn level(&self, l: &TubeCoordinates) -> Level {
        let Slope { value: r, du: rs, dv: rt } = self.radius_at(l.s, l.theta);
        // Near the axis the angle means nothing.
        let turn = rt / l.d.max(0.3 * r);
        let g = l.out - (l.along * (rs * l.pace) + l.around * turn);
        let n = g.norm();
        Level { distance: (l.d - r) / n, normal: g * (1.0 / n), radius: r }
    }
    /// The tube seen from `p`; nothing beyond its domain.
    #[must_use]
    pub fn view(&self, p: Vec3) -> Option<View> {
        let l = self.local(p);
        if l.s.abs() >= OUTSIDE || l.d > 4.0 * self.mean_radius + 0.3 * self.half_length {
            return None;
        }
        let Level { distance, normal, radius } = self.level(&l);
        Some(View { distance, mask: self.mask_at(l.s), weight: Self::weight_at(l.s), normal, radius })
    }
    /// The tube's point out from the axis through `p`.
    #[must_use]
    pub fn nearest(&self, p: Vec3) -> Foot {
        let l = self.local(p);
        let Level { normal, radius: r, .. } = self.level(&l);
        Foot {
            position: (l.foot + l.out * r),
            normal,
            weight: Self::weight_at(l.s),
            uv: [l.s, l.theta / std::f64::consts::PI],
        }
    }
    /// Weight in the blend at `p`.
    #[must_use]
    pub fn weight(&self, p: Vec3) -> f64 {
        Self::weight_at(self.local(p).s)
    }
    /// Unit normal over `p`.
    #[must_use]
    pub fn normal_over(&self, p: Vec3) -> Vec3 {
        self.level(&self.local(p)).normal
    }
    fn weight_at(s: f64) -> f64 {
        let t = 1.0 - s * s;
        if t > 0.0 { t * t } else { 0.0 }
    }
    /// The mask at `s`, linear between nodes, in [0, 1].
    #[must_use]
    pub fn mask_at(&self, s: f64) -> f64 {
        const CELLS: f64 = (MASK_NODES - 1) as f64;
        let x = ((s + 1.0) * 0.5 * CELLS).clamp(0.0, CELLS - 1e-9);
        let (i, t) = (x as usize, x.fract());
        ((1.0 - t) * f64::from(self.mask[i]) + t * f64::from(self.mask[i + 1])) / 255.0
    }
}
