//! The explicit networks learn known shapes, the same for any number of threads.

use super::*;
use crate::loss::stretch;
use crate::net::conv;
use crate::sample::Sample;
use atlasfit::error::Error;
use atlasfit::measure::Locator;
use atlasfit::numeric::rng::Rng;
use atlasfit::run::{CancelToken, Run};
use std::time::{Duration, Instant};

fn sphere(n: usize) -> Vec<Vec3> {
    let mut rng = Rng::new(4);
    (0..n).map(|_| Vec3::from_fn(|_| rng.normal()).normalized() * 0.5).collect()
}

const PAPER: NetworkOptions = NetworkOptions {
    network: Network::Dense,
    charts: 2,
    dim: Dim::Surface,
    flat: false,
    start: Start::Torch,
    recipe: Recipe::Paper,
    iterations: 20,
    stretch_weight: 1.0,
    learning_rate: 1e-3,
};

fn trained(
    points: &[Vec3],
    how: NetworkOptions,
    grid: [usize; 2],
    threads: usize,
) -> (NetworkAtlas, Vec<Loss>) {
    Run { threads, seed: 3, ..Run::default() }
        .execute(|ctx| {
            let mut trainer = Trainer::on_grid(points, &how, grid, None, ctx)?;
            let losses =
                (0..how.iterations).map(|_| trainer.step(how.learning_rate, ctx)).collect::<Result<_>>()?;
            Ok((trainer.finish(ctx)?, losses))
        })
        .unwrap()
}

#[test]
fn training_that_leaves_the_finite_numbers_has_diverged() {
    let points = sphere(200);
    for network in [Network::Dense, Network::Conv] {
        let how = NetworkOptions { network, charts: 1, iterations: 20, learning_rate: 1e37, ..PAPER };
        let fitted = Run::default().execute(|ctx| fit(&points, &how, ctx));
        assert!(matches!(fitted, Err(Error::Diverged { .. })), "{network:?}: {:?}", fitted.err());
    }
}

#[test]
fn training_gives_the_same_bytes_for_any_number_of_threads_and_others_for_another_seed() {
    let points = sphere(500);
    // Two bands per chart, the last block not full; convolutions.
    for (network, grid, charts) in [(Network::Dense, [47, 49], 3), (Network::Conv, conv::GRID, 2)] {
        let how = NetworkOptions { network, charts, iterations: 3, ..PAPER };
        let (one, losses) = trained(&points, how, grid, 1);
        for threads in [2, 5] {
            let (other, again) = trained(&points, how, grid, threads);
            assert_eq!(one, other);
            assert_eq!(losses, again);
        }
        let other = Run { seed: 4, ..Run::default() }
            .execute(|ctx| Trainer::on_grid(&points, &how, grid, None, ctx)?.finish(ctx))
            .unwrap();
        assert_ne!(one.samples, other.samples);
    }
}

#[test]
fn a_sphere_is_learned_and_points_are_drawn_to_it() {
    let points = sphere(1500);
    let how = NetworkOptions { charts: 4, iterations: 250, ..PAPER };
    let (atlas, losses) = trained(&points, how, [16, 16], 0);
    assert!(losses[249].chamfer < 0.02 * losses[0].chamfer, "{:?} {:?}", losses[0], losses[249]);
    let mut rng = Rng::new(8);
    let noisy: Vec<Vec3> = points.iter().map(|p| p.map(|x| x + 0.03 * rng.normal())).collect();
    let feet =
        Run::default().execute(|ctx| Locator::new(&atlas.surface(), ctx)?.nearest_all(&noisy, ctx)).unwrap();
    let clean: Vec<Vec3> = feet.into_iter().map(|f| f.expect("points are finite").point).collect();
    let off = |points: &[Vec3]| -> f64 {
        (points.iter().map(|p| ((*p).norm() - 0.5).powi(2)).sum::<f64>() / points.len() as f64).sqrt()
    };
    assert!(off(&clean) < 0.6 * off(&noisy), "{} {}", off(&clean), off(&noisy));
}

#[test]
fn charts_that_start_as_patches_begin_on_the_scan_and_those_of_torch_do_not() {
    let points = sphere(1500);
    for network in [Network::Dense, Network::Conv] {
        let off = |start| {
            let how = NetworkOptions { network, start, charts: 4, ..PAPER };
            let grid = how.grid().map(|n| n.min(32));
            let atlas = Run::default()
                .execute(|ctx| Trainer::on_grid(&points, &how, grid, None, ctx)?.finish(ctx))
                .unwrap();
            let far = |p: &Vec3| ((*p).norm() - 0.5).powi(2);
            (atlas.samples.iter().map(far).sum::<f64>() / atlas.samples.len() as f64).sqrt()
        };
        // A flat patch of a quarter of a cell is near the sphere, but not on it.
        assert!(off(Start::Patches) < 0.08, "{network:?} {}", off(Start::Patches));
        assert!(off(Start::Torch) > 0.15, "{network:?} {}", off(Start::Torch));
    }
}

#[test]
fn eight_charts_leave_the_hole_of_a_ring_open() {
    let points: Vec<Vec3> = (0..3000)
        .map(|i| {
            let (a, b) = (f64::from(i) * 2.399_963, f64::from(i) * 0.7);
            let r = 0.47 + 0.03 * b.cos();
            Vec3([r * a.cos(), r * a.sin(), 0.03 * b.sin()])
        })
        .collect();
    let how = NetworkOptions { charts: 8, iterations: 60, start: Start::Patches, ..PAPER };
    let (atlas, _) = trained(&points, how, [16, 16], 0);
    let mesh = atlas.surface();
    let inside = mesh.triangles.iter().filter(|t| {
        let [x, y] = [0, 1].map(|k| t.iter().map(|v| mesh.positions[*v as usize][k]).sum::<f64>() / 3.0);
        x.hypot(y) < 0.3
    });
    assert_eq!(inside.count(), 0);
}

#[test]
fn a_curve_in_the_plane_follows_a_noisy_circle() {
    let mut rng = Rng::new(5);
    let points: Vec<Vec3> = (0..400)
        .map(|_| {
            let a = std::f64::consts::TAU * rng.uniform();
            Vec3([0.4 * a.cos() + 0.01 * rng.normal(), 0.4 * a.sin() + 0.01 * rng.normal(), 0.0])
        })
        .collect();
    let how = NetworkOptions { charts: 1, dim: Dim::Contour, flat: true, iterations: 300, ..PAPER };
    let (atlas, _) = trained(&points, NetworkOptions { learning_rate: 3e-3, ..how }, [1, 256], 0);
    assert!(atlas.samples.iter().all(|s| s[2] == 0.0));
    let off: f64 = atlas.samples.iter().map(|s| ((*s).norm() - 0.4).abs()).sum::<f64>() / 256.0;
    assert!(off < 0.02, "{off}");
    let mesh = atlas.surface();
    assert_eq!((mesh.triangles.len(), mesh.validate()), (255, Ok(())));
}

#[test]
fn convolutions_learn_a_small_patch() {
    let points: Vec<Vec3> = (0..400)
        .map(|i| [f64::from(i / 20) / 19.0 - 0.5, f64::from(i % 20) / 19.0 - 0.5])
        .map(|[x, y]| Vec3([x, y, 0.2 * x * x]))
        .collect();
    let how = NetworkOptions { network: Network::Conv, charts: 1, iterations: 40, ..PAPER };
    let (_, losses) = trained(&points, how, conv::GRID, 0);
    assert!(losses[39].chamfer < 0.1 * losses[0].chamfer, "{:?} {:?}", losses[0], losses[39]);
}

#[test]
fn thinned_steps_stand_for_whole_ones() {
    let points = sphere(2000);
    let how = NetworkOptions { charts: 2, stretch_weight: 100.0, ..PAPER };
    let [whole, thinned] = [0, 1].map(|thin| {
        Run::default()
            .execute(|ctx| {
                let mut trainer = Trainer::on_grid(&points, &how, [64, 64], None, ctx)?;
                trainer.thin(thin);
                trainer.step(1e-3, ctx)
            })
            .unwrap()
    });
    assert!((thinned.chamfer / whole.chamfer - 1.0).abs() < 0.05, "{whole:?} {thinned:?}");
    // A coarse line cuts corners, so that its edges are shorter than twice as long.
    assert!((thinned.stretch / whole.stretch - 1.0).abs() < 0.2, "{whole:?} {thinned:?}");
}

#[test]
fn a_stronger_stretch_gives_smaller_charts() {
    let points = sphere(400);
    let end = |stretch_weight| {
        let how = NetworkOptions { iterations: 60, stretch_weight, ..PAPER };
        let (atlas, _) = trained(&points, how, [12, 12], 0);
        let samples: Vec<Sample> = atlas.samples.iter().map(|s| s.to_f32()).collect();
        samples.chunks(144).map(|s| stretch(s, [12, 12], 1.0, &mut vec![[0.0; 3]; 144])).sum::<f64>()
    };
    let (none, some, much) = (end(0.0), end(30.0), end(1000.0));
    assert!(none > some && some > much, "{none} {some} {much}");
}

#[test]
fn charts_overlap_where_they_say_the_same() {
    let sheet = |x: f64| (0..64).map(move |i| Vec3([x + f64::from(i / 8), f64::from(i % 8), 0.0]));
    let atlas = |offset: f64| NetworkAtlas {
        charts: 2,
        grid: [8, 8],
        samples: sheet(0.0).chain(sheet(offset)).collect(),
    };
    let overlap = |step| atlasfit::Run::default().execute(|ctx| atlas(step).overlap(ctx));
    assert_eq!(overlap(100.0), Ok(0.0));
    assert_eq!(overlap(0.25), Ok(1.0));
}

#[test]
fn options_out_of_range_and_no_points_are_errors() {
    let attempt = |points: &[Vec3], how: NetworkOptions| {
        Run::default().execute(|ctx| fit(points, &how, ctx).map(|_| ())).unwrap_err()
    };
    let ok = NetworkOptions { iterations: 1, ..PAPER };
    for bad in [
        NetworkOptions { charts: 0, ..ok },
        NetworkOptions { stretch_weight: -1.0, ..ok },
        NetworkOptions { stretch_weight: f64::NAN, ..ok },
        NetworkOptions { learning_rate: 0.0, ..ok },
        NetworkOptions { learning_rate: f64::INFINITY, ..ok },
        NetworkOptions { network: Network::Conv, dim: Dim::Contour, ..ok },
        NetworkOptions { network: Network::Conv, flat: true, ..ok },
    ] {
        assert!(matches!(attempt(&sphere(20), bad), Error::InvalidArgument { .. }));
    }
    assert!(matches!(attempt(&[], ok), Error::EmptyInput { .. }));
}

#[test]
fn a_cancel_takes_effect_inside_a_step() {
    let token = CancelToken::new();
    let points = sphere(16_000);
    let watch = token.clone();
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(300));
        watch.cancel();
        Instant::now()
    });
    let how = NetworkOptions { iterations: 100_000, ..NetworkOptions::default() };
    let result =
        Run { cancel: Some(token), ..Run::default() }.execute(|ctx| fit(&points, &how, ctx).map(|_| ()));
    let late = canceller.join().unwrap().elapsed();
    assert_eq!(result, Err(Error::Cancelled));
    // The promise is 100 ms; a loaded machine must not fail the test.
    assert!(late < Duration::from_secs(5), "{late:?}");
}
