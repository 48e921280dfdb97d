//! The bias that noise gives to a curved surface, taken out.
//!
//! In: a chart and its noise. Out: the chart with sharper bends.

use super::constants::FIT;
use crate::atlas::Monge;
use crate::numeric::spline;

/// Takes out the bias. Points scattered about a surface by isotropic noise lie on average outside its bends:
/// a circle of radius r seems to have radius r + sigma^2 / 2r, a graph h seems to be h - sigma^2 / 2 times
/// its Laplacian (to first order).
pub(super) fn sharpen(chart: &mut Monge, sigma: f64) {
    let step = 2.0 / spline::INTERVALS as f64;
    let [a, b] = chart.radii.map(|r| FIT.sharpen * 0.5 * (sigma / (r * step)).powi(2));
    let old = chart.coeffs.clone();
    let n = spline::SIDE;
    for i in 1..n - 1 {
        for j in 1..n - 1 {
            let at = |i: usize, j: usize| f64::from(old[i * n + j]);
            let uu = at(i - 1, j) - 2.0 * at(i, j) + at(i + 1, j);
            let vv = at(i, j - 1) - 2.0 * at(i, j) + at(i, j + 1);
            chart.coeffs[i * n + j] = (at(i, j) + a * uu + b * vv) as f32;
        }
    }
}
