//! Vectors in space, f64, with operators: `a + b * s`, `a.dot(b)`.
//!
//! Data that users hand in and take out are plain `[f64; 3]`; a [`Vec3`] is the same three numbers in memory,
//! so [`of`] reads a slice of them as vectors without a copy.

use bytemuck::{TransparentWrapper, allocation::TransparentWrapperAlloc};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Deref, DerefMut, Mul, Neg, Sub, SubAssign};

/// A vector or a point in space. It derefs to its array: `v[0]`, `v.iter()`.
///
/// ```
/// use atlasfit::Vec3;
/// let (a, b) = (Vec3([3.0, 0.0, 4.0]), Vec3::new(0.0, 2.0, 0.0));
/// assert_eq!((a.norm(), a.dot(b), a.cross(b)), (5.0, 0.0, Vec3([-8.0, 0.0, 6.0])));
/// assert_eq!((a + b * 0.5)[1], 1.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default, TransparentWrapper)]
#[repr(transparent)]
pub struct Vec3(pub [f64; 3]);

/// Three unit vectors, or the three vectors of a frame.
pub type Frame = [Vec3; 3];

/// Plain positions as vectors, without a copy.
#[inline]
#[must_use]
pub fn of(positions: &[[f64; 3]]) -> &[Vec3] {
    Vec3::wrap_slice(positions)
}

/// Vectors as plain positions, without a copy.
#[inline]
#[must_use]
pub fn plain_slice(vectors: &[Vec3]) -> &[[f64; 3]] {
    Vec3::peel_slice(vectors)
}

/// Vectors as plain positions, without a copy of the numbers.
#[inline]
#[must_use]
pub fn plain(vectors: Vec<Vec3>) -> Vec<[f64; 3]> {
    Vec3::peel_vec(vectors)
}

impl Vec3 {
    /// The zero vector.
    pub const ZERO: Self = Self([0.0; 3]);

    /// The vector with these coordinates.
    #[inline]
    #[must_use]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self([x, y, z])
    }
    /// The vector whose coordinate `k` is `f(k)`.
    #[inline]
    #[must_use]
    pub fn from_fn(f: impl FnMut(usize) -> f64) -> Self {
        Self(std::array::from_fn(f))
    }
    /// `f` of each coordinate.
    #[inline]
    #[must_use]
    pub fn map(self, f: impl FnMut(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }
    /// The coordinates in single precision.
    #[inline]
    #[must_use]
    pub fn to_f32(self) -> [f32; 3] {
        self.0.map(|x| x as f32)
    }
    /// Inner product.
    #[inline]
    #[must_use]
    pub fn dot(self, b: Self) -> f64 {
        self[0] * b[0] + self[1] * b[1] + self[2] * b[2]
    }
    /// Cross product.
    #[inline]
    #[must_use]
    pub fn cross(self, b: Self) -> Self {
        let a = self;
        Self([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    }
    /// Squared length.
    #[inline]
    #[must_use]
    pub fn norm2(self) -> f64 {
        self.dot(self)
    }
    /// Length.
    #[inline]
    #[must_use]
    pub fn norm(self) -> f64 {
        self.norm2().sqrt()
    }
    /// Squared distance from `b`.
    #[inline]
    #[must_use]
    pub fn dist2(self, b: Self) -> f64 {
        (self - b).norm2()
    }
    /// This vector scaled to length 1; the zero vector stays zero.
    #[inline]
    #[must_use]
    pub fn normalized(self) -> Self {
        let l = self.norm();
        if l > 0.0 { self * (1.0 / l) } else { Self::ZERO }
    }
    /// Two unit vectors that make a right-handed orthonormal frame with this unit vector
    /// (Duff et al. 2017, "Building an orthonormal basis, revisited").
    #[inline]
    #[must_use]
    pub fn tangents(self) -> (Self, Self) {
        let n = self;
        let s = 1.0f64.copysign(n[2]);
        let a = -1.0 / (s + n[2]);
        let b = n[0] * n[1] * a;
        (Self([1.0 + s * n[0] * n[0] * a, s * b, -s * n[0]]), Self([b, s + n[1] * n[1] * a, -n[1]]))
    }
}

impl Deref for Vec3 {
    type Target = [f64; 3];
    #[inline]
    fn deref(&self) -> &[f64; 3] {
        &self.0
    }
}

impl DerefMut for Vec3 {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64; 3] {
        &mut self.0
    }
}

impl From<[f64; 3]> for Vec3 {
    #[inline]
    fn from(a: [f64; 3]) -> Self {
        Self(a)
    }
}

impl From<Vec3> for [f64; 3] {
    #[inline]
    fn from(v: Vec3) -> Self {
        v.0
    }
}

impl Add for Vec3 {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        Self([self[0] + b[0], self[1] + b[1], self[2] + b[2]])
    }
}

impl Sub for Vec3 {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        Self([self[0] - b[0], self[1] - b[1], self[2] - b[2]])
    }
}

impl Mul<f64> for Vec3 {
    type Output = Self;
    #[inline]
    fn mul(self, s: f64) -> Self {
        Self([self[0] * s, self[1] * s, self[2] * s])
    }
}

impl Neg for Vec3 {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self([-self[0], -self[1], -self[2]])
    }
}

impl AddAssign for Vec3 {
    #[inline]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl SubAssign for Vec3 {
    #[inline]
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}

impl Sum for Vec3 {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::ZERO, |a, b| a + b)
    }
}
