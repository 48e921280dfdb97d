//! How long the steps of `denoise` take on a noisy torus: cutting into patches, fitting charts, contouring,
//! cleaning.
//!
//! `cargo bench -p atlasfit --features benchmarks --bench denoise_steps`. A measurement: what else the
//! machine does counts too.

#![allow(missing_docs, reason = "criterion's macros make public items")]

use atlasfit::geometry::PointCloud;
use atlasfit::numeric::Rng;
use atlasfit::pipeline::benchmarks::Steps;
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// Points on a torus of radii 2 and 1, with noise of 0.01.
fn torus(n: usize) -> PointCloud {
    let mut rng = Rng::new(1);
    let mut point = || {
        // Even in area: the outside of a torus holds more of it than the inside.
        let v = loop {
            let v = std::f64::consts::TAU * rng.uniform();
            if 3.0 * rng.uniform() < 2.0 + v.cos() {
                break v;
            }
        };
        let (u, r) = (std::f64::consts::TAU * rng.uniform(), 1.0 + 0.01 * rng.normal());
        [(2.0 + r * v.cos()) * u.cos(), (2.0 + r * v.cos()) * u.sin(), r * v.sin()]
    };
    PointCloud::from_positions((0..n).map(|_| point()).collect())
}

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("denoise");
    group.sample_size(10);
    for n in [4_000, 16_000] {
        let steps = Steps::new(&torus(n)).expect("a torus is denoised");
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("partition", n), |b| {
            b.iter(|| steps.partition().expect("it is cut"))
        });
        group.bench_function(BenchmarkId::new("fit", n), |b| b.iter(|| steps.fit().expect("it is fitted")));
        group.bench_function(BenchmarkId::new("contour", n), |b| {
            b.iter_batched(
                || steps.distance().expect("a torus has a distance"),
                |distance| Steps::contour(distance).expect("it is contoured"),
                BatchSize::PerIteration,
            );
        });
        group.bench_function(BenchmarkId::new("clean", n), |b| {
            b.iter_batched(
                || steps.quads(),
                |quads| steps.clean(quads).expect("it is cleaned"),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
