//! The weighted squared distances of a point from many planes, as one quadratic form.
//!
//! In: planes. Out: the mean squared distance of a point; the point where it is least: on the line where two
//! planes meet, at the corner where three do.

use crate::numeric::vec3::Vec3;
use std::ops::Add;

/// p . A p + 2 b . p + c.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Quadric {
    /// xx, xy, xz, yy, yz, zz of A.
    a: [f64; 6],
    b: Vec3,
    c: f64,
    /// Sum of the weights.
    weight: f64,
}

impl Quadric {
    /// Of the plane through `at` with this unit normal.
    #[inline]
    pub(crate) fn of_plane(at: Vec3, [x, y, z]: [f64; 3], weight: f64) -> Self {
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
    #[inline]
    pub(crate) fn mean(&self, p: Vec3) -> f64 {
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
    /// Where it is least; where the planes do not decide, `near` does: its squared distance counts `pull`
    /// times what all of the planes do.
    #[inline]
    pub(crate) fn least(&self, near: Vec3, pull: f64) -> Vec3 {
        let pull = pull * self.weight;
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let Vec3([x, y, z]) = near * pull - self.b;
        // Elimination, written out: this is what simplifying a mesh does most.
        let first = xx + pull;
        let (ly, lz) = (xy / first, xz / first);
        let (second, yz) = (yy + pull - ly * xy, yz - ly * xz);
        let l = yz / second;
        let third = zz + pull - lz * xz - l * yz;
        if !(first > 0.0 && second > 0.0 && third > 0.0) {
            return near;
        }
        let y = y - ly * x;
        let z = (z - lz * x - l * y) / third;
        let y = (y - yz * z) / second;
        Vec3([(x - xy * y - xz * z) / first, y, z])
    }
}

impl Add for Quadric {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.a, other.a);
        Self {
            a: [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]],
            b: self.b + other.b,
            c: self.c + other.c,
            weight: self.weight + other.weight,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    fn unit(rng: &mut Rng) -> Vec3 {
        Vec3::from_fn(|_| rng.normal()).normalized()
    }

    /// Planes through `corner`, each given by another of its points.
    fn around(corner: Vec3, normals: &[Vec3], rng: &mut Rng) -> Quadric {
        let on = |&normal: &Vec3| {
            let off = Vec3::from_fn(|_| rng.normal());
            Quadric::of_plane(corner + off - normal * off.dot(normal), normal.0, 1.0)
        };
        normals.iter().map(on).fold(Quadric::default(), Add::add)
    }

    #[test]
    fn three_planes_meet_in_their_corner() {
        let mut rng = Rng::new(1);
        let axes = unit(&mut rng).tangents();
        let normals = [axes.0, axes.1, axes.0.cross(axes.1)];
        let corner = Vec3([0.3, -2.0, 5.0]);
        let planes = around(corner, &normals, &mut rng);
        let place = planes.least(Vec3::ZERO, 1e-14);
        assert!((place - corner).norm() < 1e-12, "{place:?}");
        assert!(planes.mean(place) < 1e-12);
    }

    #[test]
    fn two_planes_meet_on_their_line_nearest_to_the_middle_and_one_plane_under_it() {
        let mut rng = Rng::new(2);
        let (a, b) = unit(&mut rng).tangents();
        let along = a.cross(b);
        let corner = Vec3([0.3, -2.0, 5.0]);
        let middle = corner + a * 0.2 - b * 0.4 + along * 0.7;
        let place = around(corner, &[a, b, a], &mut rng).least(middle, 1e-9);
        assert!((place - (corner + along * 0.7)).norm() < 1e-6, "{place:?}");
        let place = around(corner, &[a, a], &mut rng).least(middle, 1e-9);
        assert!((place - (middle - a * 0.2)).norm() < 1e-6, "{place:?}");
    }

    /// One plane and a pull of a third: the distance from the plane is a quarter of that before.
    #[test]
    fn the_pull_counts_in_shares_of_all_planes() {
        let plane = Quadric::of_plane(Vec3::ZERO, [0.0, 0.0, 1.0], 5.0);
        let place = plane.least(Vec3([1.0, 2.0, 4.0]), 1.0 / 3.0);
        assert!((place - Vec3([1.0, 2.0, 1.0])).norm() < 1e-12, "{place:?}");
    }
}
