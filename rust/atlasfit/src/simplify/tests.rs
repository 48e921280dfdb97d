//! Claims about simplified meshes.

use super::*;
use crate::numeric::Rng;
use crate::numeric::vec3::Vec3;
use crate::run::Run;
use crate::spatial::edges::Edges;
use crate::spatial::triangle::{area_vector, closest_on_triangle};

/// A mesh by its positions and triangles.
struct Plain {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// A grid of squares, each two triangles; `at` places the parameters in [0, 1]. Where it `wraps`, it is a
/// torus.
fn grid([m, n]: [u32; 2], wraps: bool, at: impl Fn(f64, f64) -> [f64; 3]) -> Plain {
    let (rows, columns) = if wraps { (m, n) } else { (m + 1, n + 1) };
    let place = |k: u32| at(f64::from(k / columns) / f64::from(m), f64::from(k % columns) / f64::from(n));
    let positions = (0..rows * columns).map(|k| Vec3(place(k))).collect();
    let at = |i: u32, j: u32| (i % rows) * columns + j % columns;
    let square = |k: u32| {
        let (i, j) = (k / n, k % n);
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    Plain { positions, triangles: (0..m * n).flat_map(square).collect() }
}

fn torus(u: f64, v: f64) -> [f64; 3] {
    let [(su, cu), (sv, cv)] = [u, v].map(|x| (std::f64::consts::TAU * x).sin_cos());
    [(1.0 + 0.4 * cv) * cu, (1.0 + 0.4 * cv) * su, 0.4 * sv]
}

/// Simplifies with the same bounds everywhere.
fn run_on(run: Run<'_>, m: &Plain, faces: usize, [max_error, longest]: [f64; 2]) -> Simplified {
    let mut run = run;
    let mut normals = vec![Vec3::ZERO; m.positions.len()];
    for t in &m.triangles {
        let n = area_vector(t.map(|v| m.positions[v as usize]));
        t.iter().for_each(|&v| normals[v as usize] += n);
    }
    let normals: Vec<Vec3> = normals.into_iter().map(Vec3::normalized).collect();
    let all = |x: f64| vec![bound(x); m.positions.len()];
    let goal = Goal { faces, error: all(max_error), longest: all(longest), between: false };
    let dense = Dense { positions: &m.positions, normals: &normals, triangles: &m.triangles, seams: None };
    run.execute(|ctx| simplify(&dense, &goal, ctx)).unwrap()
}

fn run(m: &Plain, faces: usize, max_error: f64) -> Simplified {
    run_on(Run::default(), m, faces, [max_error, f64::INFINITY])
}

fn plain(s: &Simplified) -> Plain {
    Plain { positions: s.positions.clone(), triangles: s.triangles.clone() }
}

fn corners(m: &Plain, t: &[u32; 3]) -> [Vec3; 3] {
    t.map(|v| m.positions[v as usize])
}

/// Greatest distance from one mesh to the other, of its vertices and the middles of its triangles.
fn distance(from: &Plain, to: &Plain) -> f64 {
    let middle = |t: &[u32; 3]| corners(from, t).into_iter().fold(Vec3::ZERO, |a, b| a + b) * (1.0 / 3.0);
    let off = |p: Vec3| {
        let nearest = |t: &[u32; 3]| p.dist2(closest_on_triangle(p, &corners(to, t)));
        to.triangles.iter().map(nearest).fold(f64::INFINITY, f64::min)
    };
    let places = from.positions.iter().copied().chain(from.triangles.iter().map(middle));
    places.map(off).fold(0.0, f64::max).sqrt()
}

/// Number of edges with one, with two, and with more triangles.
fn edges(s: &Simplified) -> [usize; 3] {
    let mut count = [0; 3];
    let edges = Run::default().execute(|ctx| Edges::new(&s.triangles, ctx)).unwrap();
    edges.iter().for_each(|e| count[e.len().min(3) - 1] += 1);
    count
}

/// Share of the triangles with an angle below 20 degrees.
fn needles(s: &Simplified) -> f64 {
    let m = plain(s);
    let least_angle = |t: &[u32; 3]| {
        let c = corners(&m, t);
        (0..3)
            .map(|k| {
                let (x, y) = ((c[(k + 1) % 3] - c[k]).normalized(), (c[(k + 2) % 3] - c[k]).normalized());
                x.dot(y).clamp(-1.0, 1.0).acos().to_degrees()
            })
            .fold(180.0, f64::min)
    };
    s.triangles.iter().filter(|t| least_angle(t) < 20.0).count() as f64 / s.triangles.len() as f64
}

#[test]
fn a_torus_stays_one_as_near_as_is_asked_for_both_ways() {
    let first = grid([60, 60], true, torus);
    let mut fewest = first.triangles.len();
    for (faces, max_error) in [(0, 0.003), (0, 0.03), (3600, 0.1)] {
        let s = run(&first, faces, max_error);
        let [rim, inner, more] = edges(&s);
        assert_eq!((rim, more, s.positions.len() + s.triangles.len()), (0, 0, inner), "Euler's number is 0");
        assert!(
            distance(&Plain { triangles: Vec::new(), ..grid([60, 60], true, torus) }, &plain(&s))
                <= max_error * (1.0 + 1e-9)
        );
        let back = distance(&plain(&s), &first);
        assert!(back <= 1.5 * max_error, "{back} {max_error}");
        assert!(needles(&s) < 0.05, "{}", needles(&s));
        if faces > 0 {
            assert!(s.triangles.len().abs_diff(faces) <= 2, "{}", s.triangles.len());
        } else {
            assert!(s.triangles.len() < fewest, "{} {fewest}", s.triangles.len());
            fewest = s.triangles.len();
        }
        for ((p, n), &from) in s.positions.iter().zip(&s.normals).zip(&s.from) {
            assert!((*p - first.positions[from as usize]).norm() < 0.5, "a vertex comes from near by");
            let ring = Vec3([p[0], p[1], 0.0]).normalized();
            assert!(n.dot((*p - ring).normalized()) > 0.95, "normals are those of the surface: {n:?}");
        }
    }
}

#[test]
fn a_rough_surface_gets_few_needles_within_the_error() {
    let mut rng = Rng::new(1);
    let mut first = grid([120, 80], true, torus);
    first.positions.iter_mut().for_each(|p| *p += Vec3::from_fn(|_| 0.008 * rng.normal()));
    let s = run_on(Run::default(), &first, 0, [0.01, 0.15]);
    assert!(s.triangles.len() < first.triangles.len() / 3, "{}", s.triangles.len());
    assert!(needles(&s) < 0.05, "{}", needles(&s));
    let vertices = Plain { triangles: Vec::new(), positions: first.positions.clone() };
    assert!(distance(&vertices, &plain(&s)) <= 0.01 * (1.0 + 1e-9));
}

#[test]
fn a_flat_sheet_becomes_few_triangles_and_keeps_its_corners() {
    let s = run(&grid([40, 40], false, |u, v| [u, v, 0.25]), 0, 1e-6);
    assert!(s.triangles.len() < 80, "{}", s.triangles.len());
    let m = plain(&s);
    let area: f64 = s.triangles.iter().map(|t| 0.5 * area_vector(corners(&m, t))[2]).sum();
    assert!((area - 1.0).abs() < 1e-9, "{area}");
    for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
        let at = Vec3([corner[0], corner[1], 0.25]);
        assert!(s.positions.iter().any(|p| (*p - at).norm() < 1e-6), "{corner:?}");
    }
}

#[test]
fn triangles_keep_their_shape_and_grow_where_the_surface_is_flat() {
    // Flat but for a bump in the middle.
    let bump = |u: f64, v: f64| 0.1 * (-80.0 * ((u - 0.5).powi(2) + (v - 0.5).powi(2))).exp();
    let s = run(&grid([80, 80], false, |u, v| [u, v, bump(u, v)]), 1500, 1e-3);
    let m = plain(&s);
    let area = |t: &[u32; 3]| area_vector(corners(&m, t)).norm();
    let on_bump = |t: &&[u32; 3]| corners(&m, t).iter().all(|p| bump(p[0], p[1]) > 0.01);
    let usual = |all: Vec<f64>| all.iter().sum::<f64>() / all.len() as f64;
    let small = usual(s.triangles.iter().filter(on_bump).map(area).collect());
    let large = usual(s.triangles.iter().filter(|t| !on_bump(t)).map(area).collect());
    assert!(large > 2.0 * small, "{large} {small}");
    assert!(needles(&s) < 0.05, "{}", needles(&s));
}

#[test]
fn a_stretched_grid_gets_as_few_triangles_as_a_square_one() {
    // The same sheet, by squares and by oblongs three times as long as they are wide.
    let wave = |u: f64, v: f64| [u, v, 0.02 * (9.0 * u).sin() * (9.0 * v).cos()];
    let square = run(&grid([60, 60], false, wave), 0, 2e-3);
    let oblong = run(&grid([35, 105], false, wave), 0, 2e-3);
    let (few, many) = (square.triangles.len() as f64, oblong.triangles.len() as f64);
    assert!(many < 1.3 * few, "{many} {few}");
    assert!(needles(&oblong) < 0.04, "{}", needles(&oblong));
}

#[test]
fn edges_grow_no_longer_than_they_may_and_all_blocks_are_done() {
    let s = run_on(Run::default(), &grid([200, 200], false, |u, v| [u, v, 0.0]), 0, [1e-3, 0.02]);
    let m = plain(&s);
    let sides = |t: &[u32; 3]| {
        let [a, b, c] = corners(&m, t);
        [a.dist2(b), b.dist2(c), c.dist2(a)].map(f64::sqrt)
    };
    let lengths: Vec<f64> = s.triangles.iter().flat_map(sides).collect();
    assert!(lengths.iter().all(|l| *l <= 0.0201), "the longest");
    // Half of the greatest length, where the grid had a quarter.
    let short = lengths.iter().filter(|l| **l < 0.0075).count();
    assert!(short * 50 < lengths.len(), "{short} of {}", lengths.len());
}

#[test]
fn a_crease_stays_sharp() {
    // Two planes at a right angle; the crease runs askew to the grid's blocks.
    let roof = |u: f64, v: f64| [u, v, (u - 0.5).abs()];
    let first = grid([60, 60], false, roof);
    let s = run(&first, 0, 2e-3);
    let m = plain(&s);
    assert!(s.triangles.len() < 300, "{}", s.triangles.len());
    let both = [distance(&m, &first), distance(&first, &m)];
    assert!(both.iter().all(|d| *d < 2e-3), "{both:?}");
    let area = |t: &[u32; 3]| area_vector(corners(&m, t));
    // On one of the planes, within 3 degrees.
    let flat = |n: &Vec3| (n[0].abs() - n[2]).abs() < 0.05 * n.norm();
    let all: f64 = s.triangles.iter().map(|t| area(t).norm()).sum();
    let on_planes: f64 = s.triangles.iter().map(area).filter(flat).map(Vec3::norm).sum();
    assert!(on_planes > 0.99 * all, "{on_planes} of {all}");
}

#[test]
fn threads_change_nothing() {
    let first = grid([120, 120], true, torus);
    for (faces, bounds) in [(0, [0.01, 0.12]), (first.triangles.len() / 10, [0.1, f64::INFINITY])] {
        let with = |threads| run_on(Run { threads, ..Run::default() }, &first, faces, bounds);
        let (one, four) = (with(1), with(4));
        assert!(one.triangles.len() < first.triangles.len() / 3);
        assert_eq!(
            (one.positions, one.normals, one.triangles),
            (four.positions, four.normals, four.triangles)
        );
    }
}

#[test]
fn nothing_is_done_where_nothing_may_change_or_few_are_there() {
    let first = grid([12, 12], true, torus);
    assert_eq!(run(&first, 0, 0.0).triangles, first.triangles);
    assert_eq!(run(&first, first.triangles.len(), 1.0).triangles, first.triangles);
}
