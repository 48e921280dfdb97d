//! How long `unwrap` takes on tori of a small and of a larger number of faces (the larger takes the coarse
//! way), and on what CAD programs make: discs that are one fan, cans, strips. The latter by number of faces:
//! it should grow no faster than n log n.
//!
//! `cargo bench -p atlasfit --bench unwrap`. A measurement: what else the machine does counts too.

#![allow(missing_docs, reason = "criterion's macros make public items")]

use atlasfit::Run;
use atlasfit::geometry::TriMesh;
use atlasfit::unwrap::{Packer, UnwrapOptions, unwrap};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// A torus of `n` by `n` quads, radii 2 and 1.
fn torus(n: usize) -> TriMesh {
    let tau = std::f64::consts::TAU;
    let point = |k: usize| {
        let (u, v) = (tau * (k / n) as f64 / n as f64, tau * (k % n) as f64 / n as f64);
        [(2.0 + v.cos()) * u.cos(), (2.0 + v.cos()) * u.sin(), v.sin()]
    };
    let at = |i: usize, j: usize| ((i % n) * n + j % n) as u32;
    let quad = |k: usize| {
        let (i, j) = (k / n, k % n);
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    };
    TriMesh::new((0..n * n).map(point).collect(), (0..n * n).flat_map(quad).collect())
}

fn tori(c: &mut Criterion) {
    let mut group = c.benchmark_group("unwrap");
    group.sample_size(10);
    for n in [32, 70, 140] {
        let mesh = torus(n);
        group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
        for (name, packer) in [("shapes", Packer::Shapes), ("boxes", Packer::Boxes)] {
            let options = UnwrapOptions::default().with_packer(packer);
            group.bench_function(BenchmarkId::new(name, mesh.triangles.len()), |b| {
                b.iter(|| {
                    Run::default().execute(|ctx| unwrap(&mesh, &options, ctx)).expect("a torus unwraps")
                });
            });
        }
    }
    group.finish();
}

/// A disc of `n` triangles about its middle.
fn fan(n: u32) -> TriMesh {
    let rim = |i: u32| {
        let (s, c) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
        [c, s, 0.0]
    };
    let positions = std::iter::once([0.0; 3]).chain((0..n).map(rim)).collect();
    TriMesh::new(positions, (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect())
}

/// A can of `n` triangles: two fans and a wall between them.
fn can(n: u32) -> TriMesh {
    let n = n / 4;
    let rim = |i: u32| {
        let (s, c) = (std::f64::consts::TAU * f64::from(i / 2) / f64::from(n)).sin_cos();
        [c, s, f64::from(i % 2)]
    };
    let positions = (0..2 * n).map(rim).chain([[0.0; 3], [0.0, 0.0, 1.0]]).collect();
    let around = |i: u32| {
        let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * ((i + 1) % n), 2 * ((i + 1) % n) + 1];
        [[2 * n, c, a], [2 * n + 1, b, d], [a, c, d], [a, d, b]]
    };
    TriMesh::new(positions, (0..n).flat_map(around).collect())
}

/// A flat strip of `n` triangles, one quad wide.
fn strip(n: u32) -> TriMesh {
    let n = n / 2;
    let positions = (0..2 * n + 2).map(|i| [f64::from(i / 2), f64::from(i % 2), 0.0]).collect();
    let quad = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]];
    TriMesh::new(positions, (0..n).flat_map(quad).collect())
}

fn hubs(c: &mut Criterion) {
    let mut group = c.benchmark_group("unwrap of hubs and strips");
    group.sample_size(10);
    for n in [1_000, 10_000, 100_000, 1_000_000] {
        group.throughput(Throughput::Elements(u64::from(n)));
        for (name, mesh) in [("fan", fan(n)), ("can", can(n)), ("strip", strip(n))] {
            group.bench_function(BenchmarkId::new(name, n), |b| {
                b.iter(|| {
                    (Run::default().execute(|ctx| unwrap(&mesh, &UnwrapOptions::default(), ctx)))
                        .expect("these unwrap")
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, tori, hubs);
criterion_main!(benches);
