//! What every solid must be, on small shapes with holes.

use super::*;
use crate::Run;
use crate::numeric::vec3::Vec3;
use crate::spatial::edges::Edges;
use crate::spatial::faces::Faces;
use std::f64::consts::PI;

/// A grid of `m` by `n` cells, each side wrapped or not, in triangles.
fn grid(m: usize, n: usize, wrap: [bool; 2], at: impl Fn(f64, f64) -> Vec3) -> Surface {
    let (columns, rows) = (m + usize::from(!wrap[0]), n + usize::from(!wrap[1]));
    let index = |i: usize, j: usize| ((i % columns) * rows + j % rows) as u32;
    let mut s = Surface::default();
    for i in 0..columns {
        s.positions.extend((0..rows).map(|j| at(i as f64 / m as f64, j as f64 / n as f64)));
    }
    for i in 0..m {
        for j in 0..n {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            s.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    finished(s)
}

fn finished(mut s: Surface) -> Surface {
    let n = s.positions.len();
    (s.normals, s.chart) = (vec![Vec3::ZERO; n], vec![0; n]);
    s
}

fn joined(parts: &[Surface]) -> Surface {
    let mut all = Surface::default();
    for s in parts {
        let base = all.positions.len() as u32;
        all.positions.extend(&s.positions);
        all.triangles.extend(s.triangles.iter().map(|t| t.map(|v| v + base)));
    }
    finished(all)
}

fn moved(s: &Surface, f: impl Fn(Vec3) -> Vec3) -> Surface {
    finished(Surface { positions: s.positions.iter().map(|&p| f(p)).collect(), ..s.clone() })
}

/// A ball of radius 0.4 without its caps beyond some angles from the poles.
fn ball(from: f64, to: f64) -> Surface {
    grid(40, 80, [false, true], |u, v| {
        let (a, b) = (from + (to - from) * u, 2.0 * PI * v);
        Vec3([a.sin() * b.cos(), a.sin() * b.sin(), a.cos()]) * 0.4
    })
}

fn sheet() -> Surface {
    grid(30, 30, [false; 2], |u, v| Vec3([u - 0.5, v - 0.5, 0.05 * (6.0 * u).sin()]))
}

/// A band that is turned over once: at one line its triangles face opposite ways.
fn moebius() -> Surface {
    let at = |u: f64, v: f64| {
        let (t, w) = (2.0 * PI * u, 0.3 * (v - 0.5));
        let r = 0.35 + w * (0.5 * t).cos();
        Vec3([r * t.cos(), r * t.sin(), w * (0.5 * t).sin()])
    };
    let (mut s, n) = (grid(80, 12, [false; 2], at), 13);
    let last = s.positions.len() as u32 - n;
    for v in s.triangles.iter_mut().flatten().filter(|v| **v >= last) {
        *v = n - 1 - (*v - last);
    }
    s.positions.truncate(last as usize);
    finished(s)
}

/// A box without its lid.
fn open_box() -> Surface {
    let side =
        |f: fn(f64, f64) -> [f64; 3]| grid(20, 20, [false; 2], move |u, v| Vec3(f(u - 0.5, v - 0.5)) * 0.8);
    let mut all = joined(&[
        side(|u, v| [v, u, -0.5]),
        side(|u, v| [0.5, u, v]),
        side(|u, v| [-0.5, v, u]),
        side(|u, v| [v, 0.5, u]),
        side(|u, v| [u, -0.5, v]),
    ]);
    // The sides' edges are welded.
    let name = |p: Vec3| p.0.map(|x| (x * 1e6).round() as i64);
    let first: std::collections::BTreeMap<[i64; 3], u32> =
        (0..all.positions.len()).rev().map(|i| (name(all.positions[i]), i as u32)).collect();
    for v in all.triangles.iter_mut().flatten() {
        *v = first[&name(all.positions[*v as usize])];
    }
    all
}

fn shapes() -> Vec<(&'static str, Surface)> {
    let half_torus = grid(60, 40, [false, true], |u, v| {
        let (a, b) = (PI * u, 2.0 * PI * v);
        let r = 0.35 + 0.12 * b.cos();
        Vec3([r * a.cos(), r * a.sin(), 0.12 * b.sin()])
    });
    let small = moved(&ball(0.5, PI - 0.001), |p| p * 0.3);
    let two = joined(&[
        moved(&small, |p| p + Vec3([-0.3, 0.0, 0.0])),
        moved(&small, |p| p + Vec3([0.3, 0.1, 0.0])),
    ]);
    let room = {
        let mut s = ball(0.4, PI - 0.001);
        s.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        s
    };
    vec![
        ("a ball without a cap", ball(0.6, PI - 0.001)),
        ("a bowl", ball(0.5 * PI, PI - 0.001)),
        ("half a torus", half_torus),
        ("a sheet", sheet()),
        ("an open box", open_box()),
        ("two parts", two),
        ("a Moebius strip", moebius()),
        ("a room seen from within", room),
    ]
}

const VOXEL: f64 = 0.02;

fn solid(s: &Surface, voxel: f64, threads: usize) -> Solid {
    let mut run = Run { threads, ..Run::default() };
    run.execute(|ctx| close(s.clone(), voxel, ctx)).unwrap()
}

fn volume(s: &Surface) -> f64 {
    let six = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| s.positions[v as usize]);
        a.dot(b.cross(c))
    };
    s.triangles.iter().map(six).sum::<f64>() / 6.0
}

/// Fans of triangles about all vertices: corners that are joined across edges.
fn fans(s: &Surface) -> usize {
    let mut sets = crate::spatial::sets::Sets::new(3 * s.triangles.len());
    let corner = |f: usize, v: u32| (3 * f + s.triangles[f].iter().position(|&c| c == v).unwrap()) as u32;
    let edges = Run::default().execute(|ctx| Edges::new(&s.triangles, ctx)).unwrap();
    for edge in edges.iter() {
        for v in edge[0].ends() {
            sets.join(corner(edge[0].face(), v), corner(edge[1].face(), v));
        }
    }
    (0..3 * s.triangles.len() as u32).filter(|&c| sets.find(c) == c).count()
}

fn check(name: &str, s: &Surface) {
    assert!(!s.triangles.is_empty(), "{name}");
    let edges = Run::default().execute(|ctx| Edges::new(&s.triangles, ctx)).unwrap();
    assert!(
        edges.iter().all(|e| e.len() == 2 && !e[0].runs_as(e[1], &s.triangles)),
        "{name}: closed and oriented"
    );
    assert_eq!(fans(s), s.positions.len(), "{name}: one fan about every vertex");
    assert!(volume(s) > 0.0, "{name}: {}", volume(s));
    let all: Vec<u32> = (0..s.triangles.len() as u32).collect();
    let met = Run::default()
        .execute(|ctx| Faces::new(&s.positions, &s.triangles, ctx)?.meeting(&all, ctx))
        .unwrap();
    assert!(met.is_empty(), "{name}: {} triangles meet", met.len());
}

/// The distance from a point to a surface.
fn distance(p: Vec3, s: &Surface) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|v| s.positions[v as usize]);
    let to = |t: &[u32; 3]| p.dist2(crate::spatial::triangle::closest_on_triangle(p, &corners(t)));
    s.triangles.iter().map(to).fold(f64::INFINITY, f64::min).sqrt()
}

#[test]
fn every_shape_with_holes_becomes_a_solid_that_follows_it() {
    for (name, open) in shapes() {
        let made = solid(&open, VOXEL, 0);
        check(name, &made.surface);
        // What is not marked lies on the surface, and near every vertex of the surface there is such a one.
        let known: Vec<Vec3> =
            made.surface.positions.iter().zip(&made.extrapolated).filter(|v| !v.1).map(|v| *v.0).collect();
        for &p in known.iter().step_by(7) {
            assert!(distance(p, &open) < 0.05 * VOXEL, "{name}: {}", distance(p, &open) / VOXEL);
        }
        for &p in open.positions.iter().step_by(13) {
            let near = known.iter().map(|q| p.dist2(*q)).fold(f64::INFINITY, f64::min).sqrt();
            // But at the bar of a strip that is turned over.
            let bar = name == "a Moebius strip" && p[0] > 0.1 && p[1].abs() < made.thickness;
            assert!(near < 2.0 * VOXEL || bar, "{name}: {} at {p:?}", near / VOXEL);
        }
        assert!(made.extrapolated.iter().any(|e| *e), "{name}");
    }
}

#[test]
fn a_plane_rim_is_closed_by_its_plane() {
    let bowl = ball(0.5 * PI, PI - 0.001);
    let made = solid(&bowl, VOXEL, 0);
    let half_ball = 2.0 / 3.0 * PI * 0.4f64.powi(3);
    assert!((volume(&made.surface) / half_ball - 1.0).abs() < 0.01, "{}", volume(&made.surface) / half_ball);
    assert!(!made.plates);
    for (p, invented) in made.surface.positions.iter().zip(&made.extrapolated) {
        assert!(!invented || p[2].abs() < VOXEL, "{p:?}");
    }
}

#[test]
fn what_encloses_nothing_becomes_as_thick_as_is_told() {
    let made = solid(&sheet(), VOXEL, 0);
    assert!(made.plates && made.thickness >= SOLID.thickness);
    let thick = volume(&made.surface) / 1.05 / made.thickness;
    assert!((0.5..1.1).contains(&thick), "{thick}");
    let above = made.surface.positions.iter().map(|p| p[2]).fold(f64::MIN, f64::max);
    assert!(above < 0.05 + VOXEL, "it lies behind the sheet: {above}");
}

#[test]
fn a_solid_stays_as_it_is_and_a_few_triangles_that_meet_are_moved_apart() {
    let torus = grid(60, 30, [true; 2], |u, v| {
        let (a, b) = (2.0 * PI * u, 2.0 * PI * v);
        let r = 0.3 + 0.15 * b.cos();
        Vec3([r * a.cos(), r * a.sin(), 0.15 * b.sin()])
    });
    let made = solid(&torus, VOXEL, 0);
    assert!(made.surface.positions == torus.positions && made.surface.triangles == torus.triangles);
    assert!(made.extrapolated.iter().all(|e| !e) && !made.plates);
    let mut tangled = torus.clone();
    let outward = Vec3([tangled.positions[40][0], tangled.positions[40][1], 0.0]);
    tangled.positions[40] += outward * 0.4;
    tangled.positions[41] += outward * -0.3;
    let made = solid(&tangled, VOXEL, 0);
    check("a tangled torus", &made.surface);
    assert_eq!(made.surface.triangles, torus.triangles);
}

#[test]
fn an_inward_facing_closed_surface_gets_walls() {
    let mut room = grid(60, 30, [true; 2], |u, v| {
        let (a, b) = (2.0 * PI * u, 2.0 * PI * v);
        let r = 0.3 + 0.15 * b.cos();
        Vec3([r * a.cos(), r * a.sin(), 0.15 * b.sin()])
    });
    room.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let made = solid(&room, VOXEL, 0);
    check("a closed room", &made.surface);
    assert!(made.plates);
}

#[test]
fn the_result_does_not_depend_on_the_threads() {
    for (name, open) in shapes() {
        let [one, three] = [1, 3].map(|threads| solid(&open, 2.0 * VOXEL, threads));
        assert!(one.surface.positions == three.surface.positions, "{name}");
        assert!(one.surface.triangles == three.surface.triangles && one.extrapolated == three.extrapolated);
        assert!(one.surface.normals == three.surface.normals, "{name}");
    }
}

#[test]
fn a_turned_input_gives_a_turned_solid() {
    let turn = |p: Vec3| {
        let (s, c) = 0.7f64.sin_cos();
        let q = Vec3([c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]]);
        Vec3([q[0], c * q[1] - s * q[2], s * q[1] + c * q[2]])
    };
    for (name, open) in shapes() {
        let (plain, turned) = (solid(&open, VOXEL, 0), solid(&moved(&open, turn), VOXEL, 0));
        let ratio = volume(&turned.surface) / volume(&plain.surface);
        assert!((ratio - 1.0).abs() < 0.03, "{name}: {ratio}");
        for &p in plain.surface.positions.iter().step_by(211) {
            let off = distance(turn(p), &turned.surface);
            assert!(off < 2.0 * VOXEL, "{name}: {} at {p:?}", off / VOXEL);
        }
    }
}
