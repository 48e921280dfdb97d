//! Denoising without a surface: the same points, but for those beside edges, and nothing else.

use atlasfit::geometry::{Attribute, PointCloud, ScalarKind};
use atlasfit::{DenoiseOptions, Error, Run, Vec3, denoise};

/// A bumpy ball with noise.
fn ball(count: usize) -> PointCloud {
    let mut rng = atlasfit::numeric::Rng::new(3);
    let at = (0..count).map(|_| {
        let p = Vec3::from_fn(|_| rng.normal()).normalized();
        (p * (1.0 + 0.1 * (3.0 * p[0]).sin() + 0.01 * rng.normal())).0
    });
    let mut cloud = PointCloud::from_positions(at.collect());
    let (name, values) = ("number".to_string(), (0..count).map(|i| i as f64).collect());
    cloud.attributes.push(Attribute { name, width: 1, kind: ScalarKind::U32, values });
    cloud
}

#[test]
fn points_and_charts_are_those_beside_a_surface_and_face_outward() -> atlasfit::Result<()> {
    let scan = ball(3000);
    let all = denoise(&scan, &DenoiseOptions::default().with_uv(false), &mut Run::default())?;
    let points = DenoiseOptions::default().with_surface(false);
    let only = denoise(&scan, &points, &mut Run::default())?;
    assert_eq!(only.points.positions, all.points.positions);
    assert_eq!(only.points.normals, all.points.normals);
    assert_eq!((only.point_chart, only.charts), (all.point_chart, all.charts));
    assert!(only.surface.positions.is_empty() && only.surface.corner_uv.is_none());
    assert_eq!(only.surface.attributes.len(), 1);
    assert_eq!((only.report.parts, only.report.uv_charts), (0, 0));
    Ok(())
}

#[test]
fn what_is_asked_of_the_surface_is_refused_without_one() {
    let none = DenoiseOptions::default().with_surface(false);
    for asked in [
        none.clone().with_watertight(true),
        none.clone().with_faces(Some(100)),
        none.clone().with_max_error(Some(0.1)),
        none.clone().with_min_part(0.5),
        none.clone().with_largest(true),
        none.with_fill_holes(1.0),
    ] {
        let refused = denoise(&ball(600), &asked, &mut Run::default());
        assert!(matches!(refused, Err(Error::InvalidArgument { .. })), "{asked:?}");
    }
}

#[test]
fn a_viewpoint_turns_the_points_without_a_surface_too() -> atlasfit::Result<()> {
    let inside = DenoiseOptions::default().with_surface(false).with_viewpoint(Some([0.0; 3]));
    let made = denoise(&ball(2000), &inside, &mut Run::default())?;
    let normals = made.points.normals.as_deref().unwrap_or_default();
    let inward = (made.points.positions.iter().zip(normals))
        .filter(|(p, n)| Vec3(**p).dot(Vec3(n.map(f64::from))) < 0.0)
        .count();
    assert!(inward > 1950, "{inward} of 2000");
    Ok(())
}
