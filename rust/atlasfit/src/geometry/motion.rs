//! Rigid motions: a turn about the origin, then a shift.

use crate::numeric::vec3::Vec3;

/// A rigid motion: where it moves x is rotation x + shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Rotation matrix, row after row.
    pub rotation: [[f64; 3]; 3],
    /// Where the origin goes.
    pub shift: Vec3,
}

impl Motion {
    /// Moves nothing.
    pub const NONE: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], shift: Vec3::ZERO };

    /// The turn about the axis of `turn` through the origin, by its length in radians (Rodrigues), then the
    /// shift.
    ///
    /// ```
    /// use atlasfit::{Vec3, geometry::Motion};
    /// let quarter = Motion::new(Vec3([0.0, 0.0, std::f64::consts::FRAC_PI_2]), Vec3([0.0, 0.0, 5.0]));
    /// assert!(quarter.of(Vec3([1.0, 0.0, 0.0])).dist2(Vec3([0.0, 1.0, 5.0])) < 1e-24);
    /// ```
    #[must_use]
    pub fn new(turn: Vec3, shift: Vec3) -> Self {
        let angle = turn.norm();
        let axis = turn.normalized();
        let (sin, cos) = angle.sin_cos();
        let across = [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]];
        let mut rotation = Self::NONE.rotation;
        if angle > 0.0 {
            for (i, row) in rotation.iter_mut().enumerate() {
                for (j, x) in row.iter_mut().enumerate() {
                    *x = *x * cos + sin * across[i][j] + (1.0 - cos) * axis[i] * axis[j];
                }
            }
        }
        Self { rotation, shift }
    }

    /// Where it moves a place.
    #[must_use]
    pub fn of(&self, p: Vec3) -> Vec3 {
        self.turned(p) + self.shift
    }

    /// How it turns a direction.
    #[must_use]
    pub fn turned(&self, d: Vec3) -> Vec3 {
        Vec3(self.rotation.map(|row| Vec3(row).dot(d)))
    }

    /// From where it moves to a place.
    #[must_use]
    pub fn back(&self, p: Vec3) -> Vec3 {
        self.turned_back(p - self.shift)
    }

    /// What it turns to a direction.
    #[must_use]
    pub fn turned_back(&self, d: Vec3) -> Vec3 {
        Vec3::from_fn(|j| (0..3).map(|i| self.rotation[i][j] * d[i]).sum())
    }

    /// This motion, then another.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let column = |j: usize| next.turned(Vec3(self.rotation.map(|row| row[j])));
        let columns = [column(0), column(1), column(2)];
        Self {
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i])),
            shift: next.of(self.shift),
        }
    }

    /// The angle of its turn in radians, 0 to pi.
    #[must_use]
    pub fn angle(&self) -> f64 {
        // The sine is exact for small angles, where the cosine is not.
        let turn = self.turn_sine();
        let cos = 0.5 * (self.rotation[0][0] + self.rotation[1][1] + self.rotation[2][2] - 1.0);
        turn.norm().atan2(cos)
    }

    /// The axis of its turn, as long as the sine of its angle.
    #[must_use]
    pub fn turn_sine(&self) -> Vec3 {
        let r = &self.rotation;
        Vec3([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]) * 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::Motion;
    use crate::numeric::vec3::Vec3;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        [-2.0..2.0f64, -2.0..2.0, -2.0..2.0].prop_map(Vec3)
    }

    proptest! {
        #[test]
        fn motions_keep_distances_go_back_and_follow_each_other(
            turn in vector(), shift in vector(), other in vector(), p in vector(), q in vector(),
        ) {
            let (a, b) = (Motion::new(turn, shift), Motion::new(other, turn));
            prop_assert!((a.of(p).dist2(a.of(q)) - p.dist2(q)).abs() < 1e-12);
            prop_assert!(a.back(a.of(p)).dist2(p) < 1e-24);
            prop_assert!(a.then(&b).of(p).dist2(b.of(a.of(p))) < 1e-24);
            let angle = turn.norm().min(std::f64::consts::TAU - turn.norm());
            prop_assert!((a.angle() - angle).abs() < 1e-9, "{} {angle}", a.angle());
        }
    }
}
