//! Claims about scans that hold more than their surface: strays alone, in clumps, and depth in steps.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::numeric::rng::Rng;
use shapes::{off_sphere, rms, run, sphere, topology};

type Vec3 = [f64; 3];

/// A sphere of radius 1 with noise, and as many strays as `share` of its points: two thirds in clumps, the
/// others anywhere.
fn with_strays(share: f64) -> (Vec<Vec3>, usize) {
    let mut points = sphere(6000, 7).noisy(0.25, 7);
    let surface = points.len();
    let mut rng = Rng::new(8);
    let anywhere = |rng: &mut Rng| [0, 1, 2].map(|_| 1.6 * (2.0 * rng.uniform() - 1.0));
    let clumps: Vec<Vec3> = (0..8).map(|_| anywhere(&mut rng)).collect();
    for k in 0..(share * surface as f64) as usize {
        points.push(if k % 3 < 2 {
            clumps[k % clumps.len()].map(|c| c + 0.07 * rng.normal())
        } else {
            anywhere(&mut rng)
        });
    }
    (points, surface)
}

#[test]
fn strays_get_no_surface_and_change_that_of_the_rest_little() {
    let off = |share: f64| {
        let (points, surface) = with_strays(share);
        let out = run(&points).expect("a surface");
        let worst = out.surface.positions.iter().map(|p| off_sphere(p).abs()).fold(0.0, f64::max);
        (rms(out.points.positions[..surface].iter().map(off_sphere)), worst, topology(&out.surface).parts)
    };
    let (clean, _, _) = off(0.0);
    for share in [0.03, 0.1] {
        let (rms, worst, parts) = off(share);
        assert!(rms < 1.1 * clean && worst < 0.1 && parts == 1, "{share}: {rms} {clean} {worst} {parts}");
    }
}

#[test]
fn depth_in_steps_wider_than_the_spacing_is_a_smooth_surface() {
    // A slanted wavy sheet; its depth is rounded to steps, three to four spacings wide.
    let (step, mut rng) = (0.03, Rng::new(4));
    let height = |x: f64, y: f64| 0.6 * x + 0.1 * f64::sin(4.0 * y);
    let points: Vec<Vec3> = (0..8000)
        .map(|_| {
            let (x, y) = (rng.uniform(), 0.5 * rng.uniform());
            [x, y, f64::round(height(x, y) / step) * step]
        })
        .collect();
    let out = run(&points).expect("a surface");
    let off: Vec<f64> = out.points.positions.iter().map(|p| p[2] - height(p[0], p[1])).collect();
    let rounding = step / 12f64.sqrt();
    assert!((out.report.noise / rounding - 1.0).abs() < 0.5, "{} {rounding}", out.report.noise);
    assert!(rms(off.iter().copied()) < rounding, "{} {rounding}", rms(off.iter().copied()));
    // No stairs: the surface's normals are near those of the sheet.
    let steep = out.surface.normals.iter().flatten().filter(|n| n[2].abs() < 0.6).count();
    assert!(steep * 20 < out.surface.positions.len(), "{steep} of {}", out.surface.positions.len());
}
