//! The weighted squared distances of a point from many planes, as one quadratic form.
//!
//! In: planes. Out: the mean squared distance of a point; the point where it is least.

use super::constants::SIMPLIFY;
use crate::numeric::dense::{cholesky, cholesky_solve};
use crate::numeric::vec3::Vec3;
use std::ops::Add;

/// p . A p + 2 b . p + c.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    /// xx, xy, xz, yy, yz, zz of A.
    a: [f64; 6],
    b: Vec3,
    c: f64,
    /// Sum of the weights.
    weight: f64,
}

impl Quadric {
    /// Of the plane through `at` with this unit normal.
    pub(super) fn of_plane(at: Vec3, [x, y, z]: [f64; 3], weight: f64) -> Self {
        let normal = Vec3([x, y, z]);
        let d = -normal.dot(at);
        Self {
            a: [x * x, x * y, x * z, y * y, y * z, z * z].map(|v| weight * v),
            b: normal * (weight * d),
            c: weight * d * d,
            weight,
        }
    }
    /// The mean squared distance of a point.
    pub(super) fn mean(&self, p: Vec3) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let [x, y, z] = p.0;
        let square = xx * x * x
            + yy * y * y
            + zz * z * z
            + 2.0 * (xy * x * y + xz * x * z + yz * y * z)
            + 2.0 * self.b.dot(p)
            + self.c;
        square.max(0.0) / self.weight.max(f64::MIN_POSITIVE)
    }
    /// Where it is least; `near` decides where the planes do not.
    pub(super) fn least(&self, near: Vec3) -> Vec3 {
        let pull = SIMPLIFY.middle * self.weight;
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let mut a = [xx + pull, xy, xz, 0.0, yy + pull, yz, 0.0, 0.0, zz + pull];
        let mut p = (near * pull - self.b).0;
        if !cholesky(&mut a, 3) {
            return near;
        }
        cholesky_solve(&a, 3, &mut p);
        Vec3(p)
    }
}

impl Add for Quadric {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            a: std::array::from_fn(|k| self.a[k] + other.a[k]),
            b: self.b + other.b,
            c: self.c + other.c,
            weight: self.weight + other.weight,
        }
    }
}
