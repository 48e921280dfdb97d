//! Cuts a polygon into triangles that do not fold: ear clipping in the polygon's mean plane (Meisters 1975).

use crate::numeric::vec3::Vec3;

/// Ear clipping is quadratic at worst: beyond this many tests in one mesh, polygons become plain fans.
pub const MOST_TESTS: u64 = 1 << 26;

/// Cuts a polygon of n corners into n - 2 triangles, which go to `out` as corner numbers 0 to n - 1.
/// `corners` holds indices into `positions`. `tests` is how many more tests of a point in a triangle may be
/// made: where none are left, a polygon becomes a plain fan.
///
/// ```
/// use atlasfit::geometry::triangulate::{MOST_TESTS, triangulate};
/// // An arrow head, whose notch is its last corner.
/// let at = [[0.0; 3], [2.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.5, 1.0, 0.0]];
/// let mut out = Vec::new();
/// triangulate(&at, &[0, 1, 2, 3], &mut MOST_TESTS.clone(), &mut out);
/// assert_eq!(out, [[1, 2, 3], [1, 3, 0]]);
/// ```
///
/// # Panics
/// Where a corner names no position.
pub fn triangulate(positions: &[[f64; 3]], corners: &[u32], tests: &mut u64, out: &mut Vec<[u32; 3]>) {
    let n = corners.len();
    if n < 3 {
        return out.clear();
    }
    let at = |i: usize| Vec3(positions[corners[i] as usize]);
    out.clear();
    // Newell's normal, relative to the first corner so that far-away coordinates do not cancel.
    let mut normal = Vec3::ZERO;
    for i in 1..n - 1 {
        normal += (at(i) - at(0)).cross(at(i + 1) - at(0));
    }
    if n == 4 {
        // Both triangles of a diagonal must face as the polygon does; of two such diagonals the shorter.
        let facing = |a, b, c| (at(b) - at(a)).cross(at(c) - at(a)).dot(normal) > 0.0;
        let first = facing(0, 1, 2) && facing(0, 2, 3);
        let second = facing(1, 2, 3) && facing(1, 3, 0);
        let shorter = at(1).dist2(at(3)) < at(0).dist2(at(2)) * (1.0 - 1e-12);
        let split: [[u32; 3]; 2] =
            if second && (!first || shorter) { [[1, 2, 3], [1, 3, 0]] } else { [[0, 1, 2], [0, 2, 3]] };
        out.extend(split);
        return;
    }
    // The polygon counter-clockwise in the coordinate plane that its normal points away from most.
    let largest = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(2);
    let flat = |i: usize| {
        let p = at(i) - at(0);
        let (u, v) = (p[(largest + 1) % 3], p[(largest + 2) % 3]);
        if normal[largest] < 0.0 { [v, u] } else { [u, v] }
    };
    clip_ears(&(0..n).map(flat).collect::<Vec<_>>(), tests, out);
}

/// Twice the area of a triangle of the plane; positive where it runs counter-clockwise.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Cuts ears off a polygon of the plane until a triangle is left. `tests` and `out` as in [`triangulate`].
fn clip_ears(points: &[[f64; 2]], tests: &mut u64, out: &mut Vec<[u32; 3]>) {
    let n = points.len();
    let reflex: Vec<usize> =
        (0..n).filter(|&i| area(points[(i + n - 1) % n], points[i], points[(i + 1) % n]) < 0.0).collect();
    if reflex.is_empty() || *tests == 0 {
        out.extend((1..n as u32 - 1).map(|i| [0, i, i + 1]));
        return;
    }
    let mut next: Vec<usize> = (0..n).map(|i| (i + 1) % n).collect();
    let mut previous: Vec<usize> = (0..n).map(|i| (i + n - 1) % n).collect();
    let mut gone = vec![false; n];
    let mut left = n;
    let mut i = 0;
    // Corners looked at since the last cut; a full round without an ear means a self-crossing or flat
    // polygon.
    let mut looked = 0;
    while left > 3 {
        let (a, c) = (previous[i], next[i]);
        let forced = looked >= left || *tests == 0;
        let ear = forced
            || area(points[a], points[i], points[c]) > 0.0 && {
                *tests = tests.saturating_sub(reflex.len() as u64);
                let [pa, pi, pc] = [points[a], points[i], points[c]];
                // Only a reflex corner can lie inside of an ear.
                !reflex.iter().any(|&r| {
                    let p = points[r];
                    !gone[r]
                        && r != a
                        && r != i
                        && r != c
                        && p != pa
                        && p != pi
                        && p != pc
                        && area(pa, pi, p) >= 0.0
                        && area(pi, pc, p) >= 0.0
                        && area(pc, pa, p) >= 0.0
                })
            };
        if ear {
            out.push([a as u32, i as u32, c as u32]);
            next[a] = c;
            previous[c] = a;
            gone[i] = true;
            left -= 1;
            looked = 0;
        } else {
            looked += 1;
        }
        i = c;
    }
    out.push([previous[i] as u32, i as u32, next[i] as u32]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    /// Stars of random radii, far from the origin, are cut into triangles that all turn as the star does and
    /// cover just it, whichever corner comes first; so does a quad with a dent.
    #[test]
    fn polygons_do_not_fold() {
        let mut rng = Rng::new(1);
        for n in 4..40 {
            let star: Vec<[f64; 3]> = (0..n)
                .map(|i| {
                    let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                    let r = 0.5 + rng.normal().abs();
                    [1e6 + r * a.cos(), r * a.sin(), 0.5 * r * a.cos()]
                })
                .collect();
            let turned = |t: [u32; 3]| {
                let [a, b, c] = t.map(|i| star[i as usize]);
                area([a[0], a[1]], [b[0], b[1]], [c[0], c[1]])
            };
            let corners: Vec<u32> = (0..n as u32).collect();
            let mut cut = Vec::new();
            triangulate(&star, &corners, &mut MOST_TESTS.clone(), &mut cut);
            assert_eq!(cut.len(), n as usize - 2);
            let whole: f64 = (2..n as u32).map(|i| turned([0, i - 1, i])).sum();
            assert!(cut.iter().all(|&t| turned(t) > 0.0), "{n} corners");
            assert!((cut.iter().map(|&t| turned(t)).sum::<f64>() - whole).abs() < 1e-6, "{n} corners");
        }
    }
}
