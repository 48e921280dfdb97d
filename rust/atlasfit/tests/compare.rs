//! What changed between two scans: noise alone is no change, a dent is, and scans apart are refused.

use atlasfit::geometry::PointCloud;
use atlasfit::measure::{CompareOptions, Comparison, compare};
use atlasfit::numeric::Rng;
use atlasfit::pipeline::UNCERTAINTY;
use atlasfit::{DenoiseOptions, Denoised, Error, Result, Run, Vec3, denoise};

const SIGMA: f64 = 0.01;

/// A noisy bumpy ball; `dent` says how far a place was pushed in.
fn scan(seed: u64, dent: impl Fn(Vec3) -> f64) -> PointCloud {
    let mut rng = Rng::new(seed);
    let at = (0..8000).map(|_| {
        let p = Vec3::from_fn(|_| rng.normal()).normalized();
        let radius = 1.0 + 0.1 * (3.0 * p[0]).sin() - dent(p);
        (p * radius + Vec3::from_fn(|_| SIGMA * rng.normal())).0
    });
    PointCloud::from_positions(at.collect())
}

fn fit(scan: &PointCloud) -> Denoised {
    let options = DenoiseOptions::default().with_uv(false).with_uncertainty(true);
    denoise(scan, &options, &mut Run::default()).expect("a plain scan")
}

fn change(before: &Denoised, after: &Denoised, options: &CompareOptions) -> Result<Comparison> {
    Run::default().execute(|ctx| compare(&before.surface, &after.points, options, ctx))
}

/// How deep a dent of radius 0.5 about the top is.
fn dented(p: Vec3, depth: f64) -> f64 {
    let t = 1.0 - (p - Vec3([0.0, 0.0, 1.0])).norm() / 0.5;
    depth * (4.0 * t).clamp(0.0, 1.0)
}

#[test]
fn other_noise_is_no_change_and_a_dent_of_three_standard_deviations_is() {
    let before = fit(&scan(1, |_| 0.0));
    let options = CompareOptions::default();
    let same = change(&before, &fit(&scan(2, |_| 0.0)), &options).expect("they overlap");
    assert!(same.compared > 7900 && same.changed as f64 <= 0.01 * same.compared as f64, "{}", same.changed);
    // Three standard deviations of the distances, not of the noise, which is several times larger.
    let sd = same.detectable / 2.576;
    assert!(sd < 0.6 * SIGMA, "{sd}");
    // The dent holds few charts: of one scan 40 to 60 percent of it are found. Eight scans decide.
    let (mut inside, mut flagged, mut sum) = (0u32, 0u32, 0.0);
    for seed in 3..11 {
        let after = fit(&scan(seed, |p| dented(p, 3.0 * sd)));
        let found = change(&before, &after, &options).expect("they overlap");
        let mut elsewhere = 0;
        for (i, p) in after.points.positions.iter().enumerate() {
            let dent = dented(Vec3(*p).normalized(), 1.0);
            if dent == 1.0 {
                inside += 1;
                flagged += u32::from(found.significant[i]);
                sum += found.distance[i];
            }
            elsewhere += usize::from(dent == 0.0 && found.significant[i]);
        }
        assert!(elsewhere < 80, "{elsewhere} flagged where nothing changed");
    }
    assert!(flagged * 2 > inside, "{flagged} of {inside}");
    let mean = sum / f64::from(inside);
    assert!((mean / (-3.0 * sd) - 1.0).abs() < 0.3, "inward: {mean} {sd}");
}

#[test]
fn distances_within_the_registration_are_no_change() {
    let (before, mut after) = (fit(&scan(1, |_| 0.0)), fit(&scan(2, |_| 0.0)));
    after.points.positions.iter_mut().for_each(|p| p[2] += 0.05);
    let at = |registration| {
        let options = CompareOptions::default().with_registration(registration);
        change(&before, &after, &options).expect("they overlap").changed
    };
    assert!(at(0.0) > 4000 && at(0.05) < 100, "{} {}", at(0.0), at(0.05));
}

#[test]
fn scans_that_do_not_overlap_and_bad_options_are_refused() {
    let before = fit(&scan(1, |_| 0.0));
    let said = |after: &Denoised, options: &CompareOptions| match change(&before, after, options) {
        Err(Error::InvalidArgument { what, .. } | Error::Degenerate { what, .. }) => what,
        other => panic!("{other:?}"),
    };
    let options = CompareOptions::default();
    let mut away = before.clone();
    away.points.positions.iter_mut().for_each(|p| p[0] += 7.0);
    assert!(said(&away, &options).contains("do not overlap"));
    // Their boxes meet, but no point lies over the surface.
    let mut within = before.clone();
    within.points.positions.iter_mut().for_each(|p| *p = p.map(|x| 0.1 * x));
    assert!(said(&within, &options).contains("do not overlap"));
    for bad in [options.clone().with_level(1.0), options.clone().with_level(f64::NAN)] {
        assert!(said(&before, &bad).contains("level"));
    }
    assert!(said(&before, &options.clone().with_registration(-1.0)).contains("registration"));
    assert!(said(&before, &options.clone().with_max_distance(Some(f64::INFINITY))).contains("max_distance"));
    let mut unsure = before.clone();
    unsure.points.attributes.retain(|a| a.name != UNCERTAINTY);
    assert!(said(&unsure, &options).contains(UNCERTAINTY));
}
