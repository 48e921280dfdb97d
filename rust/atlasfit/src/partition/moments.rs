//! The quadric through the points of a patch: one weighted least squares fit, its sums gathered with vector
//! instructions (chosen at run time by pulp).
//!
//! In: points in the patch's frame, the quadric before. Out: the quadric, and how well its bends are known.

use super::constants::PARTITION;
use crate::numeric::dense::{LANES, cholesky, cholesky_solve};
use pulp::{Arch, Scalar, Simd, WithSimd};

/// Height of the quadric `q` at (u, v).
#[inline]
pub(super) fn quad(q: &[f64; 6], u: f64, v: f64) -> f64 {
    q[0] + q[1] * u + q[2] * v + q[3] * u * u + q[4] * u * v + q[5] * v * v
}

/// Points in the frame of a patch, coordinate by coordinate.
#[derive(Default)]
pub(super) struct PatchPoints {
    pub u: Vec<f64>,
    pub v: Vec<f64>,
    pub z: Vec<f64>,
}

impl PatchPoints {
    pub(super) fn clear(&mut self) {
        [&mut self.u, &mut self.v, &mut self.z].into_iter().for_each(Vec::clear);
    }
    pub(super) fn push(&mut self, u: f64, v: f64, z: f64) {
        self.u.push(u);
        self.v.push(v);
        self.z.push(z);
    }
    /// Fills the last vector with points that are too far away to weigh anything.
    pub(super) fn fill(&mut self) {
        while !self.u.len().is_multiple_of(LANES) {
            self.push(0.0, 0.0, PARTITION.no_weight_height);
        }
    }
}

/// One round of weighted least squares of z against the six monomials, weights by the residuals to the
/// current `q`. `ridge` is the ratio of noise to the prior deviation of the curved terms. Returns the
/// deviations of the two squares' coefficients in units of the noise.
pub(super) fn fit_quadric(local: &PatchPoints, q: &mut [f64; 6], limit: f64, ridge: f64) -> Option<[f64; 2]> {
    let (m, mut b) = Arch::new().dispatch(Moments { local, q, limit });
    let [total, u, v, uu, uv, vv, uuu, uuv, uvv, vvv, uuuu, uuuv, uuvv, uvvv, vvvv] = m;
    let mut a = [
        [total, u, v, uu, uv, vv],
        [0.0, uu, uv, uuu, uuv, uvv],
        [0.0, 0.0, vv, uuv, uvv, vvv],
        [0.0, 0.0, 0.0, uuuu, uuuv, uuvv],
        [0.0, 0.0, 0.0, 0.0, uuvv, uvvv],
        [0.0, 0.0, 0.0, 0.0, 0.0, vvvv],
    ];
    let a = a.as_flattened_mut();
    if total < 4.0 {
        return None;
    }
    // With points on a line the quadric is not determined, the plane is: hence the trace of ridge.
    for i in 0..6 {
        a[i * 7] += if i < 3 { 1e-9 * total } else { 1e-4 * total + ridge * ridge };
    }
    if !cholesky(a, 6) {
        return None;
    }
    cholesky_solve(a, 6, &mut b);
    *q = b;
    Some([3, 5].map(|k| {
        let mut unit = [0.0; 6];
        unit[k] = 1.0;
        cholesky_solve(a, 6, &mut unit);
        unit[k].max(0.0).sqrt()
    }))
}

/// Sums over points of w u^i v^j for i + j up to 4, and of w z u^i v^j up to 2, where w are Tukey's weights
/// of their distances to the quadric `q`.
struct Moments<'a> {
    local: &'a PatchPoints,
    q: &'a [f64; 6],
    limit: f64,
}

impl WithSimd for Moments<'_> {
    type Output = ([f64; 15], [f64; 6]);
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        // Wider ones exist only where another crate has turned them on in pulp.
        if S::F64_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let Self { local: PatchPoints { u, v, z }, q, limit } = self;
        let zero = simd.splat_f64s(0.0);
        let one = simd.splat_f64s(1.0);
        let (mut m, mut b) = ([zero; 15], [zero; 6]);
        let [q0, q1, q2] = [simd.splat_f64s(q[0]), simd.splat_f64s(q[1]), simd.splat_f64s(q[2])];
        let [q3, q4, q5] = [simd.splat_f64s(q[3]), simd.splat_f64s(q[4]), simd.splat_f64s(q[5])];
        let narrow = simd.splat_f64s(1.0 / limit);
        let (u, v, z) = (S::as_simd_f64s(u).0, S::as_simd_f64s(v).0, S::as_simd_f64s(z).0);
        for ((&u, &v), &z) in u.iter().zip(v).zip(z) {
            let (uu, uv, vv) = (simd.mul_f64s(u, u), simd.mul_f64s(u, v), simd.mul_f64s(v, v));
            let h = simd.mul_add_e_f64s(q1, u, simd.mul_add_e_f64s(q2, v, q0));
            let h = simd.mul_add_e_f64s(q3, uu, simd.mul_add_e_f64s(q4, uv, simd.mul_add_e_f64s(q5, vv, h)));
            let t = simd.mul_f64s(simd.sub_f64s(z, h), narrow);
            let t = simd.max_f64s(simd.sub_f64s(one, simd.mul_f64s(t, t)), zero);
            let w = simd.mul_f64s(t, t);
            let (wu, wv) = (simd.mul_f64s(w, u), simd.mul_f64s(w, v));
            let (wuu, wuv, wvv) = (simd.mul_f64s(w, uu), simd.mul_f64s(w, uv), simd.mul_f64s(w, vv));
            m[0] = simd.add_f64s(m[0], w);
            m[1] = simd.add_f64s(m[1], wu);
            m[2] = simd.add_f64s(m[2], wv);
            m[3] = simd.add_f64s(m[3], wuu);
            m[4] = simd.add_f64s(m[4], wuv);
            m[5] = simd.add_f64s(m[5], wvv);
            m[6] = simd.mul_add_e_f64s(wuu, u, m[6]);
            m[7] = simd.mul_add_e_f64s(wuu, v, m[7]);
            m[8] = simd.mul_add_e_f64s(wvv, u, m[8]);
            m[9] = simd.mul_add_e_f64s(wvv, v, m[9]);
            m[10] = simd.mul_add_e_f64s(wuu, uu, m[10]);
            m[11] = simd.mul_add_e_f64s(wuu, uv, m[11]);
            m[12] = simd.mul_add_e_f64s(wuu, vv, m[12]);
            m[13] = simd.mul_add_e_f64s(wvv, uv, m[13]);
            m[14] = simd.mul_add_e_f64s(wvv, vv, m[14]);
            b[0] = simd.mul_add_e_f64s(w, z, b[0]);
            b[1] = simd.mul_add_e_f64s(wu, z, b[1]);
            b[2] = simd.mul_add_e_f64s(wv, z, b[2]);
            b[3] = simd.mul_add_e_f64s(wuu, z, b[3]);
            b[4] = simd.mul_add_e_f64s(wuv, z, b[4]);
            b[5] = simd.mul_add_e_f64s(wvv, z, b[5]);
        }
        (m.map(|x| simd.reduce_sum_f64s(x)), b.map(|x| simd.reduce_sum_f64s(x)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::robust::tukey;
    use proptest::prelude::*;

    proptest! {
        /// The vector kernel against plain sums.
        #[test]
        fn moments_are_sums_over_the_points(
            seen in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 1..40),
            q in prop::array::uniform6(-1.0f64..1.0),
            limit in 0.1f64..4.0,
        ) {
            let mut local = PatchPoints::default();
            seen.iter().for_each(|&[u, v, z]| local.push(u, v, z));
            local.fill();
            let (m, b) = Arch::new().dispatch(Moments { local: &local, q: &q, limit });
            // The powers of u and v, in the order of the kernel's sums.
            let powers = (0..=4).flat_map(|n| (0..=n).map(move |j| (n - j, j)));
            for (k, (i, j)) in powers.enumerate() {
                let (mut sum, mut height) = (0.0, 0.0);
                for &[u, v, z] in &seen {
                    let w = tukey(z - quad(&q, u, v), limit) * u.powi(i) * v.powi(j);
                    sum += w;
                    height += w * z;
                }
                prop_assert!((m[k] - sum).abs() < 1e-12 * seen.len() as f64, "u^{} v^{}", i, j);
                if let Some(b) = b.get(k) {
                    prop_assert!((b - height).abs() < 1e-12 * seen.len() as f64, "z u^{} v^{}", i, j);
                }
            }
        }
    }
}
