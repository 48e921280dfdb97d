//! How far a triangle of the plane is from its rest shape `[l, x, y]`: corners (0, 0), (l, 0), (x, y).

use super::constants::FLATTEN;
use crate::numeric::plane::{corners, twice_area};
use crate::unwrap::chart::Chart;
use crate::unwrap::surface::Surface;

/// The linear part of the map from a rest triangle to the plane, row by row.
#[inline]
pub(crate) fn jacobian([l, x, y]: [f64; 3], p: [[f64; 2]; 3]) -> [f64; 4] {
    let d1 = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
    let d2 = [p[2][0] - p[0][0], p[2][1] - p[0][1]];
    let (a, c) = (d1[0] / l, d1[1] / l);
    [a, (d2[0] - a * x) / y, c, (d2[1] - c * x) / y]
}

/// Largest and smallest singular value of the map from a rest triangle to the plane; the smallest is negative
/// for a flipped one.
#[inline]
pub(crate) fn singular(rest: [f64; 3], p: [[f64; 2]; 3]) -> (f64, f64) {
    let [a, b, c, d] = jacobian(rest, p);
    // Singular values from the similar and the anti-similar part.
    let p = ((a + d).powi(2) + (c - b).powi(2)).sqrt() * 0.5;
    let q = ((a - d).powi(2) + (c + b).powi(2)).sqrt() * 0.5;
    (p + q, p - q)
}

/// The judge of one triangle: max(s1, 1/s2); infinite when flipped or flat.
#[inline]
pub(crate) fn stretch(rest: [f64; 3], p: [[f64; 2]; 3]) -> f64 {
    let (s1, s2) = singular(rest, p);
    if s2 > 0.0 { s1.max(1.0 / s2) } else { f64::INFINITY }
}

/// Whether every triangle is counter-clockwise.
pub(crate) fn all_positive(tris: &[[u32; 3]], uv: &[[f64; 2]]) -> bool {
    tris.iter().all(|t| {
        let [a, b, c] = corners(*t, uv);
        twice_area(a, b, c) > 1e-18
    })
}

/// Area of the faces stretched beyond `bound`.
pub(crate) fn over_area(s: &Surface, chart: &Chart, bound: f64) -> f64 {
    over_area_at(s, chart, &chart.uv, bound)
}

/// The same with other positions.
pub(crate) fn over_area_at(s: &Surface, chart: &Chart, uv: &[[f64; 2]], bound: f64) -> f64 {
    chart
        .faces
        .iter()
        .zip(&chart.tris)
        .filter(|(f, t)| stretch(s.rest[**f as usize], corners(**t, uv)) > bound)
        .map(|(f, _)| s.area[*f as usize])
        .sum()
}

/// Half the cotangent at each corner of rest triangles, kept inside the bounds of [`FLATTEN`].
pub(crate) fn cotangents(rest: &[[f64; 3]]) -> Vec<[f64; 3]> {
    rest.iter()
        .map(|&[l, x, y]| {
            // Dot over cross of the two edges at each corner.
            let twice = l * y;
            let c0 = x * l / twice;
            let c1 = (l - x) * l / twice;
            let c2 = (x * (x - l) + y * y) / twice;
            [c0, c1, c2].map(|c| (0.5 * c).clamp(FLATTEN.least_cot, FLATTEN.most_cot))
        })
        .collect()
}
