//! Claims about how strongly a scan is denoised, and about the noise that a user gives.

#[path = "denoise_shapes/mod.rs"]
mod shapes;

use atlasfit::{DenoiseOptions, Denoised, Error, Run, denoise};
use shapes::*;

fn with(points: &[Vec3], options: &DenoiseOptions) -> Denoised {
    denoise(&cloud(points), options, &mut Run::default()).unwrap()
}

fn strong(points: &[Vec3], strength: f64) -> Denoised {
    with(points, &plain().with_strength(strength))
}

fn moved(points: &[Vec3], out: &Denoised) -> f64 {
    rms(points.iter().zip(&out.points.positions).map(|(p, q)| norm(sub(*p, *q))))
}

/// How far the surface is from the points.
fn off_surface(points: &[Vec3], out: &Denoised) -> f64 {
    let feet = Run::default()
        .execute(|ctx| {
            let points: Vec<atlasfit::Vec3> = points.iter().map(|p| atlasfit::Vec3(*p)).collect();
            atlasfit::measure::Locator::new(&out.surface, ctx)?.nearest_all(&points, ctx)
        })
        .unwrap();
    rms(points.iter().zip(feet).map(|(p, foot)| foot.map_or(0.0, |f| norm(sub(*p, f.point.0)))))
}

/// Scans with something to smooth away: ripples on a torus, an open sheet with a bump, a thin tube.
fn scans() -> [(&'static str, Vec<Vec3>); 3] {
    let torus = torus(4000, 0.5, 1);
    let rippled = torus.noisy(0.3, 1).into_iter().map(|p| {
        let turn = p[1].atan2(p[0]);
        [p[0], p[1], p[2] + 0.04 * (12.0 * turn).sin()]
    });
    let bump = square(3000, 0.0, 0.0, 2).noisy(0.4, 2).into_iter();
    let bump = bump.map(|[x, y, z]| [x, y, z + 0.3 * (-8.0 * (x * x + y * y)).exp()]);
    let tube = tube(3000, 0.05, 3).noisy(0.2, 3).into_iter();
    let tube = tube.map(|[x, y, z]| [x + 0.02 * (5.0 * z).sin(), y, z]);
    [("torus", rippled.collect()), ("bump", bump.collect()), ("tube", tube.collect())]
}

#[test]
fn more_strength_moves_points_farther_and_leaves_the_surface_farther_from_them() {
    for (name, points) in scans() {
        let strengths = [0.0, 0.25, 0.5, 0.9, 1.0, 1.1, 1.5, 2.0, 4.0];
        let all = strengths.map(|s| strong(&points, s));
        let way = all.each_ref().map(|out| moved(&points, out));
        let off = all.each_ref().map(|out| off_surface(&points, out));
        assert!(way.windows(2).all(|w| w[0] < w[1]), "{name}: {way:?}");
        assert!(off.windows(2).all(|w| w[0] < 1.01 * w[1]), "{name}: {off:?}");
        // A thin tube is averaged over its circumference at any strength: little is left to smooth.
        if name != "tube" {
            assert!(off[0] < 0.95 * off[4] && 1.02 * off[4] < off[7], "{name}: {off:?}");
        }
        // The dial is one of smoothing only: nothing else about the atlas depends on it.
        for out in &all {
            assert_eq!(out.report.charts, all[4].report.charts, "{name}");
            assert_eq!(out.point_chart.len(), all[4].point_chart.len(), "{name}");
            assert_eq!(out.report.outliers, all[4].report.outliers, "{name}");
        }
    }
}

#[test]
fn strength_0_gives_the_points_back_and_1_is_the_default() {
    for (name, points) in scans() {
        assert_eq!(strong(&points, 0.0).points.positions, points, "{name}");
        let (one, usual) = (strong(&points, 1.0), with(&points, &plain()));
        assert_eq!(one.points, usual.points, "{name}");
        assert_eq!(one.surface, usual.surface, "{name}");
    }
}

#[test]
fn half_the_strength_is_less_than_half_of_the_way() {
    let points = sphere(4000, 4).noisy(0.5, 4);
    let [half, whole] = [0.5, 1.0].map(|s| moved(&points, &strong(&points, s)));
    assert!((0.3 * whole..=0.5 * whole).contains(&half), "{half} {whole}");
}

#[test]
fn double_strength_is_a_smoother_surface() {
    // Noise that is told from the shape at no scale: what is left of it is less where more is smoothed.
    let truth = square(4000, 0.0, 0.0, 5);
    let points = truth.noisy(0.5, 5);
    let left = |s| rms(strong(&points, s).surface.positions.iter().map(|p| p[2]));
    let [usual, double] = [1.0, 2.0].map(left);
    assert!(double < 0.95 * usual, "{usual} {double}");
}

#[test]
fn any_strength_ends_in_a_result() {
    let points = sphere(1500, 6).noisy(0.6, 6);
    for strength in [1e-300, 1e-6, 10.0, 1e9, f64::MAX] {
        let out = strong(&points, strength);
        assert!(out.points.positions.iter().flatten().all(|x| x.is_finite()), "{strength}");
        assert_eq!(out.report.parts, 1, "{strength}");
    }
}

#[test]
fn strengths_that_are_none_are_refused_by_name() {
    let points = cloud(&sphere(200, 1).points);
    for strength in [f64::NAN, -0.5, f64::INFINITY, f64::NEG_INFINITY] {
        let options = plain().with_strength(strength);
        match denoise(&points, &options, &mut Run::default()) {
            Err(Error::InvalidArgument { what, .. }) => assert!(what.contains("strength"), "{what}"),
            other => panic!("{strength}: {:?}", other.map(|o| o.report)),
        }
    }
}

#[test]
fn more_noise_given_moves_points_farther_be_it_far_below_the_spacing_or_not() {
    for (name, points) in scans() {
        let spacing = with(&points, &plain()).report.spacing;
        let at = |noise| with(&points, &plain().with_noise(Some(noise * spacing)));
        let way = [0.001, 0.01, 0.04, 0.1, 0.3].map(|noise| moved(&points, &at(noise)));
        assert!(way.windows(2).all(|w| w[0] < w[1]), "{name}: {way:?}");
    }
}
