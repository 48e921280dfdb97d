//! Vessels and aircraft.

use super::build::Build;
use super::furniture::{between, chance};
use super::loft::{Loft, Ring};
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;

/// Slots: 0 outside, 1 inside, 2 and 3 handles, 4 spout, 5 lid, 6 knob.
pub(super) fn vessel(build: &mut Build, rng: &mut Rng) {
    let high = between(rng, 0.5, 1.5);
    let belly = between(rng, 0.25, 0.6);
    let at = between(rng, 0.25, 0.7);
    let (foot, neck) = (belly * between(rng, 0.4, 0.9), belly * between(rng, 0.25, 1.1));
    let lip = neck * between(rng, 1.0, 1.3);
    // A smooth profile through foot, belly, neck, lip (Catmull and Rom).
    let knots = [[foot, 0.0], [foot, 0.0], [belly, at * high], [neck, 0.9 * high], [lip, high], [lip, high]];
    let mut outside = Vec::new();
    for k in 0..3 {
        for i in 0..5 {
            let t = f64::from(i) / 5.0;
            outside.push([0, 1].map(|d| catmull([0, 1, 2, 3].map(|j| knots[k + j][d]), t)));
        }
    }
    outside.push([lip, high]);
    for p in &mut outside {
        p[0] = p[0].max(0.04);
    }
    let wall = 0.03;
    let inside = |p: &[f64; 2]| [(p[0] - wall).max(0.01), p[1].max(wall)];
    let inner: Vec<[f64; 2]> = outside.iter().rev().map(inside).collect();
    let radius = |y: f64| {
        let i = outside.partition_point(|p| p[1] < y).clamp(1, outside.len() - 1);
        outside[i - 1][0].max(outside[i][0])
    };
    let bottom = vec![[0.0, 0.0]].into_iter().chain(outside.iter().copied()).collect::<Vec<_>>();
    build.add(0, Loft::turned([0.0; 2], &bottom, false));
    let lid = chance(rng, 0.25);
    if !lid {
        let inner: Vec<[f64; 2]> = inner.into_iter().chain([[0.0, wall]]).collect();
        build.add(1, Loft::turned([0.0; 2], &inner, false));
    } else {
        build.add(
            5,
            Loft::turned([0.0; 2], &[[lip, high], [lip * 0.6, high * 1.06], [0.0, high * 1.09]], false),
        );
        build.add(
            6,
            Loft::turned([0.0; 2], &[[0.03, high * 1.07], [0.06, high * 1.13], [0.03, high * 1.18]], true),
        );
    }
    let handles = rng.below(3);
    let (low, top) = (high * between(rng, 0.25, 0.4), high * between(rng, 0.65, 0.85));
    let out = between(rng, 0.15, 0.3);
    for i in 0..handles {
        let side = if i == 0 { 1.0 } else { -1.0 };
        let line: Vec<Vec3> = (0..7)
            .map(|k| {
                let t = f64::from(k) / 6.0;
                let y = low + (top - low) * t;
                let edge = radius(low) * (1.0 - t) + radius(top) * t - 0.02;
                Vec3([side * (edge + out * (std::f64::consts::PI * t).sin()), y, 0.0])
            })
            .collect();
        build.add(2 + i as u8, Loft::bar(&line, &[between(rng, 0.02, 0.045)], false));
    }
    if handles < 2 && chance(rng, 0.4) {
        let y = high * between(rng, 0.3, 0.6);
        let start = Vec3([-radius(y) + 0.04, y, 0.0]);
        let end = Vec3([-radius(y) - between(rng, 0.2, 0.4), high * between(rng, 0.75, 1.0), 0.0]);
        build.add(4, Loft::bar(&[start, start * 0.4 + end * 0.6, end], &[0.08, 0.05, 0.03], false));
    }
}

/// Between the second and the third of four values.
fn catmull([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    0.5 * (2.0 * b
        + (c - a) * t
        + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
        + (3.0 * b - 3.0 * c + d - a) * t * t * t)
}

/// A wing from a root to a tip: chords along z, thickness along `thick`.
fn wing(root: Vec3, tip: Vec3, chords: [f64; 2], thick: Vec3) -> Loft {
    let ring = |centre: Vec3, chord: f64| Ring {
        centre,
        axes: [Vec3([0.0, 0.0, 0.5 * chord]), thick * (0.06 * chord)],
    };
    Loft::closed(vec![ring(root, chords[0]), ring(tip, chords[1])], false)
}

/// Slots: 0 body, 1 and 2 wings, 3 and 4 tail, 5 fin, 6 to 9 engines, 10 and 11 struts of a second pair of
/// wings 12 and 13, 14 propeller.
pub(super) fn aircraft(build: &mut Build, rng: &mut Rng) {
    let long = 1.0;
    let thick = between(rng, 0.05, 0.11);
    let body = [[0.15, -0.5], [0.75, -0.42], [1.0, -0.2], [1.0, 0.15], [0.6, 0.38], [0.2, 0.5]];
    let rings = body.map(|[r, z]| Ring {
        centre: Vec3([0.0, if z > 0.2 { 0.3 * thick * (z - 0.2) / 0.3 } else { 0.0 }, -z * long]),
        axes: [Vec3([r * thick, 0.0, 0.0]), Vec3([0.0, r * thick, 0.0])],
    });
    build.add(0, Loft::closed(rings.to_vec(), false));
    let span = between(rng, 0.35, 0.65);
    let sweep = between(rng, -0.05, 0.3);
    let root = between(rng, 0.14, 0.3);
    let tip = root * between(rng, 0.25, 0.9);
    let up = Vec3([0.0, 1.0, 0.0]);
    let level = if chance(rng, 0.4) { 0.8 * thick } else { -0.5 * thick };
    let dihedral = between(rng, -0.02, 0.08);
    let z = between(rng, -0.05, 0.1);
    for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
        let end = Vec3([x * span, level + dihedral, z - sweep]);
        build.add(1 + i as u8, wing(Vec3([0.0, level, z]), end, [root, tip], up));
    }
    if chance(rng, 0.2) && sweep < 0.1 {
        let above = level + between(rng, 0.12, 0.2);
        for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
            let end = Vec3([x * span, above + dihedral, z - sweep]);
            build.add(12 + i as u8, wing(Vec3([0.0, above, z]), end, [root, tip], up));
            let at = |y: f64| Vec3([0.7 * x * span, y + 0.7 * dihedral, z - 0.7 * sweep]);
            build.add(10 + i as u8, Loft::bar(&[at(level), at(above)], &[0.01], false));
        }
    }
    let tail = -0.45 * long;
    let high = between(rng, 0.1, 0.22);
    build.add(
        5,
        wing(
            Vec3([0.0, 0.3 * thick, tail + 0.05]),
            Vec3([0.0, thick + high, tail - 0.02]),
            [0.16, 0.09],
            Vec3([1.0, 0.0, 0.0]),
        ),
    );
    let level_of_tail = if chance(rng, 0.3) { thick + high } else { 0.4 * thick };
    for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
        let end = Vec3([x * span * 0.4, level_of_tail, tail - 0.3 * sweep]);
        build.add(3 + i as u8, wing(Vec3([0.0, level_of_tail, tail + 0.03]), end, [0.14, 0.08], up));
    }
    let engines = [0, 2, 4][rng.below(3)];
    for i in 0..engines {
        let x = (if i % 2 == 0 { -1.0 } else { 1.0 }) * span * if i < 2 { 0.35 } else { 0.65 };
        let share = x.abs() / span;
        let at = |dz: f64| Vec3([x, level - 0.05 + dihedral * share, z - sweep * share + dz]);
        build.add(6 + i as u8, Loft::bar(&[at(-0.03), at(0.05), at(0.12)], &[0.018, 0.03, 0.026], false));
    }
    if engines == 0 && chance(rng, 0.6) {
        let nose = 0.5 * long + 0.01;
        build.add(14, Loft::block([0.0, 0.0, nose], [0.012, between(rng, 0.08, 0.14), 0.006]));
    }
}
