//! Claims about the stitched surface of a default run: the right topology, in the right place, facing the
//! right way.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::{DenoiseOptions, Run, Vec3, denoise, measure};
use shapes::{Vec3 as Point, *};
use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

#[test]
fn a_noisy_sphere_gives_one_closed_surface_that_faces_outward() {
    for noise in [0.0, 0.3, 0.6] {
        let truth = sphere(3000, 1);
        let out = run(&truth.noisy(noise, 1)).unwrap();
        let t = topology(&out.surface);
        assert_eq!((t.parts, t.euler, t.genus), (1, 2, Some(0)), "noise {noise}: {t:?}");
        assert!(t.is_closed() && t.orientable, "noise {noise}: {t:?}");
        assert_eq!((t.inconsistent_edges, t.non_manifold_vertices, t.degenerate_faces), (0, 0, 0), "{noise}");
        assert!(!out.report.one_sided);
        let volume = volume(&out.surface) / (4.0 / 3.0 * PI);
        assert!((0.93..1.05).contains(&volume), "noise {noise}: {volume} of the ball's volume");
        let off = rms(out.surface.positions.iter().map(off_sphere));
        assert!(off < 0.05 * truth.spacing + 0.5 * noise * truth.spacing, "noise {noise}: {off}");
        let normals = out.surface.normals.as_ref().unwrap();
        for (p, n) in out.surface.positions.iter().zip(normals) {
            let cos = (0..3).map(|k| p[k] * f64::from(n[k])).sum::<f64>();
            assert!(cos > 0.8, "noise {noise}: normal {n:?} at {p:?}");
        }
    }
}

/// Points four standard deviations out get no patch of their own that stands across the surface.
#[test]
fn strays_bend_no_normals() {
    for seed in 1..6 {
        let out = run(&sphere(3000, seed).noisy(0.6, seed)).unwrap();
        let normals = out.surface.normals.as_ref().unwrap();
        for (p, n) in out.surface.positions.iter().zip(normals) {
            let cos = (0..3).map(|k| p[k] * f64::from(n[k])).sum::<f64>() / Vec3(*p).norm();
            assert!(cos > 0.9, "seed {seed}: normal {n:?} at {p:?}");
        }
    }
}

#[test]
fn a_noisy_torus_keeps_its_handle() {
    for (r, noise) in [(0.4, 0.3), (0.25, 0.3), (0.4, 0.6)] {
        let truth = torus(4000, r, 2);
        let out = run(&truth.noisy(noise, 2)).unwrap();
        let t = topology(&out.surface);
        assert_eq!((t.parts, t.euler, t.genus), (1, 0, Some(1)), "{r} {noise}: {t:?}");
        assert!(t.is_closed() && t.inconsistent_edges == 0, "{r} {noise}: {t:?}");
        assert!(volume(&out.surface) > 0.0, "{r} {noise}");
        let off = rms(out.surface.positions.iter().map(|p| off_torus(p, r)));
        assert!(off < 0.05 * truth.spacing + 0.5 * noise * truth.spacing, "{r} {noise}: {off}");
    }
}

#[test]
fn the_report_counts_what_the_surface_has() {
    let out = run(&square(2500, 0.0, 0.4, 3).noisy(0.3, 3)).unwrap();
    let t = topology(&out.surface);
    let r = &out.report;
    assert_eq!((r.parts, r.boundary_loops, r.boundary_edges), (t.parts, t.boundary_loops, t.boundary_edges));
    assert_eq!(r.charts, out.charts.len());
    assert_eq!(r.points, out.points.len());
}

#[test]
fn a_plane_keeps_its_boundary_and_its_big_hole_and_loses_small_gaps() {
    let truth = square(3000, 0.0, 0.4, 4);
    // Gaps two and a half spacings wide, as a few lost scan lines leave them.
    let lost = [[0.7, 0.7], [-0.7, 0.6], [0.65, -0.7]];
    let points: Vec<Point> = truth
        .noisy(0.3, 4)
        .into_iter()
        .filter(|p| lost.iter().all(|c| (p[0] - c[0]).hypot(p[1] - c[1]) > 1.25 * truth.spacing))
        .collect();
    let out = run(&points).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_loops, t.euler), (1, 2, 0), "{t:?}");
    assert_eq!((t.non_manifold_edges, t.inconsistent_edges), (0, 0));
    // The outline is the square's and the disk's, to within a few spacings.
    let near = 3.0 * truth.spacing;
    let (lo, hi) = out
        .surface
        .positions
        .iter()
        .fold((f64::MAX, f64::MIN), |(lo, hi), p| (lo.min(p[0].min(p[1])), hi.max(p[0].max(p[1]))));
    assert!((lo + 1.0).abs() < near && (hi - 1.0).abs() < near, "{lo} to {hi}");
    let inner = out.surface.positions.iter().map(|p| p[0].hypot(p[1])).fold(f64::MAX, f64::min);
    assert!((inner - 0.4).abs() < near, "hole of radius {inner}");
    assert!(rms(out.surface.positions.iter().map(|p| p[2])) < 0.2 * truth.spacing);
}

#[test]
fn a_boundary_lies_at_the_end_of_the_data_and_has_no_steps_of_voxels() {
    let truth = square(3000, 0.0, 0.4, 7);
    let s = run(&truth.noisy(0.3, 7)).unwrap().surface;
    let at = |v: u32| Vec3(s.positions[v as usize]);
    let normals: Vec<Vec3> =
        s.triangles.iter().map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]))).collect();
    // Noise at the rim bends a few; none hang folded under.
    let down = normals.iter().filter(|n| n[2] <= 0.0).count();
    assert!(down * 1000 < normals.len(), "{down} triangles face down");
    let area: f64 = normals.iter().map(|n| 0.5 * (*n).norm()).sum();
    // By how much the whole boundary is moved outwards, in point spacings.
    let moved = (area - (4.0 - 0.16 * PI)) / ((8.0 + 0.8 * PI) * truth.spacing);
    assert!(moved.abs() < 0.25, "{moved}");
    // Edges of one triangle only, by where they begin; a staircase would turn by a right angle at every other
    // vertex.
    let edges: HashSet<(u32, u32)> =
        s.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    let next: HashMap<u32, u32> = edges.iter().filter(|(a, b)| !edges.contains(&(*b, *a))).copied().collect();
    let turn = |(&a, b): (&u32, &u32)| {
        let (x, y) = ((at(*b) - at(a)).normalized(), (at(next[b]) - at(*b)).normalized());
        x.dot(y).clamp(-1.0, 1.0).acos()
    };
    let mean = next.iter().map(turn).sum::<f64>() / next.len() as f64;
    assert!(mean.to_degrees() < 15.0, "{}", mean.to_degrees());
}

#[test]
fn an_open_sheet_faces_up() {
    let out = run(&square(2000, 0.0, 0.0, 5).noisy(0.2, 5)).unwrap();
    assert!(out.surface.normals.as_ref().unwrap().iter().all(|n| n[2] > 0.7));
}

#[test]
fn a_hole_is_filled_on_request() {
    let points = square(3000, 0.0, 0.3, 6).noisy(0.2, 6);
    let options = plain().with_fill_holes(2.4);
    let out = denoise(&cloud(&points), &options, &mut Run::default()).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_loops, t.euler), (1, 1, 1), "{t:?}");
    assert!(out.report.filled_holes >= 1);
}

#[test]
fn a_hole_is_filled_where_the_points_about_it_thin_out_and_stays_where_they_do_not() {
    // A sphere without its top. Where it turned away from its scanners they saw less and less of it.
    for (thins_from, loops) in [(60.0, 0), (21.0, 1)] {
        let seen = |(i, p): (usize, &Point)| {
            let polar = p[2].clamp(-1.0, 1.0).acos().to_degrees();
            let chance = (i as f64 * 0.618_033_988_749_894_9).fract();
            chance < (polar - 20.0) / (thins_from - 20.0)
        };
        let points = sphere(8000, 3).noisy(0.2, 3);
        let points: Vec<Point> = points.iter().enumerate().filter(|&x| seen(x)).map(|x| *x.1).collect();
        let out = run(&points).unwrap();
        let t = topology(&out.surface);
        assert_eq!((t.parts, t.boundary_loops), (1, loops), "thinner from {thins_from} degrees: {t:?}");
        // The filling goes on as the sphere does: a flat one would be 0.06 below it and more.
        let off = out.surface.positions.iter().map(off_sphere).fold(0.0, f64::max);
        assert!(off < 0.04, "thinner from {thins_from} degrees: {off}");
    }
}

#[test]
fn a_moebius_strip_has_one_boundary_and_is_called_one_sided() {
    for seed in 0..2 {
        let out = run(&moebius(4000, 0.35, seed).noisy(0.2, seed)).unwrap();
        let t = topology(&out.surface);
        assert!(out.report.one_sided);
        assert_eq!(
            (t.parts, t.boundary_loops, t.euler, t.orientable),
            (1, 1, 0, false),
            "seed {seed}: {t:?}"
        );
        assert_eq!(t.non_manifold_edges, 0);
    }
}

#[test]
fn two_sided_surfaces_are_not_called_one_sided() {
    assert!(!run(&torus(3000, 0.4, 3).noisy(0.5, 3)).unwrap().report.one_sided);
    assert!(!run(&square(2000, 0.0, 0.3, 3).noisy(0.5, 3)).unwrap().report.one_sided);
    assert!(!run(&tube(3000, 0.2, 3).noisy(0.3, 3)).unwrap().report.one_sided);
}

#[test]
fn two_parallel_sheets_stay_two_parts() {
    let one = square(2500, 0.0, 0.0, 7);
    let gap = 8.0 * one.spacing;
    let mut points = one.points;
    points.extend(square(2500, gap, 0.0, 8).points);
    let out = run(&points).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_loops), (2, 2), "{t:?}");
}

#[test]
fn points_of_two_near_sheets_stay_on_their_sheets() {
    // Down to two spacings, a third of the charts' usual radius: only the residuals tell the sheets apart.
    for (apart, noise) in [(2.0, 0.1), (3.0, 0.2), (5.0, 0.3)] {
        let one = square(2500, 0.0, 0.0, 7);
        let gap = apart * one.spacing;
        let mut points = one.noisy(noise, 7);
        points.extend(square(2500, gap, 0.0, 8).noisy(noise, 8));
        let out = run(&points).unwrap();
        let astray = |(i, p): &(usize, &Point)| (p[2] - if *i < 2500 { 0.0 } else { gap }).abs() > 0.3 * gap;
        let count = out.points.positions.iter().enumerate().filter(astray).count();
        assert!(count < 15, "{apart} spacings apart: {count} points left their sheet");
    }
}

#[test]
fn a_thin_tube_is_a_tube() {
    // Twelve points around.
    let truth = tube(2500, 0.06, 9);
    let out = run(&truth.noisy(0.2, 9)).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.boundary_loops, t.euler), (1, 2, 0), "{t:?}");
    let off = rms(out.surface.positions.iter().map(|p| p[0].hypot(p[1]) - 0.06));
    assert!(off < 0.3 * truth.spacing, "{off} of {}", truth.spacing);
}

#[test]
fn fewer_triangles_are_as_near_as_they_may_be_far() {
    let points = torus(4000, 0.4, 12).noisy(0.3, 12);
    let with = |options| denoise(&cloud(&points), &options, &mut Run::default()).unwrap();
    let (all, few) = (
        with(plain().with_max_error(Some(0.0))),
        with(plain().with_faces(Some(4000)).with_max_error(Some(0.02))),
    );
    let near = with(plain().with_max_error(Some(0.005)));
    assert!((3998..=4000).contains(&few.surface.triangles.len()), "{}", few.surface.triangles.len());
    assert!(2 * near.surface.triangles.len() < all.surface.triangles.len());
    for (light, max_error) in [(&few, 0.02), (&near, 0.005)] {
        let (t, before) = (topology(&light.surface), topology(&all.surface));
        assert_eq!((t.parts, t.boundary_loops, t.euler), (before.parts, before.boundary_loops, before.euler));
        let options = measure::DistanceOptions::default();
        let far = Run::default()
            .execute(|ctx| measure::surface(&light.surface, &all.surface, &options, ctx))
            .unwrap();
        assert!(far.completeness.max <= 1.5 * max_error, "{} of {max_error}", far.completeness.max);
        assert!(far.normal_orientation > 0.97, "{}", far.normal_orientation);
    }
    let out_of_reach = with(plain().with_faces(Some(10)).with_max_error(Some(1e-4)));
    assert!(out_of_reach.report.warnings.iter().any(|w| w.contains("not 10")));
}

#[test]
fn uvs_lie_in_the_page_without_flips_or_overlaps() {
    for points in [
        sphere(2000, 10).noisy(0.3, 10),
        torus(2500, 0.4, 10).noisy(0.3, 10),
        square(1500, 0.0, 0.3, 10).noisy(0.3, 10),
    ] {
        let out = denoise(&cloud(&points), &DenoiseOptions::default(), &mut Run::default()).unwrap();
        let mesh = &out.surface;
        assert_eq!(mesh.corner_uv.as_ref().map(Vec::len), Some(mesh.triangles.len()));
        assert_eq!(mesh.face_chart.as_ref().map(Vec::len), Some(mesh.triangles.len()));
        let q = Run::default().execute(|ctx| measure::uv(mesh, ctx)).unwrap();
        assert!(q.finite && q.inside, "{q:?}");
        assert_eq!((q.flips, q.degenerate, q.overlapping_faces), (0, 0, 0), "{q:?}");
        assert_eq!(q.charts, out.report.uv_charts);
        assert!(q.stretch_p95 < 1.5, "{q:?}");
    }
}

#[test]
fn finer_detail_means_smaller_voxels_on_the_same_surface() {
    let points = sphere(1500, 11).noisy(0.3, 11);
    let at =
        |detail: f64| denoise(&cloud(&points), &plain().with_detail(detail), &mut Run::default()).unwrap();
    let (coarse, fine) = (at(0.7), at(1.6));
    assert!((coarse.report.voxel * 0.7 - fine.report.voxel * 1.6).abs() < 1e-9);
    assert!(fine.surface.triangles.len() > 3 * coarse.surface.triangles.len());
    assert_eq!(topology(&fine.surface).euler, 2);
    assert_eq!(topology(&coarse.surface).euler, 2);
}

/// Spacings of 1 to 30 on one sphere: voxels are as wide as the points of their place ask, and the surface
/// stays in one piece where they change.
#[test]
fn a_sphere_scanned_a_thousand_times_more_densely_on_one_side_is_closed() {
    let mut rng = atlasfit::numeric::Rng::new(5);
    let mut points = Vec::new();
    while points.len() < 12_000 {
        let p = Vec3::from_fn(|_| rng.normal()).normalized();
        let spacing = 1.0 + 15.0 * (1.0 - p[0]);
        if rng.uniform() < 1.0 / (spacing * spacing) {
            points.push((p * (1.0 + 0.0005 * rng.normal())).0);
        }
    }
    let out = run(&points).unwrap();
    let t = topology(&out.surface);
    assert_eq!((t.parts, t.genus, t.inconsistent_edges), (1, Some(0), 0), "{t:?}");
    assert!(t.is_closed(), "{t:?}");
    // The noise where points are dense; a twentieth of the spacing where they are not.
    for (side, most) in [(1.0, 0.0008), (-1.0, 0.006)] {
        let there = out.surface.positions.iter().filter(|p| side * p[0] > 0.0);
        let off = rms(there.map(off_sphere));
        assert!(off < most, "{side}: {off}");
    }
}
