//! Claims about registering: sweeps come together, what is known of nothing stays, derivatives are right.

use super::solve::{Equations, Pair, Part};
use super::{REGISTER, Registration, register};
use crate::error::Error;
use crate::geometry::Motion;
use crate::numeric::Rng;
use crate::numeric::vec3::Vec3;
use crate::run::Run;

const SIGMA: f64 = 0.004;

/// A bumpy ball of longest side about 2.
fn ball(rng: &mut Rng) -> Vec3 {
    let d = Vec3::from_fn(|_| rng.normal()).normalized();
    d * (0.9 + 0.1 * (5.0 * d[0]).sin() * (4.0 * d[1]).cos())
}

fn noisy(p: Vec3, rng: &mut Rng) -> Vec3 {
    p + Vec3::from_fn(|_| SIGMA * rng.normal())
}

fn found(points: &[Vec3], sweeps: &[u32], toward: &[Vec3]) -> Registration {
    Run::default().execute(|ctx| register(points, sweeps, toward, ctx)).expect("sweeps that overlap")
}

/// Half of the ball for each of six sweeps, each seen from another side and moved; the motions.
fn six(seed: u64, off: f64) -> (Vec<Vec3>, Vec<u32>, Vec<Motion>) {
    let mut rng = Rng::new(seed);
    let motions: Vec<Motion> = (0..6)
        .map(|_| {
            let mut any = || Vec3::from_fn(|_| off * rng.normal());
            Motion::new(any(), any())
        })
        .collect();
    let (mut points, mut sweeps) = (Vec::new(), Vec::new());
    while points.len() < 12_000 {
        let sweep = points.len() % 6;
        let p = ball(&mut rng);
        if p[sweep / 2] * [1.0, -1.0][sweep % 2] > -0.1 {
            points.push(motions[sweep].of(noisy(p, &mut rng)));
            sweeps.push(sweep as u32);
        }
    }
    (points, sweeps, motions)
}

/// How far sweeps are from one common motion along the normals, which are nearly the radii: root mean square
/// over places of the ball. (A slide along a ball is known less well, and matters less.)
fn misfit(registration: &Registration, made: &[Motion]) -> f64 {
    let mut rng = Rng::new(9);
    let places: Vec<Vec3> = (0..200).map(|_| ball(&mut rng)).collect();
    let moved = |s: usize, p: Vec3| registration.sweeps[s].motion.of(made[s].of(p));
    let apart = |p: &Vec3| -> f64 {
        let all: Vec<Vec3> = (0..made.len()).map(|s| moved(s, *p)).collect();
        let mean = all.iter().fold(Vec3::ZERO, |sum, p| sum + *p) * (1.0 / all.len() as f64);
        all.iter().map(|q| (*q - mean).dot(p.normalized()).powi(2)).sum::<f64>() / all.len() as f64
    };
    (places.iter().map(apart).sum::<f64>() / places.len() as f64).sqrt()
}

#[test]
fn sweeps_that_are_five_sigma_apart_come_together_to_a_sixth_of_sigma() {
    for seed in 0..3 {
        let (points, sweeps, made) = six(seed, 3.0 * SIGMA);
        let registration = found(&points, &sweeps, &[]);
        let off = misfit(&registration, &made);
        assert!(off < SIGMA / 6.0, "seed {seed}: {} sigma", off / SIGMA);
        assert!(registration.apart_after < 0.6 * registration.apart_before, "{registration:?}");
        assert!(registration.sweeps.iter().all(|s| s.points == 2000 && s.pairs > 100 && s.moved > 0.0));
    }
}

#[test]
fn sweeps_that_fit_stay_where_they_are() {
    let (points, sweeps, _) = six(4, 0.0);
    let registration = found(&points, &sweeps, &[]);
    assert!(registration.sweeps.iter().all(|s| s.motion == Motion::NONE && s.moved == 0.0));
    assert_eq!(registration.apart_before, registration.apart_after);
}

#[test]
fn the_result_follows_the_input_into_another_frame_and_unit() {
    let (points, sweeps, made) = six(5, 2.0 * SIGMA);
    let frame = Motion::new(Vec3([0.3, -0.9, 0.4]), Vec3([4e5, -2e5, 100.0]));
    let moved: Vec<Vec3> = points.iter().map(|p| frame.of(*p * 50.0)).collect();
    let (a, b) = (found(&points, &sweeps, &[]), found(&moved, &sweeps, &[]));
    for ((p, q), &s) in points.iter().zip(&moved).zip(&sweeps) {
        let there = frame.of(a.sweeps[s as usize].motion.of(*p) * 50.0);
        // Turned, other points are the ends of the axes: the frame differs a little.
        assert!(b.sweeps[s as usize].motion.of(*q).dist2(there).sqrt() < 50.0 * 0.1 * SIGMA);
    }
    let off = misfit(&a, &made);
    assert!(off < SIGMA / 6.0, "{} sigma", off / SIGMA);
}

#[test]
fn a_sweep_hardly_slides_along_a_plane_that_tells_nothing_of_it() {
    let mut rng = Rng::new(6);
    let points: Vec<Vec3> = (0..6000)
        .map(|i| {
            let z = SIGMA * rng.normal() + if i % 2 == 0 { 0.0 } else { 3.0 * SIGMA };
            Vec3([rng.uniform(), rng.uniform(), z])
        })
        .collect();
    let sweeps: Vec<u32> = (0..6000).map(|i| i % 2).collect();
    let registration = found(&points, &sweeps, &[]);
    let [a, b] = [0, 1].map(|s| registration.sweeps[s].motion.of(Vec3([0.5, 0.5, 0.0])));
    assert!((a[2] - b[2] - 3.0 * SIGMA).abs() < 0.2 * SIGMA, "{a:?} {b:?}");
    assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.5 * SIGMA, "{a:?} {b:?}");
}

#[test]
fn the_sides_of_a_plate_stay_apart_where_it_is_known_which_way_they_face() {
    let mut rng = Rng::new(7);
    // Each sweep sees a side of the plate, and a ball beside it that both see.
    let (mut points, mut sweeps, mut toward) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..8000 {
        let up = if i % 2 == 0 { 1.0 } else { -1.0 };
        let (p, normal) = if i % 4 < 2 {
            (Vec3([rng.uniform(), rng.uniform(), 0.005 * up]), Vec3([0.0, 0.0, up]))
        } else {
            let d = ball(&mut rng);
            (Vec3([2.5, 0.5, 0.0]) + d, d.normalized())
        };
        points.push(p + normal * (0.3 * SIGMA * rng.normal()));
        sweeps.push(u32::from(up < 0.0));
        toward.push(normal);
    }
    let thickness = |r: &Registration| {
        let [upper, lower] = [0, 1].map(|s| r.sweeps[s].motion.of(Vec3([0.2, 0.5, 0.0]))[2]);
        0.01 + upper - lower
    };
    let known = thickness(&found(&points, &sweeps, &toward));
    assert!((known - 0.01).abs() < 0.001, "{known}");
}

#[test]
fn the_equations_hold_the_derivatives_of_the_residuals() {
    let mut rng = Rng::new(8);
    let mut any = || Vec3::from_fn(|_| rng.normal());
    let (at, normal) = (any(), any().normalized());
    // A surface through a weighted mean of points of sweeps 1 and 2.
    let (places, shares) = ([any(), any()], [0.3, 0.7]);
    let residual = |motions: &[Motion; 3]| {
        let mean = motions[1].of(places[0]) * shares[0] + motions[2].of(places[1]) * shares[1];
        (motions[0].of(at) - mean).dot(normal)
    };
    let still = [Motion::NONE; 3];
    let part = |k: usize| Part { sweep: k as u32 + 1, weight: shares[k], at: places[k] * shares[k] };
    let parts = vec![part(0), part(1)];
    let pair = Pair { sweep: 0, at, parts, residual: residual(&still), normal, slopes: [Vec3::ZERO; 2] };
    let size = 2.0;
    let weight = (REGISTER.freedom + 1.0) / (REGISTER.freedom * size * size + pair.residual.powi(2));
    let gradient = Equations::of(std::slice::from_ref(&pair), 3, size).gradient();
    for unknown in 0..18 {
        let nudged = |by: f64| {
            let mut nudged = still;
            let part = |k: usize| Vec3::from_fn(|i| if unknown % 6 == k + i { by } else { 0.0 });
            nudged[unknown / 6] = Motion::new(part(0), part(3));
            residual(&nudged)
        };
        let slope = (nudged(1e-6) - nudged(-1e-6)) / 2e-6;
        assert!((gradient[unknown] - weight * pair.residual * slope).abs() < 1e-6, "unknown {unknown}");
    }
}

#[test]
fn what_cannot_be_registered_is_said() {
    let points: Vec<Vec3> = (0..200).map(|i| Vec3([f64::from(i % 20), f64::from(i / 20), 0.0])).collect();
    let fail = |points: &[Vec3], sweeps: &[u32]| {
        Run::default().execute(|ctx| register(points, sweeps, &[], ctx)).expect_err("nothing to register")
    };
    assert!(matches!(fail(&points, &[7; 200]), Error::InvalidArgument { .. }));
    assert!(matches!(fail(&points, &[7; 3]), Error::InvalidArgument { .. }));
    assert!(matches!(fail(&[], &[]), Error::InvalidArgument { .. }));
    let far: Vec<Vec3> = points
        .iter()
        .chain(&points)
        .enumerate()
        .map(|(i, p)| *p + Vec3([0.0, 0.0, if i < 200 { 0.0 } else { 15.0 }]))
        .collect();
    let two: Vec<u32> = (0..400).map(|i| i / 200).collect();
    assert!(matches!(fail(&far, &two), Error::Degenerate { .. }));
}

#[test]
fn sweeps_of_a_few_points_and_points_that_are_not_finite_stay() {
    let (mut points, mut sweeps, _) = six(10, SIGMA);
    points.extend([Vec3([0.1; 3]), Vec3([f64::NAN; 3])]);
    sweeps.extend([70, 0]);
    let registration = found(&points, &sweeps, &[]);
    let few = &registration.sweeps[6];
    assert_eq!((few.sweep, few.points, few.pairs, few.motion), (70, 1, 0, Motion::NONE));
    assert_eq!(registration.sweeps[0].points, 2000);
}
