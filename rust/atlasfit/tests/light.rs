//! Claims about the number and the shape of the triangles that a surface has when nobody asks for a number.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::geometry::TriMesh;
use atlasfit::{DenoiseOptions, Denoised, Run, denoise, measure};
use shapes::*;

fn with(points: &[Vec3], options: &DenoiseOptions) -> Denoised {
    denoise(&cloud(points), options, &mut Run::default()).unwrap()
}

/// Share of the triangles with an angle below 20 degrees.
fn needles(mesh: &TriMesh) -> f64 {
    let sharp = |t: &&[u32; 3]| {
        let corners = t.map(|v| atlasfit::Vec3(mesh.positions[v as usize]));
        (0..3).any(|k| {
            let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
            (b - a).normalized().dot((c - a).normalized()) > 20f64.to_radians().cos()
        })
    };
    mesh.triangles.iter().filter(sharp).count() as f64 / mesh.triangles.len() as f64
}

#[test]
fn a_surface_has_about_as_many_triangles_as_points_and_is_the_dense_one_within_its_uncertainty() {
    let closed = sphere(4000, 1).noisy(0.5, 1);
    // An open sheet with a bump.
    let open: Vec<Vec3> =
        jittered(4000).iter().map(|&[x, y]| [x, y, 0.3 * (-8.0 * (x * x + y * y)).exp()]).collect();
    for points in [closed, open] {
        let light = with(&points, &plain());
        let dense = with(&points, &plain().with_max_error(Some(0.0)));
        let (few, many) = (light.surface.triangles.len(), dense.surface.triangles.len());
        assert!(few <= 6 * points.len() / 5 && many > 3 * points.len(), "{few} {many}");
        let [a, b] = [&light, &dense].map(|d| topology(&d.surface));
        assert_eq!((a.euler, a.parts, a.boundary_loops), (b.euler, b.parts, b.boundary_loops));
        let error = (light.report.noise / 4.0).max(light.report.spacing / 20.0);
        let options = measure::DistanceOptions::default().with_samples(20_000).with_chamfer_samples(100);
        let apart = Run::default()
            .execute(|ctx| measure::surface(&light.surface, &dense.surface, &options, ctx))
            .unwrap();
        // The spacing differs from place to place.
        for way in [&apart.accuracy, &apart.completeness] {
            assert!(way.rms < 0.5 * error && way.max < 2.0 * error, "{way:?} {error}");
        }
        assert!(apart.normal_orientation > 0.995, "{}", apart.normal_orientation);
        assert!(needles(&light.surface) < 0.01, "{}", needles(&light.surface));
    }
}

/// Random points of the square from -1 to 1, jittered on a grid.
fn jittered(count: usize) -> Vec<[f64; 2]> {
    let side = (count as f64).sqrt() as usize;
    let mut rng = atlasfit::numeric::Rng::new(5);
    let mut at = |k: usize| 2.0 * (k as f64 + 0.5 + 0.2 * rng.normal()) / side as f64 - 1.0;
    (0..side * side).map(|k| [at(k / side), at(k % side)]).collect()
}

#[test]
fn detail_says_how_many_triangles_there_are() {
    let points = sphere(3000, 2).noisy(0.3, 2);
    let at = |detail| with(&points, &plain().with_detail(detail)).surface.triangles.len() as f64;
    let (coarse, usual, fine) = (at(0.6), at(1.0), at(1.6));
    assert!(coarse < 0.6 * usual && fine > 1.8 * usual, "{coarse} {usual} {fine}");
}

#[test]
fn colours_and_labels_are_those_of_the_points_near_by() {
    let points = sphere(3000, 3).noisy(0.3, 3);
    let mut scan = cloud(&points);
    let red = |p: &Vec3| (0.5 + 0.5 * p[2]) as f32;
    scan.colors = Some(points.iter().map(|p| [red(p), 0.0, 0.0, 1.0]).collect());
    let out = denoise(&scan, &plain(), &mut Run::default()).unwrap();
    let colors = out.surface.colors.as_ref().unwrap();
    for (p, c) in out.surface.positions.iter().zip(colors) {
        assert!((c[0] - red(p)).abs() < 0.1, "{p:?} {c:?}");
    }
    let normals = out.surface.normals.as_ref().unwrap();
    for (p, n) in out.surface.positions.iter().zip(normals) {
        let [p, n] = [atlasfit::Vec3(*p), atlasfit::Vec3(n.map(f64::from))];
        assert!(n.dot(p.normalized()) > 0.97 && (n.norm() - 1.0).abs() < 1e-5, "{p:?} {n:?}");
    }
}
