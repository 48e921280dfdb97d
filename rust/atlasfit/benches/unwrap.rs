//! How long `unwrap` takes on tori of a small and of a larger number of faces; the larger takes the coarse way.
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

criterion_group!(benches, tori);
criterion_main!(benches);
