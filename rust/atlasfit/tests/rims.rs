//! Claims about boundaries: they are smooth curves where the data end, not where voxels or noise leave them.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::Vec3;
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::rng::Rng;
use shapes::run;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Radii of a ring-shaped sheet, bent over a wide cylinder.
const INNER: f64 = 0.4;
const OUTER: f64 = 1.0;
const BEND: f64 = 2.0;

fn bent([x, y]: [f64; 2]) -> Vec3 {
    Vec3([BEND * (x / BEND).sin(), y, BEND * (x / BEND).cos()])
}

/// Points of the ring, even by area, with noise in all directions, in spacings.
fn noisy_ring(n: usize, noise: f64, seed: u64) -> (Vec<Vec3>, f64) {
    let spacing = (PI * (OUTER * OUTER - INNER * INNER) / n as f64).sqrt();
    let mut rng = Rng::new(seed);
    let points = (0..n).map(|_| {
        let r = (INNER * INNER + rng.uniform() * (OUTER * OUTER - INNER * INNER)).sqrt();
        let (s, c) = (TAU * rng.uniform()).sin_cos();
        bent([r * c, r * s]) + Vec3::from_fn(|_| noise * spacing * rng.normal())
    });
    (points.collect(), spacing)
}

/// The edges that only one triangle has.
fn boundary(mesh: &TriMesh) -> Vec<[Vec3; 2]> {
    let mut count = BTreeMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *count.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    let once = count.into_iter().filter(|(_, n)| *n == 1);
    once.map(|((a, b), _)| [a, b].map(|v| Vec3(mesh.positions[v as usize]))).collect()
}

/// Of boundaries about the cylinder's unrolled plane: how far they are from the nearer circle, root mean
/// square by length, and their length.
fn off(boundary: &[[Vec3; 2]]) -> (f64, f64) {
    let (mut sum, mut length) = (0.0, 0.0);
    for [a, b] in boundary {
        let p = (*a + *b) * 0.5;
        let r = (BEND * p[0].atan2(p[2])).hypot(p[1]);
        let way = (*b - *a).norm();
        sum += way * (r - INNER).abs().min((r - OUTER).abs()).powi(2);
        length += way;
    }
    ((sum / length).sqrt(), length)
}

#[test]
fn the_boundary_is_a_smooth_curve_at_the_end_of_the_data() {
    for (noise, most) in [(0.0, 0.25), (0.3, 0.25), (0.6, 0.35)] {
        let (points, spacing) = noisy_ring(8000, noise, 3);
        let out = run(&points.iter().map(|p| p.0).collect::<Vec<_>>()).expect("a sheet");
        assert_eq!((out.report.parts, out.report.boundary_loops), (1, 2), "{noise}");
        let (rms, length) = off(&boundary(&out.surface));
        let whole = TAU * (INNER + OUTER);
        assert!(rms < most * spacing, "{noise}: {} spacings", rms / spacing);
        assert!((length / whole - 1.0).abs() < 0.03, "{noise}: {length} for {whole}");
    }
}

#[test]
fn corners_of_a_sheet_stay() {
    let n = 4000;
    let spacing = 1.0 / f64::from(n).sqrt();
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..4 {
        let mut rng = Rng::new(seed);
        let point = |_| [rng.uniform(), rng.uniform(), 0.2 * spacing * rng.normal()];
        let points: Vec<_> = (0..n).map(point).collect();
        let boundary = boundary(&run(&points).expect("a sheet").surface);
        for corner in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
            let corner = Vec3([corner[0], corner[1], 0.0]);
            let nearest = |places: &mut dyn Iterator<Item = Vec3>| {
                places.map(|p| (p - corner).norm()).fold(f64::INFINITY, f64::min)
            };
            // Farther off than the nearest point by chance alone is no fault.
            let chance = nearest(&mut points.iter().map(|p| Vec3(*p)));
            sum += (nearest(&mut boundary.iter().flatten().copied()) - chance).max(0.0) / spacing;
            count += 1.0;
        }
    }
    assert!(sum / count < 0.4, "{} spacings", sum / count);
}
