//! Claims about hard input: whatever the points are, a run ends in a sound result or in an error that says
//! what to do.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::numeric::rng::Rng;
use atlasfit::{DenoiseOptions, Denoised, Error, Progress, Result, Run, Stage, denoise};
use proptest::prelude::*;
use shapes::{cloud, norm, off_sphere, plain, rms, run, sphere, sub, topology};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

type Vec3 = [f64; 3];

/// What every result has, whatever the scan.
fn sound(given: &[Vec3], out: &Denoised) {
    let r = &out.report;
    assert_eq!((r.points, out.points.len()), (given.len(), given.len()));
    let finite = |p: &Vec3| p.iter().all(|x| x.is_finite());
    assert_eq!(given.iter().filter(|p| !finite(p)).count(), r.not_finite);
    for (p, q) in given.iter().zip(&out.points.positions) {
        assert_eq!(finite(p), finite(q), "{p:?} became {q:?}");
    }
    assert!(out.surface.positions.iter().all(finite));
    assert!(out.surface.normals.iter().flatten().flatten().all(|x| x.is_finite()));
    out.surface.validate().expect("indices in range");
    let t = topology(&out.surface);
    assert_eq!((t.non_manifold_edges, t.non_manifold_vertices, t.degenerate_faces), (0, 0, 0));
    assert!([r.spacing, r.noise, r.voxel].iter().all(|x| x.is_finite() && *x > 0.0), "{r:?}");
}

fn sound_or_typed(points: &[Vec3], options: &DenoiseOptions) {
    match denoise(&cloud(points), options, &mut Run::default()) {
        Ok(out) => sound(points, &out),
        Err(Error::Internal { what }) => panic!("{what}"),
        Err(e) => assert!(e.to_string().len() > 20, "{e}"),
    }
}

fn uniform(rng: &mut Rng) -> Vec3 {
    [0, 1, 2].map(|_| 2.0 * rng.uniform() - 1.0)
}

/// A small scene of the given parts: 0 = plane, 1 = line, 2 = clump, 3 = equal points, 4 = sphere, 5 =
/// uniform noise, 6 = not finite.
fn scene(parts: &[(u8, u16)], seed: u64) -> Vec<Vec3> {
    let mut rng = Rng::new(seed);
    let mut out = Vec::new();
    for &(kind, n) in parts {
        let (a, b, c) = (uniform(&mut rng), uniform(&mut rng), uniform(&mut rng));
        let size = 10f64.powf(-3.0 * rng.uniform());
        for k in 0..n {
            let (s, t) = (rng.uniform(), rng.uniform());
            let v = uniform(&mut rng);
            out.push([0, 1, 2].map(|i| match kind {
                0 => a[i] + s * b[i] + t * c[i],
                1 => a[i] + s * b[i],
                2 => a[i] + size * 1e-3 * v[i],
                3 => a[i],
                4 => a[i] + size * v[i] / norm(v),
                5 => 2.0 * v[i],
                _ => [f64::NAN, f64::INFINITY, 1.0][(i + k as usize) % 3],
            }));
        }
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn any_small_scene_ends_in_a_sound_result_or_a_typed_error(
        parts in prop::collection::vec((0u8..7, 1u16..400), 1..6), seed in any::<u64>(),
        size in -9i32..10, uv in prop::bool::weighted(0.2),
    ) {
        let factor = 10f64.powi(size);
        let points: Vec<Vec3> = scene(&parts, seed).iter().map(|p| p.map(|x| x * factor)).collect();
        sound_or_typed(&points, &DenoiseOptions::default().with_uv(uv));
    }
}

#[test]
fn vertices_that_nearly_meet_and_holes_filled_in_pieces_leave_it_sound() {
    // A surface through a corner of the grid; a ring of over 400 edges of which a middle piece is filled.
    let scenes: [(&[(u8, u16)], u64); 2] = [
        (&[(6, 164), (2, 383), (2, 232), (3, 1)], 13462071246816989735),
        (&[(2, 198), (0, 310), (5, 334)], 11461005189233368407),
    ];
    for (parts, seed) in scenes {
        sound_or_typed(&scene(parts, seed), &DenoiseOptions::default().with_uv(false));
    }
}

#[test]
fn clumps_of_many_points_within_one_spacing_neither_hang_nor_spoil_the_rest() {
    let truth = sphere(3000, 1);
    let mut points = truth.noisy(0.2, 1);
    let mut rng = Rng::new(2);
    for k in 0..8_000 {
        let (at, v) = (truth.points[k % 2], uniform(&mut rng));
        points.push([0, 1, 2].map(|i| at[i] + 0.3 * truth.spacing * v[i]));
    }
    let mut run = Run { time_limit_s: Some(120.0), ..Run::default() };
    match denoise(&cloud(&points), &plain(), &mut run) {
        Ok(out) => sound(&points, &out),
        Err(e) => assert!(matches!(e, Error::Degenerate { .. }), "{e}"),
    }
}

#[test]
fn duplicates_by_the_thousand_change_nothing() {
    let points = sphere(1500, 3).noisy(0.3, 3);
    let clean = run(&points).unwrap();
    let mut dirty = points.clone();
    dirty.extend((0..20_000).map(|k| points[k % 7]));
    let out = run(&dirty).unwrap();
    assert_eq!(out.report.duplicates, 20_000);
    assert_eq!(out.surface.positions, clean.surface.positions);
    assert_eq!(out.points.positions[..1500], clean.points.positions[..]);
}

#[test]
fn a_panic_in_the_callback_stops_the_run_and_comes_out() {
    let stopped = AtomicBool::new(false);
    // Not before the job has begun: a run that is stopped before that has none to stop.
    let progress = |p: Progress| if p.stage == Stage::Fit { panic!("told") } else { true };
    let mut run = Run { progress: Some(Box::new(progress)), ..Run::default() };
    let job = std::panic::AssertUnwindSafe(|| {
        run.execute(|c| {
            c.stage(Stage::Fit, 1);
            // Ends in any case, so that a run that is not stopped fails the test instead of hanging it.
            for _ in 0..5000 {
                if c.check().is_err() {
                    stopped.store(true, Ordering::Relaxed);
                    return Err(Error::Cancelled);
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            Ok(())
        })
    });
    let panic = std::panic::catch_unwind(job).expect_err("the panic comes out");
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"told"));
    assert!(stopped.load(Ordering::Relaxed));
}

#[test]
fn points_that_are_there_twice_almost_give_the_noise_and_the_surface_of_one_of_each() {
    let points = sphere(1500, 5).noisy(0.3, 5);
    let clean = run(&points).unwrap();
    // Copies a millionth of the spacing off; twice, and twenty times.
    for copies in [2, 20] {
        let mut rng = Rng::new(7);
        let near = |p: &Vec3, rng: &mut Rng| p.map(|x| x + 1e-6 * clean.report.spacing * rng.normal());
        let dirty: Vec<Vec3> =
            points.iter().flat_map(|p| (0..copies).map(|_| near(p, &mut rng)).collect::<Vec<_>>()).collect();
        let out = run(&dirty).unwrap();
        let r = &out.report;
        assert_eq!((r.duplicates, r.charts), ((copies - 1) * 1500, clean.report.charts));
        for (a, b) in [(r.noise, clean.report.noise), (r.spacing, clean.report.spacing)] {
            assert!((a / b - 1.0).abs() < 1e-2, "{copies} copies: {a} instead of {b}");
        }
        // Each has its own row.
        assert_eq!(out.points.len(), dirty.len());
        for (k, p) in out.points.positions.iter().enumerate() {
            let apart = norm(sub(*p, clean.points.positions[k / copies]));
            assert!(apart < 0.01 * clean.report.spacing, "point {k}: {apart}");
        }
    }
}

#[test]
fn a_scan_merged_with_a_jittered_copy_of_itself_has_the_noise_of_one() {
    let points = sphere(3000, 5).noisy(0.4, 5);
    let clean = run(&points).unwrap();
    assert_eq!(clean.report.duplicates, 0);
    // Far more than a thousandth of the spacing apart, but so are nearly all points of the scan.
    let mut rng = Rng::new(7);
    let moved = points.iter().map(|p| p.map(|x| x + 0.01 * clean.report.spacing * rng.normal()));
    let merged: Vec<Vec3> = points.iter().copied().chain(moved).collect();
    let report = run(&merged).unwrap().report;
    assert!(report.duplicates > 2700, "{} duplicates", report.duplicates);
    let ratio = report.noise / clean.report.noise;
    assert!((0.9..1.1).contains(&ratio), "the noise is {ratio} of the scan's");
}

#[test]
fn rows_ten_times_as_dense_along_as_across_make_one_surface() {
    // 30 rows of 300 points on a wave, measured from above; noise of a step.
    let (step, height) = (0.1, |x: f64| 2.0 * (0.3 * x).sin());
    let mut rng = Rng::new(9);
    let mut at = |i: u32| {
        let (x, y) = (step * f64::from(i % 300), 10.0 * step * f64::from(i / 300));
        [x, y, height(x) + step * rng.normal()]
    };
    let points: Vec<Vec3> = (0..9000).map(&mut at).collect();
    let out = run(&points).unwrap();
    let r = &out.report;
    assert_eq!((r.parts, r.boundary_loops), (1, 1));
    assert!(r.outliers < 9, "one in a thousand: {}", r.outliers);
    // The noise is along z, and is told along the normal: 3 % less here.
    assert!((0.85..1.1).contains(&(r.noise / step)), "noise {}", r.noise);
    // Each point has its own place.
    let off = |p: &[f64; 3]| p[2] - height(p[0]);
    let rms = (out.points.positions.iter().map(|p| off(p).powi(2)).sum::<f64>() / 9000.0).sqrt();
    assert!(rms < 0.4 * step, "{rms}");
    for (given, found) in points.iter().zip(&out.points.positions) {
        assert!((given[1] - found[1]).abs() < step && (given[0] - found[0]).abs() < 5.0 * step);
    }
}

#[test]
fn results_that_cannot_be_right_are_warned_of() {
    let warned = |out: &atlasfit::Denoised, word: &str| out.report.warnings.iter().any(|w| w.contains(word));
    let good = run(&sphere(2000, 6).noisy(0.3, 6)).unwrap();
    assert!(good.report.warnings.is_empty(), "{:?}", good.report.warnings);

    let mut rng = Rng::new(9);
    let cube: Vec<Vec3> = (0..3000).map(|_| [0; 3].map(|_| rng.uniform())).collect();
    let blob: Vec<Vec3> = (0..8000).map(|_| [0; 3].map(|_| rng.normal())).collect();
    for volume in [cube, blob] {
        match run(&volume) {
            Ok(out) => assert!(warned(&out, "fill a volume"), "{:?}", out.report.warnings),
            Err(e) => assert!(
                matches!(e, Error::Degenerate { .. }) && e.to_string().contains("fill a volume"),
                "{e}"
            ),
        }
    }

    let grid = |i: i32| [f64::from(i % 50) * 0.5, f64::from(i / 50) * 0.5, 1.0];
    let flat = run(&(0..2500).map(grid).collect::<Vec<_>>()).unwrap();
    assert!(warned(&flat, "rounding"), "noise {}: {:?}", flat.report.noise, flat.report.warnings);

    let fine = DenoiseOptions::default().with_detail(3.0).with_max_error(Some(0.0));
    let fine = fine.with_fill_holes(1.0).with_uv(false);
    let bowl: Vec<Vec3> = sphere(3000, 6).noisy(0.3, 6).into_iter().filter(|p| p[2] < 0.0).collect();
    let fine = denoise(&cloud(&bowl), &fine, &mut Run::default()).unwrap();
    assert!(warned(&fine, "triangles for") && warned(&fine, "longer than 1"), "{:?}", fine.report.warnings);
}

#[test]
fn sizes_beyond_what_numbers_hold_are_refused_and_all_others_are_not() {
    let points = sphere(800, 4).noisy(0.2, 4);
    let scaled = |f: f64| points.iter().map(|p| p.map(|x| x * f)).collect::<Vec<Vec3>>();
    for f in [1e-200, 1e-9, 1e9, 1e200] {
        let out = run(&scaled(f)).unwrap();
        let off = rms(out.points.positions.iter().map(|p| off_sphere(&p.map(|x| x / f))));
        assert!(off < 0.05, "scale {f:e}: {off}");
    }
    for f in [1e-300, 1e300, 1.7e308] {
        assert!(matches!(run(&scaled(f)), Err(Error::Degenerate { what, .. }) if what.contains("beyond")));
    }
    let one_far: Vec<Vec3> = points.iter().copied().chain([[1.7e308; 3]]).collect();
    assert_eq!(run(&one_far).unwrap().report.outliers, 1);
}

#[test]
fn noise_larger_than_the_scan_is_refused_and_far_too_little_is_remarked_on() {
    let truth = sphere(2000, 5);
    let points = truth.noisy(0.8, 5);
    let with = |noise: f64| -> Result<Denoised> {
        let options = plain().with_noise(Some(noise));
        denoise(&cloud(&points), &options, &mut Run::default())
    };
    for noise in [0.9, 100.0, 1e300] {
        assert!(matches!(with(noise), Err(Error::InvalidArgument { what, .. }) if what.contains("noise")));
    }
    assert!(with(0.8 * truth.spacing).unwrap().report.warnings.is_empty());
    assert_eq!(with(0.01 * truth.spacing).unwrap().report.warnings.len(), 1);
}

#[test]
fn options_are_refused_before_any_work() {
    let none = cloud(&[]);
    for options in [
        plain().with_texture_size(0),
        plain().with_texture_size(1 << 20),
        plain().with_detail(f64::NAN),
        plain().with_fill_holes(-1.0),
    ] {
        assert!(matches!(denoise(&none, &options, &mut Run::default()), Err(Error::InvalidArgument { .. })));
    }
}

#[test]
fn too_much_detail_for_the_memory_limit_is_refused_soon() {
    let points = sphere(4000, 6).noisy(0.2, 6);
    let options = plain().with_detail(10.0);
    let mut run = Run { memory_limit_bytes: Some(60_000_000), ..Run::default() };
    let started = std::time::Instant::now();
    match denoise(&cloud(&points), &options, &mut run) {
        Err(Error::OutOfMemory { needed_bytes, limit_bytes, .. }) => assert!(needed_bytes > limit_bytes),
        other => panic!("{:?}", other.map(|o| o.report)),
    }
    assert!(started.elapsed() < Duration::from_secs(60));
}

#[test]
fn a_small_part_stays_whatever_the_detail() {
    let mut points = sphere(3000, 7).noisy(0.1, 7);
    let spacing = sphere(3000, 7).spacing;
    // As dense as the large one, of a hundred and fifty points.
    let small = sphere(150, 8);
    let size = spacing / small.spacing;
    points.extend(small.points.iter().map(|p| [3.0 + size * p[0], size * p[1], size * p[2]]));
    for detail in [0.5, 1.0] {
        let options = plain().with_detail(detail);
        let out = denoise(&cloud(&points), &options, &mut Run::default()).unwrap();
        assert_eq!(out.report.parts, 2, "detail {detail}");
    }
}

#[test]
fn large_scans_give_the_same_bytes_for_any_number_of_threads() {
    // Enough points for several search trees, and lists long enough to be sorted in parts.
    let points = sphere(40_000, 9).noisy(0.3, 9);
    let of = |threads| {
        let out = denoise(&cloud(&points), &plain(), &mut Run { threads, ..Run::default() }).unwrap();
        (out.points.positions, out.surface.positions, out.surface.triangles)
    };
    let one = of(1);
    assert!(one == of(2) && one == of(4));
    assert!(rms(one.0.iter().zip(&points).map(|(p, q)| norm(sub(*p, *q)))) > 0.0);
}
