//! Points for the tests of this module.

use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;

/// Random points on a sphere of radius 0.5 with noise of standard deviation `sigma` per coordinate.
pub(super) fn sphere(n: usize, sigma: f64) -> Vec<Vec3> {
    let mut rng = Rng::new(4);
    (0..n)
        .map(|_| {
            let p = Vec3::from_fn(|_| rng.normal()).normalized() * 0.5;
            p.map(|x| x + sigma * rng.normal())
        })
        .collect()
}
