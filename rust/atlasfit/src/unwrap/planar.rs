//! Boxes and hulls of the plane.

use super::constants::UNWRAP;
use crate::numeric::plane::twice_area;

/// The box of some points.
pub(crate) fn bounds(p: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for q in p {
        for k in 0..2 {
            lo[k] = lo[k].min(q[k]);
            hi[k] = hi[k].max(q[k]);
        }
    }
    (lo, hi)
}

/// A point turned by (c, s).
pub(crate) fn turned([x, y]: [f64; 2], [c, s]: [f64; 2]) -> [f64; 2] {
    [c * x - s * y, s * x + c * y]
}

/// Points turned by (c, s).
pub(crate) fn rotated(uv: &[[f64; 2]], r: [f64; 2]) -> Vec<[f64; 2]> {
    uv.iter().map(|&p| turned(p, r)).collect()
}

/// A hull with its corners thinned out evenly where there are very many: for what compares all pairs of them.
pub(crate) fn thinned(hull: &[[f64; 2]]) -> Vec<[f64; 2]> {
    hull.iter().copied().step_by(hull.len().div_ceil(UNWRAP.enough_corners).max(1)).collect()
}

/// The convex hull, counter-clockwise (Andrew 1979).
pub(crate) fn hull(uv: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut p: Vec<[f64; 2]> = uv.to_vec();
    p.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for pass in 0..2 {
        let base = hull.len();
        let mut add = |q: [f64; 2]| {
            while hull.len() >= base + 2 && twice_area(hull[hull.len() - 2], hull[hull.len() - 1], q) <= 0.0 {
                hull.pop();
            }
            hull.push(q);
        };
        if pass == 0 {
            p.iter().for_each(|&q| add(q));
        } else {
            p.iter().rev().for_each(|&q| add(q));
        }
        hull.pop();
    }
    hull
}

/// The quarter turn, or none, that puts the long side of the bounding box along x.
pub(crate) fn along_x(uv: &[[f64; 2]]) -> [f64; 2] {
    let (lo, hi) = bounds(uv);
    if hi[0] - lo[0] >= hi[1] - lo[1] { [1.0, 0.0] } else { [0.0, 1.0] }
}

/// The rotation that gives the bounding box of (nearly) least area, its long side along x.
pub(crate) fn upright(uv: &[[f64; 2]]) -> [f64; 2] {
    let hull = thinned(&hull(uv));
    let mut best = (f64::INFINITY, [1.0, 0.0]);
    for i in 0..hull.len() {
        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
        let d = [b[0] - a[0], b[1] - a[1]];
        let l = (d[0] * d[0] + d[1] * d[1]).sqrt();
        if l <= 0.0 {
            continue;
        }
        let r = [d[0] / l, -d[1] / l];
        let (lo, hi) = bounds(&rotated(&hull, r));
        let (w, h) = (hi[0] - lo[0], hi[1] - lo[1]);
        if w * h < best.0 {
            best = (w * h, if w >= h { r } else { [-r[1], r[0]] });
        }
    }
    best.1
}
