//! Claims about edges: a box keeps them, turned or not.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::geometry::PointCloud;
use atlasfit::measure::{DistanceOptions, points_each};
use atlasfit::numeric::rng::Rng;
use atlasfit::{Run, Vec3};
use shapes::{rms, run, topology};

/// Half the sides of the box.
const HALF: [f64; 3] = [0.5, 0.3, 0.2];
const NOISE: f64 = 0.002;

/// Points of the box, even by area, with noise.
fn noisy_box(n: usize) -> Vec<Vec3> {
    let mut rng = Rng::new(7);
    let area = |k: usize| HALF[(k + 1) % 3] * HALF[(k + 2) % 3];
    let all = area(0) + area(1) + area(2);
    (0..n)
        .map(|_| {
            let mut p = HALF.map(|h| h * (2.0 * rng.uniform() - 1.0));
            let at = rng.uniform() * all;
            let axis = if at < area(0) { 0 } else { 1 + usize::from(at > area(0) + area(1)) };
            p[axis] = if rng.uniform() < 0.5 { -HALF[axis] } else { HALF[axis] };
            Vec3(p.map(|x| x + NOISE * rng.normal()))
        })
        .collect()
}

/// Places along the box's edges, away from its corners.
fn edges() -> Vec<Vec3> {
    let mut out = Vec::new();
    for axis in 0..3 {
        for signs in 0..4 {
            for k in -20..=20 {
                let mut p = HALF;
                p[axis] *= 0.9 * f64::from(k) / 20.0;
                p[(axis + 1) % 3] *= if signs & 1 == 0 { 1.0 } else { -1.0 };
                p[(axis + 2) % 3] *= if signs & 2 == 0 { 1.0 } else { -1.0 };
                out.push(Vec3(p));
            }
        }
    }
    out
}

/// A rotation about (1, 1, 1) and an axis of the box.
fn turned(p: Vec3) -> Vec3 {
    let [x, y, z] = p.0;
    let (s, c) = 0.7f64.sin_cos();
    Vec3([z, c * x - s * y, s * x + c * y])
}

#[test]
fn a_box_keeps_its_edges_however_it_is_turned() {
    let points = noisy_box(16_000);
    for turn in [|p| p, turned] {
        let scan: Vec<[f64; 3]> = points.iter().map(|&p| turn(p).0).collect();
        let out = run(&scan).expect("a surface");
        let t = topology(&out.surface);
        assert_eq!((t.parts, t.boundary_edges, t.genus), (1, 0, Some(0)), "{t:?}");
        let places = PointCloud::from_positions(edges().into_iter().map(|p| turn(p).0).collect());
        let options = DistanceOptions::default();
        let (_, distances) = Run::default()
            .execute(|ctx| points_each(&places, &out.surface, &options, ctx))
            .expect("distances");
        let off = rms(distances);
        // With vertices in the middle of what crosses their voxels: 3 times the noise.
        assert!(off < 2.3 * NOISE, "{off}");
    }
}
