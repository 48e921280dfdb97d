//! Claims about what a change of frame, order or threads changes in a default run.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::{DenoiseOptions, Run, denoise};
use shapes::*;

#[test]
fn figures_scale_and_move_with_the_scan() {
    let points = sphere(2000, 13).noisy(0.3, 13);
    let base = run(&points).unwrap();
    for (scale, shift) in [(1e-9, 0.0), (1e9, 0.0), (1e-3, 1e6), (1.0, 1e6)] {
        let moved: Vec<Vec3> = points.iter().map(|p| p.map(|x| x * scale + shift)).collect();
        let out = run(&moved).unwrap();
        // What the shift rounds away from the input, in the unit of the unscaled scan.
        let rounding = shift * f64::EPSILON / scale;
        for (a, b) in [
            (base.report.spacing, out.report.spacing),
            (base.report.noise, out.report.noise),
            (base.report.voxel, out.report.voxel),
        ] {
            assert!(
                (b / scale / a - 1.0).abs() < 1e-6 + 100.0 * rounding / a,
                "scale {scale}, shift {shift}: {a} {b}"
            );
        }
        let back = |q: &Vec3| q.map(|x| (x - shift) / scale);
        let apart =
            rms(base.points.positions.iter().zip(&out.points.positions).map(|(p, q)| norm(sub(*p, back(q)))));
        assert!(apart < 0.03 * base.report.spacing, "scale {scale}, shift {shift}: {apart}");
        assert_eq!(topology(&out.surface).euler, 2, "scale {scale}, shift {shift}");
    }
}

#[test]
fn a_powers_of_two_scale_changes_no_bit() {
    let points = torus(2000, 0.4, 14).noisy(0.3, 14);
    let twice: Vec<Vec3> = points.iter().map(|p| p.map(|x| x * 1024.0)).collect();
    let (a, b) = (run(&points).unwrap(), run(&twice).unwrap());
    assert!(a.points.positions.iter().zip(&b.points.positions).all(|(p, q)| p.map(|x| x * 1024.0) == *q));
    assert_eq!(a.surface.triangles, b.surface.triangles);
}

#[test]
fn millimetres_a_thousand_kilometres_off_the_origin_are_still_there() {
    // A sphere one metre wide in a national grid: 30 mm between points, 6 mm of noise, rounding of 1e-10 m.
    let truth = sphere(3000, 15);
    let far = [4.5e6, 5.2e6, 1e6];
    let points: Vec<Vec3> =
        truth.noisy(0.2, 15).iter().map(|p| [0, 1, 2].map(|k| 0.5 * p[k] + far[k])).collect();
    let out = run(&points).unwrap();
    let error = rms(out.points.positions.iter().map(|p| norm(sub(*p, far)) - 0.5));
    assert!(error < 0.5 * 0.2 * 0.5 * truth.spacing, "{error} m");
    assert_eq!(topology(&out.surface).euler, 2);
}

#[test]
fn figures_and_accuracy_follow_a_rotation() {
    let truth = torus(3000, 0.4, 16);
    let points = truth.noisy(0.4, 16);
    let a = run(&points).unwrap();
    let b = run(&points.iter().map(turned).collect::<Vec<_>>()).unwrap();
    let close = |x: f64, y: f64, tolerance: f64| assert!((y / x - 1.0).abs() < tolerance, "{x} and {y}");
    close(a.report.spacing, b.report.spacing, 1e-3);
    close(a.report.noise, b.report.noise, 0.02);
    close(a.report.charts as f64, b.report.charts as f64, 0.1);
    close(volume(&a.surface), volume(&b.surface), 0.01);
    let error = |positions: &[Vec3]| rms(positions.iter().map(|p| off_torus(p, 0.4)));
    let straight: Vec<Vec3> = b
        .points
        .positions
        .iter()
        .map(|p| {
            // Back by the inverse rotation: the forward one is orthogonal, so its transpose.
            let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| turned(&e));
            columns.map(|c| c[0] * p[0] + c[1] * p[1] + c[2] * p[2])
        })
        .collect();
    close(error(&a.points.positions), error(&straight), 0.15);
    assert_eq!(topology(&b.surface).euler, 0);
}

#[test]
fn the_order_of_the_points_hardly_matters() {
    let truth = sphere(3000, 17);
    let points = truth.noisy(0.4, 17);
    let mut order: Vec<usize> = (0..points.len()).collect();
    let mut rng = atlasfit::numeric::rng::Rng::new(17);
    for i in (1..order.len()).rev() {
        order.swap(i, rng.below(i + 1));
    }
    let a = run(&points).unwrap();
    let b = run(&order.iter().map(|&i| points[i]).collect::<Vec<_>>()).unwrap();
    let mut back = vec![[0.0; 3]; points.len()];
    for (k, &i) in order.iter().enumerate() {
        back[i] = b.points.positions[k];
    }
    // Seeds of charts follow the order of the points, so the charts are others: the two fits agree to within
    // a third of the noise.
    let apart = rms(a.points.positions.iter().zip(&back).map(|(p, q)| norm(sub(*p, *q))));
    assert!(apart < 0.33 * 0.4 * truth.spacing, "{}", apart / truth.spacing);
    assert!((a.report.noise / b.report.noise - 1.0).abs() < 0.1);
    assert_eq!(topology(&b.surface).euler, 2);
}

#[test]
fn the_same_scan_and_seed_give_the_same_bytes_for_any_number_of_threads() {
    let points = cloud(&moebius(2500, 0.35, 18).noisy(0.3, 18));
    let bits = |threads: usize, seed: u64| {
        let mut run = Run { threads, seed, ..Run::default() };
        let out = denoise(&points, &DenoiseOptions::default(), &mut run).unwrap();
        let p: Vec<u64> = out
            .points
            .positions
            .iter()
            .chain(&out.surface.positions)
            .flatten()
            .map(|x| x.to_bits())
            .collect();
        let normals = |n: &Option<Vec<[f32; 3]>>| -> Vec<u32> {
            n.iter().flatten().flatten().map(|x| x.to_bits()).collect()
        };
        let uv: Vec<u32> =
            out.surface.corner_uv.iter().flatten().flatten().flatten().map(|x| x.to_bits()).collect();
        let mut report = out.report;
        report.seconds.clear();
        (
            p,
            normals(&out.points.normals),
            normals(&out.surface.normals),
            uv,
            out.surface.triangles,
            out.surface.face_chart,
            report,
        )
    };
    let one = bits(1, 5);
    for threads in [1, 2, 3] {
        assert!(bits(threads, 5) == one, "{threads} threads");
    }
    assert!(bits(2, 6).0 != one.0, "the seed matters");
}
