//! How long the steps of `unwrap` take on a bumpy torus: cutting into patches, merging charts, packing.
//!
//! `cargo bench -p atlasfit --features benchmarks --bench unwrap_steps`. A measurement: what else the machine
//! does counts too.

#![allow(missing_docs, reason = "criterion's macros make public items")]

use atlasfit::geometry::TriMesh;
use atlasfit::unwrap::benchmarks::Steps;
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// A torus of `n` by `n` quads, radii 2 and 1, with bumps of 0.05.
fn torus(n: usize) -> TriMesh {
    let tau = std::f64::consts::TAU;
    let point = |k: usize| {
        let (u, v) = (tau * (k / n) as f64 / n as f64, tau * (k % n) as f64 / n as f64);
        let r = 1.0 + 0.05 * (8.0 * u).sin() * (4.0 * v).sin();
        [(2.0 + r * v.cos()) * u.cos(), (2.0 + r * v.cos()) * u.sin(), r * v.sin()]
    };
    let at = |i: usize, j: usize| ((i % n) * n + j % n) as u32;
    let quad = |k: usize| {
        let (i, j) = (k / n, k % n);
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    };
    TriMesh::new((0..n * n).map(point).collect(), (0..n * n).flat_map(quad).collect())
}

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("unwrap");
    group.sample_size(10);
    for n in [32, 70] {
        let mesh = torus(n);
        let faces = mesh.triangles.len();
        let steps = Steps::new(&mesh).expect("a torus unwraps");
        group.throughput(Throughput::Elements(faces as u64));
        group.bench_function(BenchmarkId::new("segment", faces), |b| {
            b.iter(|| steps.segment().expect("it is cut"))
        });
        group.bench_function(BenchmarkId::new("merge", faces), |b| {
            b.iter_batched(
                || steps.first(),
                |first| steps.merge(first).expect("they are merged"),
                BatchSize::PerIteration,
            );
        });
        group.bench_function(BenchmarkId::new("pack", faces), |b| {
            b.iter_batched(
                || steps.merged(),
                |merged| steps.pack(merged).expect("they are packed"),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
