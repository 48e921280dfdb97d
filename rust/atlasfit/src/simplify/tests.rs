//! Claims about simplified meshes.

use super::*;
use crate::run::Run;
use crate::spatial::edges::Edges;
use crate::spatial::triangle::closest_on_triangle;

/// A grid of `n` by `n` squares, each two triangles; `at` places the parameters in [0, 1]. Where it `wraps`,
/// it is a torus.
fn grid(n: u32, wraps: bool, at: impl Fn(f64, f64) -> [f64; 3]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let side = if wraps { n } else { n + 1 };
    let place = |k: u32| at(f64::from(k / side) / f64::from(n), f64::from(k % side) / f64::from(n));
    let positions = (0..side * side).map(|k| Vec3(place(k))).collect();
    let at = |i: u32, j: u32| (i % side) * side + j % side;
    let square = |k: u32| {
        let (i, j) = (k / n, k % n);
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    (positions, (0..n * n).flat_map(square).collect())
}

fn torus(u: f64, v: f64) -> [f64; 3] {
    let [(su, cu), (sv, cv)] = [u, v].map(|x| (std::f64::consts::TAU * x).sin_cos());
    [(1.0 + 0.4 * cv) * cu, (1.0 + 0.4 * cv) * su, 0.4 * sv]
}

fn run((positions, triangles): &(Vec<Vec3>, Vec<[u32; 3]>), faces: usize, max_error: f64) -> Simplified {
    let goal = Goal { faces, max_error };
    Run::default().execute(|ctx| simplify(positions, triangles, &goal, ctx)).unwrap()
}

fn corners(s: &Simplified, t: &[u32; 3]) -> [Vec3; 3] {
    t.map(|v| s.positions[v as usize])
}

/// Greatest distance of the first mesh's vertices from the new one.
fn error(positions: &[Vec3], s: &Simplified) -> f64 {
    let off = |p: &Vec3| {
        s.triangles
            .iter()
            .map(|t| p.dist2(closest_on_triangle(*p, &corners(s, t))))
            .fold(f64::INFINITY, f64::min)
    };
    positions.iter().map(off).fold(0.0, f64::max).sqrt()
}

/// Number of edges with one, with two, and with more triangles.
fn edges(s: &Simplified) -> [usize; 3] {
    let mut count = [0; 3];
    let edges = Run::default().execute(|ctx| Edges::new(&s.triangles, ctx)).unwrap();
    edges.iter().for_each(|e| count[e.len().min(3) - 1] += 1);
    count
}

#[test]
fn a_torus_stays_one_as_near_as_is_asked_for() {
    let first = grid(60, true, torus);
    let mut fewest = first.1.len();
    for (faces, max_error) in [(0, 0.003), (0, 0.03), (3600, 0.1)] {
        let s = run(&first, faces, max_error);
        let [rim, inner, more] = edges(&s);
        assert_eq!((rim, more, s.positions.len() + s.triangles.len()), (0, 0, inner), "Euler's number is 0");
        assert!(error(&first.0, &s) <= max_error * (1.0 + 1e-9));
        if faces > 0 {
            assert!(s.triangles.len().abs_diff(faces) <= 2, "{}", s.triangles.len());
        } else {
            assert!(s.triangles.len() < fewest, "{} {fewest}", s.triangles.len());
            fewest = s.triangles.len();
        }
        for (p, &from) in s.positions.iter().zip(&s.from) {
            assert!((*p - first.0[from as usize]).norm() < 0.5, "a vertex comes from near by");
        }
    }
}

#[test]
fn a_flat_sheet_becomes_few_triangles_and_keeps_its_corners() {
    let s = run(&grid(40, false, |u, v| [u, v, 0.25]), 0, 1e-6);
    assert!(s.triangles.len() < 80, "{}", s.triangles.len());
    let area: f64 = s
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(&s, t);
            0.5 * (b - a).cross(c - a)[2]
        })
        .sum();
    assert!((area - 1.0).abs() < 1e-9, "{area}");
    for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
        assert!(
            s.positions.iter().any(|p| (*p - Vec3([corner[0], corner[1], 0.25])).norm() < 1e-6),
            "{corner:?}"
        );
    }
}

#[test]
fn triangles_keep_their_shape_and_grow_where_the_surface_is_flat() {
    // Flat but for a bump in the middle.
    let bump = |u: f64, v: f64| 0.1 * (-80.0 * ((u - 0.5).powi(2) + (v - 0.5).powi(2))).exp();
    let s = run(&grid(80, false, |u, v| [u, v, bump(u, v)]), 1500, 1e-3);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = corners(&s, t);
        (b - a).cross(c - a).norm()
    };
    let on_bump = |t: &&[u32; 3]| corners(&s, t).iter().all(|p| bump(p[0], p[1]) > 0.01);
    let usual = |all: Vec<f64>| all.iter().sum::<f64>() / all.len() as f64;
    let small = usual(s.triangles.iter().filter(on_bump).map(area).collect());
    let large = usual(s.triangles.iter().filter(|t| !on_bump(t)).map(area).collect());
    assert!(large > 2.0 * small, "{large} {small}");
    let least_angle = |t: &[u32; 3]| {
        let c = corners(&s, t);
        (0..3)
            .map(|k| {
                let (x, y) = ((c[(k + 1) % 3] - c[k]).normalized(), (c[(k + 2) % 3] - c[k]).normalized());
                x.dot(y).clamp(-1.0, 1.0).acos().to_degrees()
            })
            .fold(180.0, f64::min)
    };
    let needles = s.triangles.iter().filter(|t| least_angle(t) < 20.0).count();
    assert!(needles * 50 < s.triangles.len(), "{needles} of {}", s.triangles.len());
}

#[test]
fn nothing_is_done_where_nothing_may_change_or_few_are_there() {
    let first = grid(12, true, torus);
    assert_eq!(run(&first, 0, 0.0).triangles, first.1);
    assert_eq!(run(&first, first.1.len(), 1.0).triangles, first.1);
}
