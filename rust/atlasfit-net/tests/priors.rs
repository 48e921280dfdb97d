//! The network priors through the main job.

use atlasfit::Vec3;
use atlasfit::geometry::PointCloud;
use atlasfit::numeric::rng::Rng;
use atlasfit::pipeline::{DenoiseOptions, denoise_guided};
use atlasfit::run::Run;
use atlasfit_net::Prior;
use atlasfit_net::explicit::{Network, NetworkOptions, Recipe};
use atlasfit_net::level_set::LevelSetOptions;

#[test]
fn every_network_prior_answers_for_every_point_and_gives_one_surface() {
    let mut rng = Rng::new(9);
    let noisy: Vec<[f64; 3]> = (0..3000)
        .map(|_| {
            let p = Vec3::from_fn(|_| rng.normal()).normalized() * 10.0;
            p.0.map(|x| x + 3.0 + 0.1 * rng.normal())
        })
        .collect();
    let cloud = PointCloud::from_positions(noisy);
    // Far from trained: what the networks do not reach must come out as with the default prior.
    let few = NetworkOptions::default().with_charts(1).with_recipe(Recipe::Paper).with_iterations(5);
    for prior in [
        Prior::Network(few),
        Prior::Network(few.with_network(Network::Conv)),
        Prior::LevelSet(LevelSetOptions::default().with_iterations(150).with_resolution(48)),
    ] {
        let how = DenoiseOptions::default().with_uv(false);
        let result = denoise_guided(&cloud, &how, prior.guide(), &mut Run::default()).unwrap();
        assert_eq!(result.points.len(), 3000);
        assert!((result.report.noise / 0.1 - 1.0).abs() < 0.3, "{}", result.report.noise);
        assert_eq!(result.report.parts, 1);
        let off = |points: &[[f64; 3]]| -> f64 {
            points.iter().map(|p| (Vec3(p.map(|x| x - 3.0)).norm() - 10.0).powi(2)).sum::<f64>()
        };
        assert!(off(&result.points.positions) < off(&cloud.positions), "{prior:?}");
    }
}
