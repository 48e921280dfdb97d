//! Small vector arithmetic on plain arrays, f64: the few operations that every stage shares.

/// A vector or point in space.
pub type Vec3 = [f64; 3];

/// a + b.
#[inline]
#[must_use]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
/// a - b.
#[inline]
#[must_use]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
/// a * s.
#[inline]
#[must_use]
pub fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}
/// a + b * s.
#[inline]
#[must_use]
pub fn mul_add(a: Vec3, b: Vec3, s: f64) -> Vec3 {
    [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s]
}
/// Inner product.
#[inline]
#[must_use]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
/// Cross product.
#[inline]
#[must_use]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
/// Squared length.
#[inline]
#[must_use]
pub fn norm2(a: Vec3) -> f64 {
    dot(a, a)
}
/// Length.
#[inline]
#[must_use]
pub fn norm(a: Vec3) -> f64 {
    norm2(a).sqrt()
}
/// Squared distance.
#[inline]
#[must_use]
pub fn dist2(a: Vec3, b: Vec3) -> f64 {
    norm2(sub(a, b))
}
/// a scaled to length 1; the zero vector stays zero.
#[inline]
#[must_use]
pub fn normalize(a: Vec3) -> Vec3 {
    let l = norm(a);
    if l > 0.0 { scale(a, 1.0 / l) } else { [0.0; 3] }
}
/// Two unit vectors that make a right-handed orthonormal frame with the unit vector `n`
/// (Duff et al. 2017, "Building an orthonormal basis, revisited").
#[inline]
#[must_use]
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let s = 1.0f64.copysign(n[2]);
    let a = -1.0 / (s + n[2]);
    let b = n[0] * n[1] * a;
    ([1.0 + s * n[0] * n[0] * a, s * b, -s * n[0]], [b, s + n[1] * n[1] * a, -n[1]])
}
