//! Triangles of the plane.

/// Twice the signed area of a planar triangle.
#[inline]
pub(crate) fn twice_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The corners of a triangle.
#[inline]
pub(crate) fn corners(tri: [u32; 3], uv: &[[f64; 2]]) -> [[f64; 2]; 3] {
    // Written out: `map` is not always inlined.
    [uv[tri[0] as usize], uv[tri[1] as usize], uv[tri[2] as usize]]
}
