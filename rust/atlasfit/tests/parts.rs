//! Claims about the parts of the surface that are left out as too small.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::numeric::rng::shuffled;
use atlasfit::pipeline::Outliers;
use atlasfit::{DenoiseOptions, Denoised, Error, Run, denoise};
use shapes::*;

/// A unit sphere of 3,000 points, and beside it one with 0.35 of its radius and 600 points: 0.11 of the area
/// of both.
fn spheres() -> Vec<Vec3> {
    let mut points = sphere(3000, 1).noisy(0.3, 1);
    let small = sphere(600, 2).noisy(0.3, 2);
    points.extend(small.iter().map(|p| [3.0 + 0.35 * p[0], 0.35 * p[1], 0.35 * p[2]]));
    points
}

fn with(points: &[Vec3], options: DenoiseOptions) -> Denoised {
    denoise(&cloud(points), &options, &mut Run::default()).unwrap()
}

/// How many parts the surface has, how many were left out, and how many points lay on those.
fn counts(out: &Denoised) -> [usize; 3] {
    [topology(&out.surface).parts, out.report.dropped_parts, out.report.dropped_points]
}

/// Whether the whole surface lies at the large sphere.
fn at_the_large(out: &Denoised) -> bool {
    out.surface.positions.iter().all(|p| off_sphere(p).abs() < 0.1)
}

#[test]
fn a_part_below_the_share_goes_and_one_above_it_stays() {
    let points = spheres();
    assert_eq!(counts(&with(&points, plain())), [2, 0, 0]);
    assert_eq!(counts(&with(&points, plain().with_min_part(0.08))), [2, 0, 0]);
    for options in [plain().with_min_part(0.2), plain().with_largest(true)] {
        let out = with(&points, options);
        assert_eq!(counts(&out), [1, 1, 600]);
        assert!(at_the_large(&out) && out.report.parts == 1);
    }
}

#[test]
fn the_order_of_the_points_does_not_decide_which_part_stays() {
    let points = spheres();
    let order = shuffled(points.len(), 3);
    let mixed: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
    for options in [plain().with_min_part(0.2), plain().with_largest(true)] {
        let out = with(&mixed, options.clone().with_outliers(Outliers::Drop));
        assert_eq!(counts(&out), [1, 1, 600]);
        assert!(at_the_large(&out));
        assert!(
            out.point_source.iter().all(|&i| order[i as usize] < 3000),
            "a point of the small one is left"
        );
    }
}

#[test]
fn points_of_a_part_that_is_left_out_are_denoised_and_go_only_with_the_outliers() {
    let points = spheres();
    let out = with(&points, plain().with_min_part(0.2));
    assert_eq!(out.points.len(), points.len());
    let off = |p: &Vec3| norm([(p[0] - 3.0) / 0.35, p[1] / 0.35, p[2] / 0.35]) - 1.0;
    let (before, after) =
        (rms(points[3000..].iter().map(off)), rms(out.points.positions[3000..].iter().map(off)));
    assert!(after < 0.6 * before, "{before} {after}");
    assert!(out.point_chart[3000..].iter().all(|&c| (c as usize) < out.charts.len()));

    let fewer = with(&points, plain().with_min_part(0.2).with_outliers(Outliers::Drop));
    assert_eq!(fewer.points.len(), points.len() - 600 - fewer.report.outliers);
    assert!(fewer.point_source.iter().all(|&i| i < 3000));
    assert_eq!(fewer.surface.positions, out.surface.positions);
}

#[test]
fn a_solid_is_made_of_the_parts_that_stay() {
    // A plate with a hole, and a small one above it: closing makes plates of both, that do not meet.
    let mut points = square(3000, 0.0, 0.0, 4).noisy(0.3, 4);
    points.extend(square(300, 0.0, 0.0, 5).points.iter().map(|p| [0.3 * p[0], 0.3 * p[1], 1.0]));
    let solid = plain().with_watertight(true);
    assert_eq!(counts(&with(&points, solid.clone()))[0], 2);
    let out = with(&points, solid.with_largest(true));
    assert_eq!(counts(&out), [1, 1, 300]);
    assert!(topology(&out.surface).is_closed());
    assert!(out.surface.positions.iter().all(|p| p[2] < 0.5));
}

#[test]
fn a_surface_without_its_one_sided_part_is_not_one_sided() {
    let mut points = sphere(4000, 6).noisy(0.2, 6);
    points.extend(moebius(4000, 0.35, 0).noisy(0.2, 0).iter().map(|p| [4.0 + p[0], p[1], p[2]]));
    assert!(with(&points, plain()).report.one_sided);
    let out = with(&points, plain().with_largest(true));
    assert!(!out.report.one_sided && at_the_large(&out));
}

#[test]
fn a_share_out_of_range_or_that_no_part_has_is_an_error() {
    let points = spheres();
    let fails = |share: f64| {
        let options = plain().with_min_part(share);
        match denoise(&cloud(&points), &options, &mut Run::default()) {
            Err(e @ Error::InvalidArgument { .. }) => e.to_string(),
            other => panic!("{share}: {:?}", other.map(|out| out.report)),
        }
    };
    for share in [-0.1, 1.1, f64::NAN] {
        assert!(fails(share).contains("min_part"), "{share}");
    }
    let said = fails(0.95);
    assert!(said.contains("no part") && said.contains("0.95") && said.contains("0.89"), "{said}");
}
