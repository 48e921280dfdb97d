//! How sure a result is: intervals hold what they promise, where no data are it is said, and nothing else
//! changes.

use atlasfit::geometry::{Attribute, PointCloud};
use atlasfit::numeric::Rng;
use atlasfit::pipeline::{EXTRAPOLATED, NOISE, OUTLIER_PROBABILITY, UNCERTAINTY};
use atlasfit::{DenoiseOptions, Denoised, Run, Vec3, denoise};

const SIGMA: f64 = 0.02;

/// A noisy unit sphere, where `keep` says so of the true place.
fn sphere(count: usize, seed: u64, keep: impl Fn(Vec3) -> bool) -> PointCloud {
    let mut rng = Rng::new(seed);
    let mut at = Vec::new();
    while at.len() < count {
        let p = Vec3::from_fn(|_| rng.normal()).normalized();
        if keep(p) {
            at.push((p + Vec3::from_fn(|_| SIGMA * rng.normal())).0);
        }
    }
    PointCloud::from_positions(at)
}

fn sure(scan: &PointCloud, options: DenoiseOptions) -> Denoised {
    let options = options.with_uv(false).with_uncertainty(true);
    denoise(scan, &options, &mut Run::default()).expect("a plain scan")
}

fn column<'a>(of: &'a [Attribute], name: &str) -> &'a [f64] {
    &of.iter().find(|a| a.name == name).unwrap_or_else(|| panic!("no {name}")).values
}

/// The share of places whose true distance is within what a standard deviation allows 90 times in a hundred.
fn covered(at: &[[f64; 3]], sd: &[f64]) -> f64 {
    let within = at.iter().zip(sd).filter(|(p, s)| (Vec3(**p).norm() - 1.0).abs() <= 1.645 * **s);
    within.count() as f64 / at.len() as f64
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x));
    sum / n
}

#[test]
fn intervals_of_ninety_per_cent_hold_about_ninety_per_cent_and_the_noise_is_known() {
    let done = sure(&sphere(6000, 1, |_| true), DenoiseOptions::default());
    let points = covered(&done.points.positions, column(&done.points.attributes, UNCERTAINTY));
    let vertices = covered(&done.surface.positions, column(&done.surface.attributes, UNCERTAINTY));
    assert!((0.85..0.97).contains(&points), "points {points}");
    assert!((0.85..0.98).contains(&vertices), "vertices {vertices}");
    assert!(done.report.uncertainty_factor.is_some());
    let noise = mean(column(&done.points.attributes, NOISE).iter().copied());
    assert!((noise / SIGMA - 1.0).abs() < 0.1, "{noise}");
    assert!(column(&done.surface.attributes, EXTRAPOLATED).iter().all(|e| *e == 0.0));
}

#[test]
fn rims_are_less_sure_and_filled_holes_are_marked() {
    let cap = |p: Vec3| p[2] < 0.75;
    let done = sure(&sphere(6000, 2, cap), DenoiseOptions::default().with_fill_holes(10.0));
    let sd = column(&done.points.attributes, UNCERTAINTY);
    let at = |from: f64, to: f64| {
        let there = |p: &[f64; 3]| (from..to).contains(&Vec3(*p).normalized()[2]);
        mean(done.points.positions.iter().zip(sd).filter(|(p, _)| there(p)).map(|(_, s)| *s))
    };
    let (rim, inside) = (at(0.735, 1.0), at(-0.5, 0.5));
    assert!(rim > 1.3 * inside, "rim {rim} inside {inside}");
    let invented = column(&done.surface.attributes, EXTRAPOLATED);
    let sd = column(&done.surface.attributes, UNCERTAINTY);
    assert!(invented.contains(&1.0), "the hole is filled");
    for ((p, e), s) in done.surface.positions.iter().zip(invented).zip(sd) {
        let z = Vec3(*p).normalized()[2];
        assert!(z > 0.7 || *e == 0.0, "data at {p:?} are called invented");
        assert!(z < 0.93 || *e == 1.0, "no data at {p:?}");
        assert!(*e == 0.0 || *s > 2.0 * at(-0.5, 0.5), "{p:?} {s}");
    }
}

#[test]
fn it_changes_nothing_else_and_is_in_the_unit_of_the_scan() {
    let scan = sphere(2000, 3, |_| true);
    let options = DenoiseOptions::default();
    let plain = denoise(&scan, &options.clone().with_uv(false), &mut Run::default()).expect("a plain scan");
    let done = sure(&scan, options.clone());
    assert_eq!(plain.points.positions, done.points.positions);
    assert_eq!(plain.surface.positions, done.surface.positions);
    assert!(plain.points.attributes.is_empty() && plain.surface.attributes.is_empty());
    assert_eq!(plain.report.uncertainty_factor, None);
    let large = scan.positions.iter().map(|p| p.map(|x| 1024.0 * x)).collect();
    let large = sure(&PointCloud::from_positions(large), options.clone());
    for name in [UNCERTAINTY, NOISE] {
        let pairs = column(&done.points.attributes, name).iter().zip(column(&large.points.attributes, name));
        pairs.for_each(|(a, b)| assert!((1024.0 * a - b).abs() <= 1e-6 * b, "{name}: {a} {b}"));
    }
    // A result that is denoised again keeps what it brings, beside the new.
    let names = |d: &Denoised| d.points.attributes.iter().map(|a| a.name.clone()).collect::<Vec<_>>();
    let again = sure(&done.points, options);
    assert_eq!(names(&done), [UNCERTAINTY, NOISE, OUTLIER_PROBABILITY]);
    assert_eq!(names(&again)[0], format!("{UNCERTAINTY}_before"));
    assert_eq!(names(&again)[3..], names(&done));
}

#[test]
fn points_that_are_not_moved_keep_their_noise_and_strays_are_told() {
    let mut scan = sphere(3000, 4, |_| true);
    let mut rng = Rng::new(5);
    scan.positions.extend((0..30).map(|_| Vec3::from_fn(|_| rng.normal()).normalized().0.map(|x| 1.6 * x)));
    scan.positions.push([f64::NAN, 0.0, 0.0]);
    let done = sure(&scan, DenoiseOptions::default().with_strength(0.0));
    let at = |name: &str| column(&done.points.attributes, name);
    let moved = mean(at(UNCERTAINTY)[..3000].iter().copied());
    assert!((moved / SIGMA - 1.0).abs() < 0.15, "{moved}");
    assert!(mean(at(OUTLIER_PROBABILITY)[..3000].iter().copied()) < 0.03);
    assert!(at(OUTLIER_PROBABILITY)[3000..3030].iter().all(|p| *p == 1.0));
    assert!(at(UNCERTAINTY)[3000..3030].iter().all(|s| (0.5..0.7).contains(s)));
    assert!(at(UNCERTAINTY)[3030].is_nan() && at(OUTLIER_PROBABILITY)[3030].is_nan());
}
