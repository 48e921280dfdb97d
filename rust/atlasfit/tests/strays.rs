//! Claims about scans that hold more than their surface: strays alone, in clumps, and depth in steps.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::numeric::rng::Rng;
use shapes::{norm, off_sphere, places, rms, run, sphere, topology, torus};

type Vec3 = [f64; 3];

/// Adds as many strays as `share` of the points: two thirds in clumps, the others anywhere.
fn add_strays(points: &mut Vec<Vec3>, share: f64) {
    add_strays_in_clumps(points, share, 8, 0.07, 8);
}

/// As [`add_strays`], in so many clumps of a standard deviation of `width`.
fn add_strays_in_clumps(points: &mut Vec<Vec3>, share: f64, clumps: usize, width: f64, seed: u64) {
    let surface = points.len();
    let mut rng = Rng::new(seed);
    let anywhere = |rng: &mut Rng| [0, 1, 2].map(|_| 1.6 * (2.0 * rng.uniform() - 1.0));
    let clumps: Vec<Vec3> = (0..clumps).map(|_| anywhere(&mut rng)).collect();
    for k in 0..(share * surface as f64) as usize {
        points.push(if k % 3 < 2 {
            clumps[k % clumps.len()].map(|c| c + width * rng.normal())
        } else {
            anywhere(&mut rng)
        });
    }
}

#[test]
fn strays_get_no_surface_and_change_that_of_the_rest_little() {
    let off = |share: f64| {
        let mut points = sphere(6000, 7).noisy(0.25, 7);
        let surface = points.len();
        add_strays(&mut points, share);
        let out = run(&points).expect("a surface");
        let far = out.surface.positions.iter().filter(|p| off_sphere(p).abs() > 0.05).count();
        let far = far as f64 / out.surface.positions.len() as f64;
        (rms(out.points.positions[..surface].iter().map(off_sphere)), far, topology(&out.surface).parts)
    };
    let (clean, _, _) = off(0.0);
    for share in [0.03, 0.1] {
        let (rms, far, parts) = off(share);
        // One clump lies on the sphere.
        assert!(rms < 1.1 * clean && far < 0.02 && parts == 1, "{share}: {rms} {clean} {far} {parts}");
    }
}

#[test]
fn clumps_of_strays_about_thin_walls_get_no_surface() {
    // Both sides of a wall and strays make the first estimate of the noise three times too large: clumps look
    // like tubes of that noise, and clumps near the wall like its other side.
    let wall = 0.1;
    for seed in 0..3 {
        let [mut points, inner] = [2 * seed, 2 * seed + 1].map(|seed| sphere(8000, seed).noisy(0.5, seed));
        points.extend(inner.iter().map(|p| p.map(|x| x * (1.0 - wall / norm(*p)))));
        add_strays_in_clumps(&mut points, 0.1, 12, 0.06, seed);
        let out = run(&points).expect("a surface");
        let off = |p: &Vec3| off_sphere(p).abs().min((norm(*p) - 1.0 + wall).abs());
        let far = out.surface.positions.iter().filter(|p| off(p) > 0.06).count();
        let (all, parts) = (out.surface.positions.len(), topology(&out.surface).parts);
        assert!(far * 200 < all && parts <= 2, "{seed}: {far} of {all} vertices, {parts} parts");
    }
}

#[test]
fn clumps_as_wide_as_charts_far_from_the_surface_get_none() {
    // Charts laid through such a clump in many directions each find points about themselves.
    let girth = 0.3;
    for seed in 0..4 {
        let ring = torus(9000, girth, seed);
        let mut points = ring.noisy(0.5, seed);
        add_strays_in_clumps(&mut points, 0.2, 12, 0.08, seed);
        let out = run(&points).expect("a surface");
        let off = |p: &Vec3| ((p[0].hypot(p[1]) - 1.0).hypot(p[2]) - girth).abs();
        let far = out.surface.positions.iter().filter(|p| off(p) > 2.5 * ring.spacing).count();
        let (all, parts) = (out.surface.positions.len(), topology(&out.surface).parts);
        assert!(far * 100 < all && parts == 1, "{seed}: {far} of {all} vertices, {parts} parts");
    }
}

#[test]
fn strays_about_a_rope_are_not_joined_with_it() {
    // Slabs through it, from one stray to the next, hold many of its points.
    let girth = 0.12;
    let rope = torus(9000, girth, 5);
    let mut points = rope.noisy(0.5, 5);
    add_strays(&mut points, 0.25);
    let out = run(&points).expect("a surface");
    let off = |p: &Vec3| ((p[0].hypot(p[1]) - 1.0).hypot(p[2]) - girth).abs();
    let far = out.surface.positions.iter().filter(|p| off(p) > 2.5 * rope.spacing).count();
    assert_eq!(topology(&out.surface).parts, 1);
    assert!(far * 100 < out.surface.positions.len(), "{far} of {}", out.surface.positions.len());
}

#[test]
fn strays_about_flat_walls_take_few_of_their_points() {
    // A patch that grows from a stray, with ever more noise, would hold most points of a wall.
    let half: Vec3 = [0.7, 0.5, 0.2];
    let mut rng = Rng::new(2);
    let inside = |rng: &mut Rng, half: Vec3| half.map(|h| h * (2.0 * rng.uniform() - 1.0));
    let mut points: Vec<Vec3> = (0..12_000)
        .map(|_| {
            let mut p = inside(&mut rng, half);
            // The faces' shares of the area.
            let k = [0.17, 0.41, 1.0].iter().position(|&u| rng.uniform() < u).unwrap_or(2);
            p[k] = half[k].copysign(p[k]);
            p.map(|x| x + 0.007 * rng.normal())
        })
        .collect();
    let about = half.map(|h| 1.15 * h + 0.1);
    let clumps: Vec<Vec3> = (0..8).map(|_| inside(&mut rng, about)).collect();
    for k in 0..3000 {
        points.push(match k % 2 {
            0 => inside(&mut rng, about),
            _ => clumps[k / 2 % clumps.len()].map(|c| c + 0.028 * rng.normal()),
        });
    }
    let out = run(&points).expect("a surface");
    let off = |p: &Vec3| {
        let q = [0, 1, 2].map(|k| p[k].abs() - half[k]);
        let outside = norm(q.map(|x| x.max(0.0)));
        if outside > 0.0 { outside } else { -q.iter().fold(f64::MIN, |m, x| m.max(*x)) }
    };
    let far = out.surface.positions.iter().filter(|p| off(p) > 0.05).count();
    let all = out.surface.positions.len();
    assert!(far * 100 < all, "{far} of {all}");
}

#[test]
fn the_noise_of_depth_in_steps_is_known_and_the_surface_is_smoother_than_the_steps() {
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
    let surface = rms(places(&out.surface).iter().map(|p| p[2] - height(p[0], p[1])));
    assert!(rms(off.iter().copied()) < rounding && surface < 0.8 * rounding, "{surface} {rounding}");
}
