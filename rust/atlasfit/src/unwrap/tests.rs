//! Claims about stopping: an unwrap ends at any check, and no worker goes long without one.

use super::*;
use crate::error::Error;
use crate::run::Run;
use crate::run::watch::Watch;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A disc of `n` triangles about its middle.
fn fan(n: usize) -> TriMesh {
    let rim = |i: usize| {
        let (s, c) = (TAU * i as f64 / n as f64).sin_cos();
        [c, s, 0.0]
    };
    let triangles = (0..n as u32).map(|i| [0, 1 + i, 1 + (i + 1) % n as u32]).collect();
    TriMesh::new(std::iter::once([0.0; 3]).chain((0..n).map(rim)).collect(), triangles)
}

/// `n` triangles that share no vertex.
fn soup(n: usize) -> TriMesh {
    let point = |k: usize| {
        let (i, turn) = (k / 3, TAU * (k % 3) as f64 / 3.0);
        let [x, y] = [(i as f64 * 0.618).fract() * 100.0, (i as f64 * 0.755).fract() * 100.0];
        [x + turn.cos(), y + turn.sin(), 0.1 * i as f64]
    };
    TriMesh::new(
        (0..3 * n).map(point).collect(),
        (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    )
}

/// A wavy sheet of about `n` triangles.
fn sheet(n: usize) -> TriMesh {
    let side = ((n / 2) as f64).sqrt() as usize;
    let point = |k: usize| {
        let [x, y] = [k / (side + 1), k % (side + 1)].map(|i| TAU * i as f64 / side as f64);
        [x, y, (2.0 * x).sin() * (3.0 * y).cos()]
    };
    let quad = |k: usize| {
        let a = (k / side * (side + 1) + k % side) as u32;
        let [b, c, d] = [a + 1, a + side as u32 + 1, a + side as u32 + 2];
        [[a, c, d], [a, d, b]]
    };
    let points = (0..(side + 1) * (side + 1)).map(point).collect();
    TriMesh::new(points, (0..side * side).flat_map(quad).collect())
}

#[test]
fn an_unwrap_that_is_stopped_at_any_check_ends_as_cancelled() {
    for mesh in [fan(300), soup(30), sheet(800)] {
        let run = |stop_at: Option<usize>| {
            let watch = Arc::new(Watch { stop_at, ..Watch::default() });
            let mut run = Run { watch: Some(watch.clone()), ..Run::default() };
            let result = run.execute(|ctx| unwrap(&mesh, &UnwrapOptions::default(), ctx));
            (result.err(), watch.checks.load(Ordering::Relaxed))
        };
        let (error, checks) = run(None);
        assert_eq!(error, None);
        let steps = (0..3).chain((1..9).map(|k| k * checks / 9)).chain(checks - 2..checks);
        for k in steps {
            assert_eq!(run(Some(k)).0, Some(Error::Cancelled), "stopped at check {k} of {checks}");
        }
    }
}

#[test]
#[ignore = "measures time"]
fn no_worker_goes_long_without_a_check() {
    let n = std::env::var("FACES").map_or(200_000, |n| n.parse().expect("a number of faces"));
    for (name, mesh) in [("fan", fan(n)), ("soup", soup(n)), ("sheet", sheet(n))] {
        let watch = Arc::new(Watch { timed: true, ..Watch::default() });
        let mut run = Run { threads: 1, watch: Some(watch.clone()), ..Run::default() };
        let seconds = run.execute(|ctx| {
            unwrap(&mesh, &UnwrapOptions::default(), ctx)?;
            Ok(ctx.stage_seconds())
        });
        println!("{name}: {} checks, {seconds:?}", watch.checks.load(Ordering::Relaxed));
        for (ms, place) in watch.longest().iter().take(12) {
            println!("{ms:8.1} ms  {place}");
        }
        assert!(watch.longest()[0].0 < 50.0, "{name}");
    }
}
