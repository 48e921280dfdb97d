//! Claims about tubes: the chart's geometry, and that scans of thin tubes come out as tubes.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::atlas::Tube;
use atlasfit::atlas::tube::{HARMONICS, MASK_NODES};
use atlasfit::geometry::PointCloud;
use atlasfit::numeric::rng::Rng;
use atlasfit::{DenoiseOptions, Run, Vec3, denoise};

/// A bent tube with a radius that varies both ways.
fn bent() -> Tube {
    let mut radius = Box::new([[0f32; HARMONICS]; 11]);
    for (k, row) in radius.iter_mut().enumerate() {
        row[0] = 0.004 * (k as f32 * 0.6).sin();
        row[3] = 0.006;
        row[4] = 0.003 * (k as f32 * 0.4).cos();
    }
    Tube {
        center: Vec3([0.1, -0.2, 0.3]),
        axes: [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]].map(Vec3),
        half_length: 0.5,
        axis: [[0.0, 0.0, 0.06, 0.01], [0.0, 0.01, -0.04, 0.0]],
        mean_radius: 0.05,
        radius,
        mask: Box::new([255; MASK_NODES]),
    }
}

#[test]
fn the_nearest_point_lies_on_the_tube() {
    let (tube, mut rng) = (bent(), Rng::new(1));
    for _ in 0..200 {
        let c = tube.axis_at(1.6 * rng.uniform() - 0.8).position;
        let p = c.map(|x| x + 0.1 * (rng.uniform() - 0.5));
        let foot = tube.nearest(p);
        let again = tube.view(foot.position).expect("on the domain");
        assert!(again.distance.abs() < 1e-5, "{}", again.distance);
        assert!((tube.nearest(foot.position).position - foot.position).norm() < 1e-5);
    }
}

#[test]
fn the_normal_is_the_gradient_of_the_distance() {
    let (tube, mut rng) = (bent(), Rng::new(2));
    for _ in 0..200 {
        let c = tube.axis_at(1.6 * rng.uniform() - 0.8).position;
        let on = tube.nearest(c.map(|x| x + 0.1 * (rng.uniform() - 0.5))).position;
        let v = tube.view(on).expect("on the domain");
        let h = 1e-6;
        let g = Vec3::from_fn(|k| {
            let mut step = Vec3::ZERO;
            step[k] = h;
            let at = |s: f64| tube.view(on + step * s).unwrap().distance;
            (at(1.0) - at(-1.0)) / (2.0 * h)
        });
        assert!((g - v.normal).norm() < 0.01, "{g:?} {:?}", v.normal);
    }
}

/// Noisy points of a torus with radii 0.5 and 0.015.
fn torus(n: usize, sigma: f64) -> PointCloud {
    let mut rng = Rng::new(5);
    let points = (0..n)
        .map(|_| {
            let (a, b) = (std::f64::consts::TAU * rng.uniform(), std::f64::consts::TAU * rng.uniform());
            let r = 0.5 + 0.015 * b.cos();
            [
                r * a.cos() + sigma * rng.normal(),
                r * a.sin() + sigma * rng.normal(),
                0.015 * b.sin() + sigma * rng.normal(),
            ]
        })
        .collect();
    PointCloud::from_positions(points)
}
fn off_torus(p: [f64; 3]) -> f64 {
    ((p[0].hypot(p[1]) - 0.5).hypot(p[2]) - 0.015).abs()
}

#[test]
fn a_thin_torus_comes_out_whole_at_noise_below_and_above_its_radius() {
    for (sigma, limit) in [(0.002, 6e-4), (0.008, 1.5e-3), (0.018, 5e-3)] {
        let out = denoise(&torus(8000, sigma), &DenoiseOptions::default(), &mut Run::default()).unwrap();
        assert_eq!((out.report.parts, out.report.boundary_edges), (1, 0), "sigma {sigma}");
        let n = out.surface.positions.len() as f64;
        let rms = (out.surface.positions.iter().map(|&p| off_torus(p).powi(2)).sum::<f64>() / n).sqrt();
        assert!(rms < limit, "sigma {sigma}: rms {rms}");
        assert!((out.report.noise / sigma - 1.0).abs() < 0.25, "sigma {sigma}: noise {}", out.report.noise);
    }
}

#[test]
fn a_rod_ends_where_its_points_end() {
    let mut rng = Rng::new(8);
    let points: Vec<[f64; 3]> = (0..6000)
        .map(|_| {
            let a = std::f64::consts::TAU * rng.uniform();
            let x = rng.uniform();
            [
                x + 0.002 * rng.normal(),
                0.02 * a.cos() + 0.002 * rng.normal(),
                0.02 * a.sin() + 0.002 * rng.normal(),
            ]
        })
        .collect();
    let out = denoise(&PointCloud::from_positions(points), &DenoiseOptions::default(), &mut Run::default())
        .unwrap();
    let xs = out.surface.positions.iter().map(|p| p[0]);
    let (low, high) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    assert!(low.abs() < 0.02 && (high - 1.0).abs() < 0.02, "{low} {high}");
    assert_eq!(out.report.parts, 1);
}

/// Noisy points of a ball of radius 0.5 with a spike along each half axis, up to 1: its radius is 0.05 where
/// it leaves the ball and 0.006 at its tip. Points lie 0.02 apart.
fn spiked_ball(sigma: f64) -> PointCloud {
    let mut rng = Rng::new(11);
    let mut points = Vec::new();
    while points.len() < 7854 {
        let p: [f64; 3] = std::array::from_fn(|_| 2.0 * rng.uniform() - 1.0);
        let r = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let within = p.iter().any(|x| (r * r - x * x).sqrt() < 0.1 * r && r > 0.0);
        if (0.1..1.0).contains(&r) && !within {
            points.push(p.map(|x| 0.5 * x / r));
        }
    }
    for spike in 0..6 {
        for _ in 0..220 {
            // By area: more where it is thicker.
            let x = loop {
                let x = 0.5 + 0.5 * rng.uniform();
                if rng.uniform() * 0.05 < spike_radius(x) {
                    break x;
                }
            };
            let (r, a) = (spike_radius(x), std::f64::consts::TAU * rng.uniform());
            let mut p = [0.0; 3];
            p[spike % 3] = if spike < 3 { x } else { -x };
            p[(spike + 1) % 3] = r * a.cos();
            p[(spike + 2) % 3] = r * a.sin();
            points.push(p);
        }
    }
    points.iter_mut().flatten().for_each(|x| *x += sigma * rng.normal());
    PointCloud::from_positions(points)
}
fn spike_radius(x: f64) -> f64 {
    0.05 - 0.088 * (x - 0.5)
}

#[test]
fn spikes_taper_to_their_tips() {
    let out = denoise(&spiked_ball(0.004), &DenoiseOptions::default(), &mut Run::default()).unwrap();
    assert_eq!(out.report.parts, 1);
    let places = shapes::places(&out.surface);
    let mut off = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let of_spike = |p: &&[f64; 3]| side * p[axis] > 0.55;
            let reach =
                out.surface.positions.iter().filter(of_spike).map(|p| side * p[axis]).fold(0.0, f64::max);
            assert!((0.92..1.04).contains(&reach), "axis {axis}, side {side}: it ends at {reach}");
            let radius = |p: &[f64; 3]| p[(axis + 1) % 3].hypot(p[(axis + 2) % 3]);
            off.extend(places.iter().filter(of_spike).map(|p| radius(p) - spike_radius(side * p[axis])));
        }
    }
    let rms = (off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64).sqrt();
    assert!(rms < 0.003, "{rms}");
}

#[test]
fn a_gutter_and_a_ribbon_are_no_tubes() {
    let mut rng = Rng::new(9);
    for shape in 0..2 {
        let points: Vec<[f64; 3]> = (0..6000)
            .map(|_| {
                let (x, t) = (rng.uniform(), rng.uniform());
                let (y, z) = if shape == 0 {
                    // Half a circle.
                    let a = std::f64::consts::PI * t;
                    (0.03 * a.cos(), 0.03 * a.sin())
                } else {
                    (0.06 * (t - 0.5), 0.0)
                };
                [x + 0.001 * rng.normal(), y + 0.001 * rng.normal(), z + 0.001 * rng.normal()]
            })
            .collect();
        let out =
            denoise(&PointCloud::from_positions(points), &DenoiseOptions::default(), &mut Run::default())
                .unwrap();
        let tubes = out.charts.iter().filter(|c| matches!(c.map, atlasfit::atlas::Map::Tube(_))).count();
        assert_eq!(tubes, 0, "shape {shape}");
        assert_eq!(out.report.boundary_loops, 1, "shape {shape}");
    }
}

#[test]
fn points_face_the_same_way_as_the_surface_outward() {
    let mut rng = Rng::new(11);
    let points: Vec<[f64; 3]> = (0..6000)
        .map(|_| {
            let p = [rng.normal(), rng.normal(), rng.normal()];
            let r = Vec3(p).norm();
            p.map(|x| x / r + 0.01 * rng.normal())
        })
        .collect();
    let out = denoise(&PointCloud::from_positions(points), &DenoiseOptions::default(), &mut Run::default())
        .unwrap();
    let normals = out.points.normals.as_ref().unwrap();
    let outward = |p: &[f64; 3], n: &[f32; 3]| (0..3).map(|k| p[k] * f64::from(n[k])).sum::<f64>() > 0.0;
    assert!(out.points.positions.iter().zip(normals).all(|(p, n)| outward(p, n)));
    assert!(
        out.surface.positions.iter().zip(out.surface.normals.as_ref().unwrap()).all(|(p, n)| outward(p, n))
    );
}

#[test]
fn a_rod_thinner_than_the_voxels_keeps_its_surface() {
    // A third of a voxel thick, beside a ball whose spacing makes the voxels.
    let (radius, mut rng) = (0.012, Rng::new(3));
    let mut points = shapes::sphere(6000, 3).noisy(0.2, 4);
    points.extend((0..300).map(|_| {
        let (x, a) = (1.5 + 4.0 * rng.uniform(), std::f64::consts::TAU * rng.uniform());
        let r = radius + 0.003 * rng.normal();
        [x, r * a.cos(), r * a.sin()]
    }));
    let out = shapes::run(&points).expect("a surface");
    let along = (0..35).map(|k| 1.7 + 0.1 * f64::from(k));
    let near = |x: f64| {
        let to = |p: &[f64; 3]| (p[0] - x).hypot(p[1]).hypot(p[2]);
        out.surface.positions.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    let bare: Vec<f64> = along.filter(|&x| near(x) > 0.06).collect();
    assert!(bare.is_empty(), "{bare:?}");
    let rod = out.surface.positions.iter().filter(|p| p[0] > 1.7);
    let off = shapes::rms(rod.map(|p| p[1].hypot(p[2]) - radius));
    assert!(off < 0.02, "{off}");
}
