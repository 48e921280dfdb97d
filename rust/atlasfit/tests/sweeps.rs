//! A scan whose sweeps do not fit each other: with `sweeps` they are moved together, and the rest follows.

use atlasfit::geometry::{Attribute, Motion, PointCloud, ScalarKind, Scanners};
use atlasfit::numeric::Rng;
use atlasfit::{DenoiseOptions, Denoised, Error, Run, Vec3, denoise};

const SIGMA: f64 = 0.01;

fn column(name: &str, values: Vec<f64>) -> Attribute {
    Attribute { name: name.into(), width: 1, kind: ScalarKind::U8, values }
}

/// A bumpy sheet, seen four times; each time it is turned and moved by a few sigma.
fn scan() -> PointCloud {
    let mut rng = Rng::new(3);
    let motions: Vec<Motion> = (0..4)
        .map(|_| {
            let mut any = |size: f64| Vec3::from_fn(|_| size * rng.normal());
            Motion::new(any(SIGMA), any(2.0 * SIGMA))
        })
        .collect();
    let (mut positions, mut sweep) = (Vec::new(), Vec::new());
    for i in 0..4800 {
        let [x, y] = [0, 1].map(|_| 2.0 * rng.uniform() - 1.0);
        let z = 0.3 * (3.0 * x).sin() * (2.0 * y).cos() + SIGMA * rng.normal();
        positions.push(motions[i % 4].of(Vec3([x, y, z])).0);
        sweep.push((i % 4) as f64);
    }
    let mut cloud = PointCloud::from_positions(positions);
    cloud.attributes = vec![column("age", vec![1.0; 4800]), column("sweep", sweep)];
    cloud.scanners = Some(Scanners {
        positions: (0..4).map(|s| motions[s].of(Vec3([0.0, 0.0, 5.0])).0).collect(),
        of_point: (0..4800).map(|i| i % 4).collect(),
    });
    cloud
}

fn options() -> DenoiseOptions {
    DenoiseOptions::default().with_uv(false)
}

fn fit(cloud: &PointCloud, options: &DenoiseOptions) -> Denoised {
    denoise(cloud, options, &mut Run::default()).expect("a plain scan")
}

#[test]
fn the_noise_is_that_of_a_sweep_once_they_are_moved_together() {
    let scan = scan();
    let (apart, together) =
        (fit(&scan, &options()), fit(&scan, &options().with_sweeps(Some("sweep".into()))));
    assert!(apart.report.noise > 1.4 * SIGMA, "{}", apart.report.noise);
    assert!((together.report.noise / SIGMA - 1.0).abs() < 0.15, "{}", together.report.noise);
    let registration = together.report.registration.expect("sweeps were named");
    assert_eq!(
        registration.sweeps.iter().map(|s| (s.sweep, s.points)).collect::<Vec<_>>(),
        [(0, 1200), (1, 1200), (2, 1200), (3, 1200)]
    );
    assert!(registration.apart_after < 0.6 * registration.apart_before, "{registration:?}");
    assert_eq!(together.points.attributes[1], scan.attributes[1]);
    assert!(apart.report.registration.is_none());
}

#[test]
fn without_denoising_the_points_are_where_the_motions_take_them() {
    let scan = scan();
    let done = fit(&scan, &options().with_strength(0.0).with_sweeps(Some("sweep".into())));
    let motions = done.report.registration.expect("sweeps were named").sweeps;
    for (i, (p, q)) in scan.positions.iter().zip(&done.points.positions).enumerate() {
        assert!(motions[i % 4].motion.of(Vec3(*p)).dist2(Vec3(*q)) < 1e-20);
    }
}

#[test]
fn a_column_that_is_not_there_or_numbers_no_sweeps_is_named() {
    let mut scan = scan();
    // Nothing is fitted before that, though it is not known which way the points face.
    scan.scanners = None;
    scan.attributes.push(column("time", (0..4800).map(|i| f64::from(i) / 3.0).collect()));
    scan.attributes.push(column("id", (0..4800).map(f64::from).collect()));
    for (name, part) in [
        ("scan_id", "It has age, sweep, time, id"),
        ("time", "point 1 has 0.333"),
        ("age", "all points are of 1 sweep"),
        ("id", "4800 sweeps"),
    ] {
        let options = options().with_sweeps(Some(name.into()));
        match denoise(&scan, &options, &mut Run::default()) {
            Err(error @ Error::InvalidArgument { .. }) => {
                assert!(error.to_string().contains(part), "{name}: {error}");
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}
