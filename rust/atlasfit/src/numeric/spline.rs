//! Uniform cubic B-splines on [-1, 1] and their tensor products on the square.
//!
//! In: coefficients, a place of the domain. Out: value, gradient, second derivatives. All charts use the same
//! number of intervals.

/// Spline intervals across the chart's domain [-1, 1]. Eight intervals resolve a quarter of the chart's
/// radius, about the point spacing when a chart holds a hundred points.
pub const INTERVALS: usize = 8;
/// Cubic B-spline coefficients along one axis.
pub const SIDE: usize = INTERVALS + 3;
/// Coefficients of one chart.
pub const COEFFS: usize = SIDE * SIDE;
/// Values (or derivatives) of the four cubic B-splines that live on one interval, at t in [0, 1].
#[inline]
pub(crate) fn spline(t: f64) -> [f64; 4] {
    const SIXTH: f64 = 1.0 / 6.0;
    let s = 1.0 - t;
    let (s2, t2) = (s * s, t * t);
    let inner = |x: f64, x2: f64| 4.0 * SIXTH - x2 * (1.0 - 0.5 * x);
    [SIXTH * s2 * s, inner(t, t2), inner(s, s2), SIXTH * t2 * t]
}
#[inline]
pub(crate) fn spline_d1(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-0.5 * s * s, t * (1.5 * t - 2.0), s * (2.0 - 1.5 * s), 0.5 * t * t]
}
#[inline]
pub(crate) fn spline_d2(t: f64) -> [f64; 4] {
    [1.0 - t, 3.0 * t - 2.0, 1.0 - 3.0 * t, t]
}
/// Interval and offset of coordinate `x` in [-1, 1]; clamped outside.
#[inline]
pub(crate) fn locate(x: f64) -> (usize, f64) {
    let g = ((x + 1.0) * (INTERVALS as f64 * 0.5)).clamp(0.0, INTERVALS as f64 * (1.0 - 1e-12));
    let i = g as usize;
    (i, g - i as f64)
}

/// A value and its first derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The value.
    pub value: f64,
    /// Its derivative along u.
    pub du: f64,
    /// Its derivative along v.
    pub dv: f64,
}

/// Second derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hessian {
    /// Along u twice.
    pub uu: f64,
    /// Along u and v.
    pub uv: f64,
    /// Along v twice.
    pub vv: f64,
}

/// Height at (u, v) in the domain [-1, 1]^2.
///
/// ```
/// use atlasfit::numeric::spline::{COEFFS, value};
/// assert!((value(&[2.0; COEFFS], 0.3, -0.9) - 2.0).abs() < 1e-12);
/// ```
#[inline]
#[must_use]
pub fn value(coeffs: &[f32; COEFFS], u: f64, v: f64) -> f64 {
    let ((i, s), (j, t)) = (locate(u), locate(v));
    let (a, b) = (spline(s), spline(t));
    let mut sum = 0.0;
    for (k, ak) in a.iter().enumerate() {
        let row = &coeffs[(i + k) * SIDE + j..(i + k) * SIDE + j + 4];
        sum += ak
            * (b[0] * f64::from(row[0])
                + b[1] * f64::from(row[1])
                + b[2] * f64::from(row[2])
                + b[3] * f64::from(row[3]));
    }
    sum
}

/// Height and its two derivatives at (u, v) in the domain [-1, 1]^2.
///
/// ```
/// use atlasfit::numeric::spline::{COEFFS, value_gradient};
/// let slope = value_gradient(&[2.0; COEFFS], 0.3, -0.9);
/// assert!(slope.du.abs() < 1e-12 && slope.dv.abs() < 1e-12);
/// ```
#[inline]
#[must_use]
pub fn value_gradient(coeffs: &[f32; COEFFS], u: f64, v: f64) -> Slope {
    let ((i, s), (j, t)) = (locate(u), locate(v));
    let (a, b, da, db) = (spline(s), spline(t), spline_d1(s), spline_d1(t));
    // Four sums side by side, which the compiler keeps in vectors.
    let (mut along, mut slope) = ([0.0; 4], [0.0; 4]);
    for k in 0..4 {
        let row = &coeffs[(i + k) * SIDE + j..(i + k) * SIDE + j + 4];
        for l in 0..4 {
            let c = f64::from(row[l]);
            along[l] += a[k] * c;
            slope[l] += da[k] * c;
        }
    }
    let dot = |x: &[f64; 4], y: &[f64; 4]| (x[0] * y[0] + x[1] * y[1]) + (x[2] * y[2] + x[3] * y[3]);
    let scale = INTERVALS as f64 * 0.5;
    Slope { value: dot(&b, &along), du: dot(&b, &slope) * scale, dv: dot(&db, &along) * scale }
}

/// Second derivatives (uu, uv, vv) of the height at (u, v) in the domain.
///
/// ```
/// use atlasfit::numeric::spline::{COEFFS, hessian};
/// let second = hessian(&[2.0; COEFFS], 0.3, -0.9);
/// assert!(second.uu.abs() + second.uv.abs() + second.vv.abs() < 1e-9);
/// ```
#[must_use]
pub fn hessian(coeffs: &[f32; COEFFS], u: f64, v: f64) -> Hessian {
    let ((i, s), (j, t)) = (locate(u), locate(v));
    let (a, b, da, db) = (spline(s), spline(t), spline_d1(s), spline_d1(t));
    let (dda, ddb) = (spline_d2(s), spline_d2(t));
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    for k in 0..4 {
        for l in 0..4 {
            let c = f64::from(coeffs[(i + k) * SIDE + j + l]);
            uu += dda[k] * b[l] * c;
            uv += da[k] * db[l] * c;
            vv += a[k] * ddb[l] * c;
        }
    }
    let scale = (INTERVALS as f64 * 0.5).powi(2);
    Hessian { uu: uu * scale, uv: uv * scale, vv: vv * scale }
}

/// Gauss-Legendre nodes and weights on [0, 1], 4 points: exact for products of cubics.
pub(crate) const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_727),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273),
    (0.930_568_155_797_026_3, 0.173_927_422_568_727),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use proptest::prelude::*;

    fn random_coeffs(seed: u64) -> [f32; COEFFS] {
        let mut rng = Rng::new(seed);
        std::array::from_fn(|_| rng.normal() as f32)
    }

    /// Spline coefficients of c + a u + b v: splines reproduce affine functions when each coefficient is the
    /// function at its node.
    fn affine(c: f64, a: f64, b: f64) -> [f32; COEFFS] {
        let node = |k: usize| (k as f64 - 1.0) * 2.0 / INTERVALS as f64 - 1.0;
        std::array::from_fn(|i| (c + a * node(i / SIDE) + b * node(i % SIDE)) as f32)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn gradient_and_hessian_are_the_derivatives(
            seed in any::<u64>(),
            u in -0.99..0.99f64,
            v in -0.99..0.99f64,
        ) {
            let c = random_coeffs(seed);
            let e = 1e-5;
            let Slope { value: h, du: hu, dv: hv } = value_gradient(&c, u, v);
            prop_assert!((h - value(&c, u, v)).abs() < 1e-12);
            let d = |f: &dyn Fn(f64) -> f64| (f(e) - f(-e)) / (2.0 * e);
            // Of values of size 10 to 100: third derivatives jump from one interval to the next.
            let tolerance = 2e-4;
            prop_assert!((hu - d(&|t| value(&c, u + t, v))).abs() < tolerance);
            prop_assert!((hv - d(&|t| value(&c, u, v + t))).abs() < tolerance);
            let Hessian { uu, uv, vv } = hessian(&c, u, v);
            let tolerance = 2e-2;
            prop_assert!((uu - d(&|t| value_gradient(&c, u + t, v).du)).abs() < tolerance);
            prop_assert!((uv - d(&|t| value_gradient(&c, u + t, v).dv)).abs() < tolerance);
            prop_assert!((uv - d(&|t| value_gradient(&c, u, v + t).du)).abs() < tolerance);
            prop_assert!((vv - d(&|t| value_gradient(&c, u, v + t).dv)).abs() < tolerance);
        }
    }

    #[test]
    fn affine_splines_are_affine() {
        let c = affine(1.0, 0.5, -0.25);
        for (u, v) in [(0.0, 0.0), (0.9, -0.3), (-1.0, 1.0), (0.333, 0.777)] {
            let Slope { value: h, du: hu, dv: hv } = value_gradient(&c, u, v);
            assert!(
                (h - (1.0 + 0.5 * u - 0.25 * v)).abs() < 1e-6
                    && (hu - 0.5).abs() < 1e-5
                    && (hv + 0.25).abs() < 1e-5
            );
        }
    }
}
