//! One triangle in space: its nearest point, its solid angle, where a segment crosses it.
//!
//! In: corners. Out: numbers and points. Arithmetic is f64; the closest point is by Voronoi regions (Ericson
//! 2004, "Real-Time Collision Detection", 5.1.5), with a fall-back to the three sides where the triangle has
//! no area.

use super::inject;
use crate::numeric::vec3::Vec3;
use robust::{Coord3D, orient3d};

/// Where the square of twice a triangle's area is below this times the fourth power of its longer side at the
/// first corner, the weights of its corners are lost in rounding (2e-16 each): its sides are searched
/// instead. Derived.
const NO_AREA: f64 = 1e-14;

/// Where a ray meets a triangle, in lengths of the ray's direction from its start (Möller and Trumbore 1997);
/// `None` where it misses, or lies in the triangle's plane.
#[inline]
pub(crate) fn meets_ray([a, b, c]: &[Vec3; 3], from: Vec3, direction: Vec3) -> Option<f64> {
    let (ab, ac, to) = (*b - *a, *c - *a, from - *a);
    let (p, q) = (direction.cross(ac), to.cross(ab));
    let across = ab.dot(p);
    let (u, v, t) = (to.dot(p) / across, direction.dot(q) / across, ac.dot(q) / across);
    // None of these holds for what is no number.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

/// Twice the area of the triangle of three points, along its normal.
#[inline]
pub(crate) fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// The point of a triangle that is nearest to `p`.
#[inline]
pub(crate) fn closest_on_triangle(p: Vec3, t: &[Vec3; 3]) -> Vec3 {
    let [a, b, c] = *t;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc < 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb < 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va < 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    let side2 = ab.norm2().max(ac.norm2());
    if sum > NO_AREA * side2 * side2 {
        return a + (ab * (vb / sum) + ac * (vc / sum));
    }
    [(a, b), (b, c), (c, a)]
        .map(|(s, e)| closest_on_segment(p, s, e))
        .into_iter()
        .min_by(|x, y| p.dist2(*x).total_cmp(&p.dist2(*y)))
        .unwrap_or(a)
}

/// The point of a segment that is nearest to `p`.
pub(crate) fn closest_on_segment(p: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let ab = b - a;
    let length2 = ab.norm2();
    if length2 > 0.0 { a + ab * ((p - a).dot(ab) / length2).clamp(0.0, 1.0) } else { a }
}

/// Half the solid angle of a triangle seen from `p`: positive where its corners run clockwise as seen from
/// there, which is from behind it. 0 in its plane outside of it, and at its corners. After van Oosterom and
/// Strackee 1983.
#[inline]
pub(crate) fn half_solid_angle(p: Vec3, t: &[Vec3; 3]) -> f64 {
    let [a, b, c] = t.map(|v| v - p);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    a.dot(b.cross(c)).atan2(below)
}

/// Where the segment from `p` to `q` crosses a triangle, as a share of the way, and whether it enters through
/// the triangle's front. Triangles that share an edge leave no gap there.
pub(crate) fn crossing(p: Vec3, q: Vec3, t: &[Vec3; 3]) -> Option<(f64, bool)> {
    let along = q - p;
    let [a, b, c] = t.map(|v| v - p);
    // The sides' moments about the segment: two triangles at one edge get opposite numbers, to the last bit.
    let sides = [b.cross(c).dot(along), c.cross(a).dot(along), a.cross(b).dot(along)];
    let behind = sides.iter().all(|&s| s >= 0.0);
    if !behind && !sides.iter().all(|&s| s <= 0.0) {
        return None;
    }
    let normal = (b - a).cross(c - a);
    let (at, fall) = (normal.dot(a), normal.dot(along));
    let share = at / fall;
    (0.0..=1.0).contains(&share).then_some((share, fall < 0.0))
}

/// Whether a segment and a triangle share a point: exact, also in one plane (Shewchuk 1997, crate `robust`).
pub(crate) fn segment_meets(p: Vec3, q: Vec3, t: &[Vec3; 3]) -> bool {
    let [a, b, c] = *t;
    let (below, above) = (side(a, b, c, p), side(a, b, c, q));
    if below == 0.0 && above == 0.0 {
        return segment_meets_in_plane(p, q, t);
    }
    if (below > 0.0 && above > 0.0) || (below < 0.0 && above < 0.0) {
        return false;
    }
    let sides = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
}

/// On which side of the plane of three points the fourth lies, exactly.
fn side(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> f64 {
    let k = |p: Vec3| Coord3D { x: p[0], y: p[1], z: p[2] };
    orient3d(k(a), k(b), k(c), k(d))
}

/// [`segment_meets`] for five points in one plane.
fn segment_meets_in_plane(p: Vec3, q: Vec3, t: &[Vec3; 3]) -> bool {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    let axis = (1..3).fold(0, |a, k| if normal[k].abs() > normal[a].abs() { k } else { a });
    let flat = |v: Vec3| [v[(axis + 1) % 3], v[(axis + 2) % 3]];
    let ([a, b, c], p, q) = (t.map(flat), flat(p), flat(q));
    let within = [[a, b, p], [b, c, p], [c, a, p]].map(inject::positive);
    let within_turned = [[b, a, p], [c, b, p], [a, c, p]].map(inject::positive);
    let sides = [(a, b), (b, c), (c, a)];
    within == [true; 3] || within_turned == [true; 3] || sides.iter().any(|s| inject::touch(p, q, s.0, s.1))
}

/// The weights of a triangle's corners whose sum is the point `p` of the triangle; thirds where it has no
/// area.
pub(crate) fn weights(p: Vec3, t: &[Vec3; 3]) -> [f64; 3] {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    let share = |k: usize| {
        let (b, c) = (t[(k + 1) % 3], t[(k + 2) % 3]);
        ((b - p).cross(c - p).dot(normal) / normal.norm2()).clamp(0.0, 1.0)
    };
    if normal.norm2() > 0.0 { [0, 1, 2].map(share) } else { [1.0 / 3.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The distance by a fine grid of points of the triangle, an upper bound that converges.
    fn by_grid(p: Vec3, t: &[Vec3; 3], n: usize) -> f64 {
        let mut best = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n - i {
                let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
                let q = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
                best = best.min(p.dist2(q));
            }
        }
        best.sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn closest_point_is_on_the_triangle_and_nearest(
            v in prop::array::uniform12(-1.0f64..1.0),
            flat in 0u8..4,
        ) {
            let at = |k: usize| Vec3([v[k], v[k + 1], v[k + 2]]);
            let (mut t, p) = ([at(0), at(3), at(6)], at(9));
            match flat {
                1 => t[2] = t[0] + (t[1] - t[0]) * v[6],
                2 => t[1] = t[0],
                3 => t = [t[0]; 3],
                _ => {}
            }
            let d = (p - closest_on_triangle(p, &t)).norm();
            let grid = by_grid(p, &t, 60);
            prop_assert!(d <= grid + 1e-9, "{d} {grid}");
            prop_assert!(d >= grid - 0.08, "{d} {grid}");
        }
    }

    #[test]
    fn a_segment_meets_a_triangle_across_its_plane_and_in_it() {
        let t = [[0.0, 0.0, 0.1], [1.0, 0.0, 0.1], [0.0, 1.0, 0.1]].map(Vec3);
        let meets = |p: [f64; 3], q: [f64; 3]| segment_meets(Vec3(p), Vec3(q), &t);
        assert!(meets([0.2, 0.2, 1.0], [0.2, 0.3, -1.0]) && meets([0.2, 0.2, 0.1], [0.3, 0.3, 0.1]));
        assert!(meets([-1.0, 0.5, 0.1], [2.0, 0.5, 0.1]) && meets([0.0, 1.0, 0.1], [0.0, 2.0, 0.1]));
        assert!(!meets([0.2, 0.2, 1.0], [0.2, 0.3, 0.2]) && !meets([0.6, 0.6, 1.0], [0.6, 0.6, -1.0]));
        assert!(!meets([-1.0, 1.5, 0.1], [2.0, 1.5, 0.1]) && !meets([0.0, 1.1, 0.1], [0.0, 2.0, 0.1]));
    }

    #[test]
    fn a_segment_crosses_a_triangle_from_its_front_or_from_its_back() {
        let t = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Vec3);
        let (above, below) = (Vec3([0.2, 0.3, 1.0]), Vec3([0.2, 0.3, -3.0]));
        assert_eq!(crossing(above, below, &t), Some((0.25, true)));
        assert_eq!(crossing(below, above, &t), Some((0.75, false)));
        assert_eq!(crossing(above, Vec3([0.2, 0.3, 0.5]), &t), None);
        assert_eq!(crossing(Vec3([1.0, 1.0, 1.0]), Vec3([1.0, 1.0, -1.0]), &t), None);
        assert!((half_solid_angle(Vec3([0.2, 0.3, -1e-9]), &t) - std::f64::consts::PI).abs() < 1e-6);
        assert!((half_solid_angle(Vec3([0.2, 0.3, 1e-9]), &t) + std::f64::consts::PI).abs() < 1e-6);
    }
}
