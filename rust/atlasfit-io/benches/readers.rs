//! How long each reader takes for 200 000 points, or a mesh of as many vertices, that lie in memory.
//!
//! `cargo bench -p atlasfit-io --bench readers`. A measurement: what else the machine does counts too.

#![allow(missing_docs, reason = "criterion's macros make public items")]

use atlasfit::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
use atlasfit_io::{LoadOptions, SaveCloud, SaveMesh, load_bytes, save_cloud, save_mesh};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::path::{Path, PathBuf};

/// Points per side of the surface.
const SIDE: usize = 448;

/// A wavy height field with normals, colours and one attribute; neighbours are 0.1 apart.
fn surface() -> TriMesh {
    let n = SIDE * SIDE;
    let xy = |i: usize| [(i % SIDE) as f64, (i / SIDE) as f64];
    let height = |[x, y]: [f64; 2]| 4.0 * (x / 17.0).sin() * (y / 23.0).cos();
    let positions = (0..n).map(xy).map(|p| [50.0 + 0.1 * p[0], 40.0 + 0.1 * p[1], height(p)]).collect();
    let normal = |i: usize| if i.is_multiple_of(3) { [0.6, 0.0, 0.8] } else { [0.0, 0.0, 1.0] };
    let color = |i: usize| [i, i / 256, i / 7, 255].map(|c| (c % 256) as f32 / 255.0);
    let quad =
        |i: usize| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]].map(|t| t.map(|v| v as u32));
    TriMesh {
        positions,
        triangles: (0..n - SIDE).filter(|i| i % SIDE + 1 < SIDE).flat_map(quad).collect(),
        normals: Some((0..n).map(normal).collect()),
        colors: Some((0..n).map(color).collect()),
        attributes: vec![Attribute {
            name: "intensity".into(),
            width: 1,
            kind: ScalarKind::F32,
            values: (0..n).map(|i| (i % 1000) as f64 / 8.0).collect(),
        }],
        corner_uv: None,
        corner_normals: None,
        face_chart: None,
    }
}

/// The bytes of a file that `save` writes.
fn bytes_of(name: &str, save: impl Fn(&Path)) -> Vec<u8> {
    let path: PathBuf = std::env::temp_dir().join(format!("atlasfit-bench-{}-{name}", std::process::id()));
    save(&path);
    let bytes = std::fs::read(&path).expect("it was just written");
    std::fs::remove_file(&path).expect("it was just written");
    bytes
}

/// A LAS 1.2 file of point format 2 (with colour): positions in thousandths.
fn las(cloud: &PointCloud) -> Vec<u8> {
    const HEADER: u16 = 227;
    const RECORD: u16 = 26;
    let offset = cloud.positions[0];
    let mut out = vec![0u8; usize::from(HEADER)];
    out[..4].copy_from_slice(b"LASF");
    out[24..26].copy_from_slice(&[1, 2]);
    out[94..96].copy_from_slice(&HEADER.to_le_bytes());
    out[96..100].copy_from_slice(&u32::from(HEADER).to_le_bytes());
    out[104] = 2;
    out[105..107].copy_from_slice(&RECORD.to_le_bytes());
    out[107..111].copy_from_slice(&(cloud.len() as u32).to_le_bytes());
    for k in 0..3 {
        out[131 + 8 * k..][..8].copy_from_slice(&0.001f64.to_le_bytes());
        out[155 + 8 * k..][..8].copy_from_slice(&offset[k].to_le_bytes());
    }
    for (i, p) in cloud.positions.iter().enumerate() {
        for k in 0..3 {
            out.extend((((p[k] - offset[k]) * 1000.0).round() as i32).to_le_bytes());
        }
        out.extend((i as u16).to_le_bytes());
        out.extend([0b0001_0001, 2, 0, 0, 9, 0]);
        (0..3).for_each(|k| out.extend(((i >> k) as u16).to_le_bytes()));
    }
    out
}

/// A binary PCD file with packed colours.
fn pcd(cloud: &PointCloud) -> Vec<u8> {
    let n = cloud.len();
    let mut out = format!(
        "VERSION 0.7\nFIELDS x y z rgb\nSIZE 8 8 8 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {n}\nHEIGHT 1\n\
         POINTS {n}\nDATA binary\n"
    )
    .into_bytes();
    for (i, p) in cloud.positions.iter().enumerate() {
        p.iter().for_each(|c| out.extend(c.to_le_bytes()));
        out.extend((i as u32 & 0x00FF_FFFF).to_le_bytes());
    }
    out
}

fn readers(criterion: &mut Criterion) {
    let mesh = surface();
    let cloud = mesh.to_cloud();
    let ascii_cloud = SaveCloud::default().with_ascii(true);
    let of_cloud = |name: &str, how: &SaveCloud| {
        bytes_of(name, |path| drop(save_cloud(path, &cloud, how).expect("the folder takes files")))
    };
    let of_mesh = |name: &str| {
        let save = |path: &Path| drop(save_mesh(path, &mesh, &SaveMesh::default()).expect("as above"));
        bytes_of(name, save)
    };
    let files = [
        ("cloud/binary.ply", of_cloud("binary.ply", &SaveCloud::default())),
        ("cloud/ascii.ply", of_cloud("ascii.ply", &ascii_cloud)),
        ("cloud/a.xyz", of_cloud("a.xyz", &SaveCloud::default())),
        ("cloud/a.las", las(&cloud)),
        ("cloud/a.pcd", pcd(&cloud)),
        ("mesh/binary.ply", of_mesh("mesh.ply")),
        ("mesh/a.obj", of_mesh("a.obj")),
        ("mesh/a.off", of_mesh("a.off")),
        ("mesh/a.stl", of_mesh("a.stl")),
        ("mesh/a.glb", of_mesh("a.glb")),
    ];
    for (name, data) in &files {
        let read = || load_bytes(name.as_ref(), data, &LoadOptions::default()).expect("a file made here");
        assert_eq!(read().cloud.len(), cloud.len(), "{name}");
        let mut group = criterion.benchmark_group("read");
        group.sample_size(10).throughput(Throughput::Bytes(data.len() as u64));
        group.bench_function(*name, |b| b.iter(read));
        group.finish();
    }
}

criterion_group!(benches, readers);
criterion_main!(benches);
