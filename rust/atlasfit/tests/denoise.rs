//! Claims about a default run as a whole: accuracy, figures, repairs, errors, limits.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::geometry::{Attribute, PointCloud, ScalarKind, Scanners};
use atlasfit::numeric::Rng;
use atlasfit::pipeline::Outliers;
use atlasfit::{CancelToken, DenoiseOptions, Denoised, Error, Run, Stage, denoise};
use shapes::*;
use std::time::{Duration, Instant};

// Accuracy.

#[test]
fn denoised_points_lie_much_closer_to_the_truth_than_the_scan() {
    for noise in [0.3, 0.6, 1.0] {
        let truth = sphere(4000, 1);
        let out = run(&truth.noisy(noise, 1)).unwrap();
        let left = rms(out.points.positions.iter().map(off_sphere)) / (noise * truth.spacing);
        assert!(left < 0.4, "noise {noise}: {left} of it is left");
    }
}

#[test]
fn normals_of_denoised_points_are_the_spheres() {
    let truth = sphere(3000, 2);
    let out = run(&truth.noisy(0.5, 2)).unwrap();
    let normals = out.points.normals.as_ref().unwrap();
    let cos: Vec<f64> = truth
        .normals
        .iter()
        .zip(normals)
        .map(|(t, n)| (0..3).map(|k| t[k] * f64::from(n[k])).sum::<f64>())
        .collect();
    let mean = cos.iter().sum::<f64>() / cos.len() as f64;
    assert!(mean.abs() > 0.98, "{mean}");
    assert!(cos.iter().all(|c| c * mean > 0.0), "all to one side");
}

#[test]
fn a_clean_scan_stays_where_it_is() {
    let truth = torus(3000, 0.4, 3);
    let out = run(&truth.points).unwrap();
    let moved = rms(out.points.positions.iter().zip(&truth.points).map(|(p, q)| norm(sub(*p, *q))));
    assert!(moved < 0.02 * truth.spacing, "{moved}");
    assert!(out.report.noise < 0.05 * truth.spacing, "{}", out.report.noise);
}

#[test]
fn the_edges_of_a_clean_box_neither_tear_nor_melt() {
    let mut rng = atlasfit::numeric::rng::Rng::new(30);
    let points: Vec<[f64; 3]> = (0..6000)
        .map(|i| {
            let (u, v) = (2.0 * rng.uniform() - 1.0, 2.0 * rng.uniform() - 1.0);
            let side = [-1.0, 1.0][i % 2];
            [[side, u, v], [u, side, v], [u, v, side]][i / 2 % 3]
        })
        .collect();
    let spacing = (24.0f64 / 6000.0).sqrt();
    let out = run(&points).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_edges, t.euler), (1, 0, 2), "{t:?}");
    let off = |p: &[f64; 3]| p.iter().fold(0f64, |m, x| m.max(x.abs())) - 1.0;
    let left = rms(out.surface.positions.iter().map(off));
    assert!(left < 0.15 * spacing, "{left} for points {spacing} apart");
}

#[test]
fn a_plate_five_times_as_thick_as_the_noise_keeps_both_its_sides() {
    let (thick, sigma) = (0.05, 0.01);
    let mut rng = atlasfit::numeric::rng::Rng::new(33);
    let points: Vec<[f64; 3]> = (0..14_000)
        .map(|i| {
            let (u, v) = (rng.uniform() - 0.5, rng.uniform() - 0.5);
            let side = [-0.5, 0.5][i % 2];
            // A share of the points as large as the rims' share of the area.
            let p = match rng.uniform() * (1.0 + 2.0 * thick) {
                x if x < 1.0 => [u, v, side * thick],
                x if x < 1.0 + thick => [u, side, v * thick],
                _ => [side, u, v * thick],
            };
            p.map(|x| x + sigma * rng.normal())
        })
        .collect();
    let out = run(&points).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_edges), (1, 0), "{t:?}");
    let middle = out.surface.positions.iter().filter(|p| p[0].abs().max(p[1].abs()) < 0.35);
    let left = rms(middle.map(|p| p[2].abs() - 0.5 * thick));
    assert!(left < 0.4 * sigma, "{left}");
}

#[test]
fn a_part_with_three_times_the_noise_comes_out_smooth() {
    let truth = torus(12000, 0.4, 31);
    let loud = |p: &[f64; 3]| p[0] > 0.6;
    let points = truth.noisy_by(Rng::new(31), |p| truth.spacing * if loud(p) { 0.42 } else { 0.14 });
    let out = run(&points).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_edges, t.euler), (1, 0, 0), "{t:?}");
    let there = out.points.positions.iter().zip(&truth.points).filter(|(_, p)| loud(p));
    let left = rms(there.map(|(q, _)| off_torus(q, 0.4))) / (0.42 * truth.spacing);
    assert!(left < 0.4, "{left} of the noise is left");
}

/// A torus of thickness `r` with noise that differs along x comes out whole, no point is set aside, and both
/// ends, farther than `end` from the middle, are as clean as their own noise lets them be.
fn stays_whole_and_clean(r: f64, truth: &Sampled, rng: Rng, end: f64, noise: impl Fn(&[f64; 3]) -> f64) {
    let points = truth.noisy_by(rng, &noise);
    let out = run(&points).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_edges, t.euler), (1, 0, 0), "{t:?}");
    assert!(out.report.outliers < points.len() / 500, "{} outliers", out.report.outliers);
    for side in [-1.0, 1.0] {
        let there = |p: &[f64; 3]| side * p[0] > end;
        let near = || out.points.positions.iter().zip(&truth.points).filter(|(_, p)| there(p));
        let left = rms(near().map(|(q, _)| off_torus(q, r)));
        let was = rms(near().map(|(_, p)| noise(p)));
        assert!(left < 0.45 * was, "{left} of {was} is left");
    }
}

#[test]
fn noise_that_grows_twelvefold_over_the_scan_costs_no_part_of_it() {
    let truth = torus(12000, 0.4, 33);
    let noise = |p: &[f64; 3]| 0.05 * truth.spacing * 12f64.powf((p[0] + 1.4) / 2.8);
    stays_whole_and_clean(0.4, &truth, Rng::new(33), 0.8, noise);
}

#[test]
fn a_thin_ring_whose_noise_grows_twelvefold_stays_whole_and_keeps_its_thickness() {
    let thin = 0.05;
    let truth = torus(8000, thin, 35);
    let noise = |p: &[f64; 3]| 0.03 * thin * 12f64.powf((p[0] + 1.0) / 2.0);
    stays_whole_and_clean(thin, &truth, Rng::new(35), 0.5, noise);
}

#[test]
fn the_noise_estimate_is_within_a_quarter() {
    let shapes =
        [("plane", square(3000, 0.0, 0.0, 4)), ("sphere", sphere(3000, 4)), ("torus", torus(4000, 0.4, 4))];
    for (name, truth) in &shapes {
        for noise in [0.3, 0.6, 1.0] {
            let out = run(&truth.noisy(noise, 5)).unwrap();
            let ratio = out.report.noise / (noise * truth.spacing);
            assert!((0.75..1.25).contains(&ratio), "{name}, noise {noise}: estimate is {ratio} of it");
            let spacing = out.report.spacing / truth.spacing;
            assert!(
                (0.8..1.4).contains(&spacing),
                "{name}, noise {noise}: spacing is {spacing} of the truth"
            );
        }
    }
}

#[test]
fn noise_given_by_the_user_is_used_as_given() {
    let truth = sphere(2000, 5);
    let options = plain().with_noise(Some(0.4 * truth.spacing));
    let out = denoise(&cloud(&truth.noisy(0.4, 5)), &options, &mut Run::default()).unwrap();
    assert!((out.report.noise / (0.4 * truth.spacing) - 1.0).abs() < 1e-12);
    assert!(rms(out.points.positions.iter().map(off_sphere)) < 0.2 * truth.spacing);
}

#[test]
fn more_charts_are_more_charts() {
    let points = sphere(3000, 6).noisy(0.3, 6);
    let charts = |n| {
        let options = plain().with_charts(Some(n));
        denoise(&cloud(&points), &options, &mut Run::default()).unwrap().report.charts
    };
    assert!(charts(400) > 2 * charts(60));
}

// Repairs, all counted.

#[test]
fn stray_points_are_reported_and_do_not_move_the_surface() {
    let truth = sphere(3000, 7);
    let points = truth.noisy(0.3, 7);
    let clean = run(&points).unwrap();
    let mut rng = atlasfit::numeric::rng::Rng::new(7);
    let mut dirty = points.clone();
    // Each alone, the way a scanner's stray points are; half a radius and more from the sphere.
    while dirty.len() < points.len() + 9 {
        let p = [0, 1, 2].map(|_| 6.0 * rng.uniform() - 3.0);
        if off_sphere(&p).abs() > 0.5 && dirty[points.len()..].iter().all(|q| norm(sub(p, *q)) > 1.5) {
            dirty.push(p);
        }
    }
    let strays = dirty.len() - points.len();
    let out = run(&dirty).unwrap();
    assert_eq!(out.report.outliers, strays);
    assert_eq!(out.points.len(), dirty.len());
    // They stay where they were; the surface has no part of them.
    assert_eq!(out.points.positions[points.len()..], dirty[points.len()..]);
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.euler), (1, 2), "{t:?}");
    let (a, b) =
        [&clean, &out].map(|o| rms(o.points.positions[..points.len()].iter().map(off_sphere))).into();
    assert!(b < 1.2 * a, "error {a} without strays, {b} with");
    // Or they are dropped.
    let options = plain().with_outliers(Outliers::Drop);
    let dropped = denoise(&cloud(&dirty), &options, &mut Run::default()).unwrap();
    assert_eq!(dropped.points.len(), dirty.len() - dropped.report.outliers);
    assert_eq!(dropped.point_source.len(), dropped.points.len());
    for (p, &s) in dropped.points.positions.iter().zip(&dropped.point_source) {
        assert_eq!(*p, out.points.positions[s as usize]);
    }
}

#[test]
fn duplicates_and_points_that_are_not_finite_are_counted_and_change_nothing() {
    let points = sphere(2000, 8).noisy(0.3, 8);
    let clean = run(&points).unwrap();
    let mut dirty = points.clone();
    dirty.extend_from_slice(&points[..300]);
    dirty.extend([[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, f64::NEG_INFINITY]]);
    let out = run(&dirty).unwrap();
    let r = &out.report;
    assert_eq!((r.points, r.duplicates, r.not_finite), (2303, 300, 3));
    assert_eq!(out.points.len(), dirty.len());
    assert!(out.points.positions[2300][0].is_nan());
    let at = &out.points.positions;
    assert_eq!(at[..300], at[2000..2300], "duplicates move together");
    // The frame comes from quantiles of all points, which the copies shift a little.
    let apart = rms(at[..2000].iter().zip(&clean.points.positions).map(|(p, q)| norm(sub(*p, *q))));
    assert!(apart < 0.1 * clean.report.spacing, "{apart}");
    assert!(out.surface.positions.iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn attributes_reach_the_points_and_the_vertices() {
    let truth = sphere(2500, 9);
    let points = truth.noisy(0.3, 9);
    let n = points.len();
    // Smooth fields and labels of the truth: x as a colour and a float, the sign of z as a label.
    let colors: Vec<[f32; 4]> =
        truth.points.iter().map(|p| [(p[0] * 0.5 + 0.5) as f32, 0.25, 0.0, 1.0]).collect();
    let label = |p: &Vec3| if p[2] > 0.0 { 7.0 } else { 2.0 };
    let scan = PointCloud {
        positions: points,
        normals: None,
        colors: Some(colors.clone()),
        scanners: None,
        attributes: vec![
            Attribute {
                name: "label".into(),
                width: 1,
                kind: ScalarKind::U8,
                values: truth.points.iter().map(label).collect(),
            },
            Attribute {
                name: "field".into(),
                width: 2,
                kind: ScalarKind::F32,
                values: truth.points.iter().flat_map(|p| [p[0], -p[1]]).collect(),
            },
        ],
    };
    let out = denoise(&scan, &plain(), &mut Run::default()).unwrap();
    assert_eq!(out.points.colors, Some(colors));
    assert_eq!(out.points.attributes, scan.attributes);
    let mesh = &out.surface;
    let v = mesh.positions.len();
    let near = 3.0 * truth.spacing;
    for (p, c) in mesh.positions.iter().zip(mesh.colors.as_ref().unwrap()) {
        assert!((f64::from(c[0]) - (p[0] * 0.5 + 0.5)).abs() < near, "{c:?} at {p:?}");
        assert!((c[1] - 0.25).abs() < 1e-5 && c[2].abs() < 1e-5 && (c[3] - 1.0).abs() < 1e-5);
    }
    let [labels, field] = &mesh.attributes[..] else { panic!("two attributes") };
    assert_eq!((labels.name.as_str(), labels.kind, labels.values.len()), ("label", ScalarKind::U8, v));
    assert_eq!((field.name.as_str(), field.width, field.values.len()), ("field", 2, 2 * v));
    for (i, p) in mesh.positions.iter().enumerate() {
        assert!(labels.values[i] == 7.0 || labels.values[i] == 2.0, "labels are never averaged");
        if p[2].abs() > near {
            assert_eq!(labels.values[i], label(p), "at {p:?}");
        }
        assert!((field.values[2 * i] - p[0]).abs() < near && (field.values[2 * i + 1] + p[1]).abs() < near);
    }
    assert_eq!(n, out.points.len());
}

// Errors.

#[test]
fn scans_without_a_surface_are_typed_errors() {
    let line: Vec<Vec3> = (0..500).map(|i| [f64::from(i) * 0.1, f64::from(i) * 0.2, 1.0]).collect();
    let empty = |r: Result<Denoised, Error>| matches!(r, Err(Error::EmptyInput { .. }));
    let degenerate = |r: Result<Denoised, Error>| matches!(r, Err(Error::Degenerate { .. }));
    assert!(empty(run(&[])));
    assert!(empty(run(&[[f64::NAN; 3]; 20])));
    assert!(degenerate(run(&[[1.0, 2.0, 3.0]])));
    assert!(degenerate(run(&[[1.0, 2.0, 3.0]; 1000])));
    assert!(degenerate(run(&sphere(5, 1).points)));
    assert!(degenerate(run(&line)));
    let mut few = sphere(11, 1).points;
    few.extend(few.clone().repeat(50));
    assert!(degenerate(run(&few)), "eleven places are too few however often they repeat");
}

#[test]
fn options_out_of_range_are_named() {
    let points = cloud(&sphere(200, 1).points);
    let d = plain;
    let bad = [
        ("noise", d().with_noise(Some(0.0))),
        ("noise", d().with_noise(Some(f64::NAN))),
        ("detail", d().with_detail(0.0)),
        ("detail", d().with_detail(f64::INFINITY)),
        ("charts", d().with_charts(Some(0))),
        ("fill_holes", d().with_fill_holes(-1.0)),
    ];
    for (name, options) in bad {
        match denoise(&points, &options, &mut Run::default()) {
            Err(Error::InvalidArgument { what, .. }) => assert!(what.contains(name), "{what}"),
            other => panic!("{name}: {:?}", other.map(|o| o.report)),
        }
    }
}

/// Fewer points than a surface needs, or points on none: whatever comes out, it comes back and is finite.
#[test]
fn awkward_scans_end_in_a_result_or_a_typed_error() {
    let mut rng = atlasfit::numeric::rng::Rng::new(12);
    let mut random = |n: usize, box_: Vec3| -> Vec<Vec3> {
        (0..n).map(|_| box_.map(|b| b * (rng.uniform() - 0.5))).collect()
    };
    let grid: Vec<Vec3> = (0..900).map(|i| [f64::from(i % 30), f64::from(i / 30), 0.0]).collect();
    let cube: Vec<Vec3> = (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(f64::from)).collect();
    let scans = [
        ("12 points", sphere(12, 3).points),
        ("40 points", sphere(40, 3).points),
        ("a solid cloud", random(2000, [1.0; 3])),
        ("a needle", random(1000, [1.0, 1e-5, 1e-5])),
        ("a ribbon", random(1000, [1.0, 0.02, 0.0])),
        ("a grid", grid),
        ("a lattice", cube),
        ("two far clusters", {
            let mut p = random(300, [1e-3; 3]);
            p.extend(random(300, [1e-3; 3]).iter().map(|p| p.map(|x| x + 1.0)));
            p
        }),
    ];
    for (name, points) in scans {
        match run(&points) {
            Ok(out) => {
                assert!(
                    out.points
                        .positions
                        .iter()
                        .chain(&out.surface.positions)
                        .flatten()
                        .all(|x| x.is_finite()),
                    "{name}"
                );
                assert_eq!(out.points.len(), points.len(), "{name}");
                assert_eq!(topology(&out.surface).non_manifold_edges, 0, "{name}");
            }
            Err(e) => assert!(matches!(e, Error::Degenerate { .. }), "{name}: {e}"),
        }
    }
}

// Cancel and limits.

#[test]
fn a_cancel_at_any_moment_ends_the_run_soon() {
    let points = cloud(&sphere(6000, 19).noisy(0.3, 19));
    let whole = {
        let at = Instant::now();
        denoise(&points, &DenoiseOptions::default(), &mut Run::default()).unwrap();
        at.elapsed()
    };
    for share in [0.0, 0.1, 0.3, 0.5, 0.7] {
        let token = CancelToken::new();
        let mut run = Run { cancel: Some(token.clone()), ..Run::default() };
        let (result, waited) = std::thread::scope(|s| {
            let at = s.spawn(move || {
                std::thread::sleep(whole.mul_f64(share));
                token.cancel();
                Instant::now()
            });
            let result = denoise(&points, &DenoiseOptions::default(), &mut run);
            let end = Instant::now();
            (result, end.saturating_duration_since(at.join().unwrap()))
        });
        match result {
            Err(Error::Cancelled) => assert!(waited < Duration::from_secs(1), "share {share}: {waited:?}"),
            // A run that was faster than the one before may be over.
            Ok(_) => assert!(share >= 0.5, "share {share}: not cancelled"),
            Err(e) => panic!("{e}"),
        }
    }
}

#[test]
fn a_cancel_in_any_stage_is_seen() {
    let points = cloud(&sphere(2500, 20).noisy(0.3, 20));
    let stages = [Stage::Analyse, Stage::Partition, Stage::Fit, Stage::Surface, Stage::Segment];
    for stop in stages {
        let mut run = Run { progress: Some(Box::new(move |p| p.stage < stop)), ..Run::default() };
        let result = denoise(&points, &DenoiseOptions::default(), &mut run);
        assert!(matches!(result, Err(Error::Cancelled)), "{stop:?}");
    }
}

#[test]
fn progress_runs_through_the_stages_in_order() {
    let mut seen: Vec<Stage> = Vec::new();
    let mut overall = vec![0.0];
    let mut run = Run {
        progress: Some(Box::new(|p| {
            assert!((0.0..=1.0).contains(&p.fraction));
            seen.push(p.stage);
            overall.push(p.overall);
            true
        })),
        ..Run::default()
    };
    let out =
        denoise(&cloud(&sphere(3000, 21).noisy(0.3, 21)), &DenoiseOptions::default(), &mut run).unwrap();
    drop(run);
    assert!(seen.windows(2).all(|w| w[0] <= w[1]), "{seen:?}");
    assert!(overall.windows(2).all(|w| w[0] <= w[1]), "the share of the whole never falls: {overall:?}");
    assert!(overall.last().is_some_and(|&o| (0.3..=1.0).contains(&o)), "it moves: {overall:?}");
    let stages: Vec<Stage> = out.report.seconds.iter().map(|s| s.0).collect();
    assert!(stages.windows(2).all(|w| w[0] < w[1]), "{stages:?}");
    assert!(stages.contains(&Stage::Fit) && stages.contains(&Stage::Pack));
}

#[test]
fn a_time_limit_is_kept() {
    let points = cloud(&sphere(6000, 22).noisy(0.3, 22));
    for limit in [0.0, 0.05] {
        let mut run = Run { time_limit_s: Some(limit), ..Run::default() };
        let at = Instant::now();
        let result = denoise(&points, &DenoiseOptions::default(), &mut run);
        assert!(matches!(result, Err(Error::TimedOut { limit_s, .. }) if limit_s == limit), "{limit}");
        assert!(at.elapsed() < Duration::from_secs(1));
    }
}

#[test]
fn a_memory_limit_is_kept() {
    let points = cloud(&sphere(2000, 23).noisy(0.3, 23));
    let mut run = Run { memory_limit_bytes: Some(100_000), ..Run::default() };
    let result = denoise(&points, &plain(), &mut run);
    assert!(matches!(
        result,
        Err(Error::OutOfMemory { needed_bytes, limit_bytes: 100_000, .. }) if needed_bytes > 100_000
    ));
    let mut run = Run { memory_limit_bytes: Some(1 << 30), ..Run::default() };
    assert!(denoise(&points, &plain(), &mut run).is_ok());
}

#[test]
fn a_sheet_faces_the_side_that_is_known() {
    let mut rng = Rng::new(5);
    let points = (0..1500).map(|_| {
        let [x, y] = [rng.uniform(), rng.uniform()];
        [x, y, 0.1 * (3.0 * x).sin() + 0.002 * rng.normal()]
    });
    let bare = PointCloud::from_positions(points.collect());
    let n = bare.len();
    let below = [0.5, 0.5, -3.0];
    let scanners = Scanners { positions: vec![below], of_point: vec![0; n] };
    let with_normals = PointCloud { normals: Some(vec![[0.0, 0.0, -1.0]; n]), ..bare.clone() };
    let with_scanner = PointCloud { scanners: Some(scanners), ..bare.clone() };
    let how = DenoiseOptions::default().with_uv(false);
    let seen_from_below = how.clone().with_viewpoint(Some(below));
    for (cloud, how, side) in [
        (&bare, &how, 1.0),
        (&bare, &seen_from_below, -1.0),
        (&with_normals, &how, -1.0),
        (&with_scanner, &how, -1.0),
    ] {
        let result = denoise(cloud, how, &mut Run::default()).expect("a sheet");
        let up = result.surface.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| result.surface.positions[v as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        });
        assert!(up.sum::<f64>() * side > 0.5);
        let normals = result.points.normals.expect("normals");
        assert!(normals.iter().all(|n| f64::from(n[2]) * side >= 0.0));
    }
}
