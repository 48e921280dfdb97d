//! Claims about stopping: a run ends at any check, and no worker goes long without one.

use super::*;
use crate::numeric::rng::Rng;
use crate::run::watch::Watch;
use crate::{CancelToken, Error};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A torus with noise of half its point spacing.
fn torus(n: usize) -> PointCloud {
    let mut rng = Rng::new(1);
    let spacing = (4.0 * std::f64::consts::PI.powi(2) * 0.4 / n as f64).sqrt();
    let point = |rng: &mut Rng| {
        let [a, b] = [0, 1].map(|_| std::f64::consts::TAU * rng.uniform());
        let r = 0.4 + 0.5 * spacing * rng.normal();
        let ring = 1.0 + r * b.cos();
        [ring * a.cos(), ring * a.sin(), r * b.sin()]
    };
    PointCloud::from_positions((0..n).map(|_| point(&mut rng)).collect())
}

/// Number of points from the environment, for measuring by hand.
fn points(default: usize) -> usize {
    std::env::var("POINTS").map_or(default, |n| n.parse().expect("a number of points"))
}

#[test]
fn a_run_that_is_stopped_at_any_check_ends_as_cancelled() {
    let cloud = torus(1200);
    let run = |stop_at: Option<usize>| {
        let watch = Arc::new(Watch { stop_at, ..Watch::default() });
        let mut run = Run { watch: Some(watch.clone()), ..Run::default() };
        (denoise(&cloud, &DenoiseOptions::default(), &mut run).err(), watch.checks.load(Ordering::Relaxed))
    };
    let (error, checks) = run(None);
    assert_eq!(error, None);
    assert!(checks > 200, "{checks}");
    // Checks are not spread evenly over the stages: early and late ones one by one, the rest by steps.
    let steps = (0..8).chain((1..12).map(|k| k * checks / 12)).chain(checks - 5..checks);
    for k in steps {
        assert_eq!(run(Some(k)).0, Some(Error::Cancelled), "stopped at check {k} of {checks}");
    }
}

#[test]
#[ignore = "measures time"]
fn no_worker_goes_long_without_a_check() {
    let watch = Arc::new(Watch { timed: true, ..Watch::default() });
    let mut run = Run { threads: 1, watch: Some(watch.clone()), ..Run::default() };
    let out = denoise(&torus(points(100_000)), &DenoiseOptions::default(), &mut run).unwrap();
    println!("{} checks, {:?}", watch.checks.load(Ordering::Relaxed), out.report.seconds);
    for (ms, place) in watch.longest().iter().take(40) {
        println!("{ms:8.1} ms  {place}");
    }
    assert!(watch.longest()[0].0 < 50.0);
}

#[test]
#[ignore = "measures time"]
fn a_cancel_takes_effect_within_a_tenth_of_a_second() {
    let cloud = torus(points(200_000));
    let mut rng = Rng::new(2);
    let started = Instant::now();
    denoise(&cloud, &DenoiseOptions::default(), &mut Run::default()).unwrap();
    let whole = started.elapsed();
    let mut took: Vec<(Duration, Duration)> = (0..40)
        .map(|_| {
            let after = whole.mul_f64(rng.uniform() * 0.95);
            let token = CancelToken::new();
            std::thread::scope(|s| {
                let other = token.clone();
                let asked = s.spawn(move || {
                    std::thread::sleep(after);
                    other.cancel();
                    Instant::now()
                });
                let mut run = Run { cancel: Some(token), ..Run::default() };
                let result = denoise(&cloud, &DenoiseOptions::default(), &mut run);
                let ended = Instant::now();
                let asked = asked.join().expect("the other thread only sleeps");
                assert!(ended < asked || result.is_err());
                (ended.saturating_duration_since(asked), after)
            })
        })
        .collect();
    took.sort();
    println!("whole run {whole:?}; the cancel took, after:");
    took.iter().rev().take(10).for_each(|t| println!("{:?}, {:?}", t.0, t.1));
    println!("median {:?}", took[took.len() / 2].0);
    assert!(took[took.len() - 1].0 < Duration::from_millis(100));
}
