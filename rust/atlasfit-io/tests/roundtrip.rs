//! Write, then read, gives the same data: for each format and whatever it can hold.

mod common;

use atlasfit::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
use atlasfit_io::{LoadOptions, SaveCloud, SaveMesh, load, save_cloud, save_mesh};
use common::Folder;
use proptest::prelude::*;

const KINDS: [ScalarKind; 8] = [
    ScalarKind::U8,
    ScalarKind::I8,
    ScalarKind::U16,
    ScalarKind::I16,
    ScalarKind::U32,
    ScalarKind::I32,
    ScalarKind::F32,
    ScalarKind::F64,
];

/// A number that a kind holds exactly.
fn fitting(kind: ScalarKind, bits: u32) -> f64 {
    match kind {
        ScalarKind::U8 => f64::from(bits as u8),
        ScalarKind::I8 => f64::from(bits as i8),
        ScalarKind::U16 => f64::from(bits as u16),
        ScalarKind::I16 => f64::from(bits as i16),
        ScalarKind::U32 => f64::from(bits),
        ScalarKind::I32 => f64::from(bits as i32),
        ScalarKind::F32 => f64::from(bits as f32 / 7.0),
        ScalarKind::F64 => f64::from(bits) / 7.0,
    }
}

/// What a test wants in its data.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    normals: bool,
    colors: bool,
    alpha: bool,
    attributes: usize,
    uv: bool,
    charts: bool,
    double: bool,
}

fn wanted() -> impl Strategy<Value = Wanted> {
    (any::<[bool; 6]>(), 0usize..3).prop_map(|([normals, colors, alpha, uv, charts, double], attributes)| {
        Wanted { normals, colors, alpha, attributes, uv, charts, double }
    })
}

/// A mesh of distinct vertices, each used by a triangle, with random content made from `seeds`.
fn mesh(w: Wanted, seeds: &[u32]) -> TriMesh {
    let n = seeds.len();
    let number = |i: usize, k: u32| {
        let v = f64::from(seeds[i].wrapping_mul(2_654_435_761).wrapping_add(k * 40_503) % 1_000_003) / 1000.0;
        // Distinct per vertex, whatever the seed.
        let v = v + 2000.0 * i as f64 * f64::from(k == 0);
        if w.double { v + 1e6 } else { f64::from(v as f32) }
    };
    let float = |i: usize, k: usize| (seeds[i] >> k & 0xFFFF) as f32 / 300.0 - 100.0;
    let byte = |i: usize, k: usize| f32::from((seeds[i] >> (5 * k)) as u8) / 255.0;
    let unit = |i: usize| {
        let v = [0, 7, 14].map(|k| f64::from(float(i, k)) + 0.01);
        let l = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        v.map(|c| (c / l) as f32)
    };
    let triangles: Vec<[u32; 3]> =
        (0..n as u32).map(|i| [i, (i + 1) % n as u32, (i + 2) % n as u32]).collect();
    let attributes = (0..w.attributes)
        .map(|a| {
            let kind = KINDS[(seeds[0] as usize + a) % KINDS.len()];
            let width = 1 + (seeds[1] as usize + a) % 2;
            let values =
                (0..n * width).map(|i| fitting(kind, seeds[i / width].rotate_left(a as u32 + 3))).collect();
            Attribute { name: format!("label{a}"), width, kind, values }
        })
        .collect();
    TriMesh {
        positions: (0..n).map(|i| [0, 1, 2].map(|k| number(i, k))).collect(),
        normals: w.normals.then(|| (0..n).map(unit).collect()),
        colors: w.colors.then(|| {
            (0..n)
                .map(|i| [byte(i, 0), byte(i, 1), byte(i, 2), if w.alpha { byte(i, 3) } else { 1.0 }])
                .collect()
        }),
        attributes,
        corner_uv: w.uv.then(|| {
            triangles.iter().map(|t| t.map(|v| [float(v as usize, 3), float(v as usize, 9)])).collect()
        }),
        corner_normals: None,
        face_chart: w.charts.then(|| (0..n as u32).map(|i| if i == 1 { u32::MAX } else { i / 3 }).collect()),
        triangles,
    }
}

fn through(name: &str, mesh: &TriMesh, ascii: bool) -> (TriMesh, Vec<String>) {
    let folder = Folder::new();
    let path = folder.join(name);
    let saved = save_mesh(&path, mesh, &SaveMesh::default().with_ascii(ascii)).unwrap();
    let loaded = load(&path, &LoadOptions::default()).unwrap();
    (loaded.into_mesh(), saved.lost)
}

fn cloud_through(name: &str, cloud: &PointCloud) -> PointCloud {
    let folder = Folder::new();
    let path = folder.join(name);
    save_cloud(&path, cloud, &SaveCloud::default()).unwrap();
    load(&path, &LoadOptions::default()).unwrap().cloud
}

fn near(a: f32, b: f32) -> bool {
    (a - b).abs() <= 2e-6 * b.abs().max(1.0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn ply_gives_everything_back(
        w in wanted(), seeds in prop::collection::vec(any::<u32>(), 3..40), ascii: bool
    ) {
        let mesh = mesh(w, &seeds);
        let (back, lost) = through("a.ply", &mesh, ascii);
        prop_assert_eq!(&back, &mesh);
        prop_assert!(lost.is_empty(), "{:?}", lost);
        prop_assert_eq!(cloud_through("a.ply", &mesh.to_cloud()), mesh.to_cloud());
    }

    #[test]
    fn obj_gives_back_what_it_does_not_call_lost(
        w in wanted(), seeds in prop::collection::vec(any::<u32>(), 3..40)
    ) {
        let mesh = mesh(w, &seeds);
        let (back, lost) = through("a.obj", &mesh, false);
        let mut expected = mesh.clone();
        if expected.colors.iter().flatten().any(|c| c[3] != 1.0) {
            expected.colors.iter_mut().flatten().for_each(|c| c[3] = 1.0);
            prop_assert!(lost.iter().any(|l| l.contains("opacity")));
        }
        prop_assert_eq!(lost.iter().any(|l| l.contains("attributes")), !mesh.attributes.is_empty());
        expected.attributes.clear();
        expected.face_chart = None;
        prop_assert_eq!(&back, &expected);
        let cloud = PointCloud { attributes: vec![], ..expected.to_cloud() };
        prop_assert_eq!(cloud_through("a.obj", &cloud), cloud);
    }

    #[test]
    fn off_gives_back_geometry_normals_and_colours(
        w in wanted(), seeds in prop::collection::vec(any::<u32>(), 3..40)
    ) {
        let mesh = mesh(w, &seeds);
        let (back, _) = through("a.off", &mesh, false);
        prop_assert_eq!(&back.positions, &mesh.positions);
        prop_assert_eq!(&back.triangles, &mesh.triangles);
        prop_assert_eq!(&back.normals, &mesh.normals);
        prop_assert_eq!(&back.colors, &mesh.colors);
    }

    #[test]
    fn stl_gives_back_the_triangles(
        w in wanted(), seeds in prop::collection::vec(any::<u32>(), 3..40), ascii: bool
    ) {
        let mesh = mesh(Wanted { double: w.double && ascii, ..w }, &seeds);
        let (back, _) = through("a.stl", &mesh, ascii);
        let corners = |m: &TriMesh| -> Vec<[[f64; 3]; 3]> {
            m.triangles.iter().map(|t| t.map(|v| m.positions[v as usize])).collect()
        };
        prop_assert_eq!(corners(&back), corners(&mesh));
        prop_assert_eq!(back.positions.len(), mesh.positions.len());
    }

    #[test]
    fn glb_gives_everything_back_to_float_precision(
        w in wanted(), seeds in prop::collection::vec(any::<u32>(), 3..40)
    ) {
        let mesh = mesh(w, &seeds);
        let (back, lost) = through("a.glb", &mesh, false);
        let digits_lost = lost.iter().any(|l| l.contains("digits of the positions"));
        let extent = 2000.0 * seeds.len() as f64 + 1000.0;
        for (a, b) in back.positions.iter().flatten().zip(mesh.positions.iter().flatten()) {
            prop_assert!(if digits_lost { (a - b).abs() < 1e-7 * extent } else { a == b }, "{} {}", a, b);
        }
        prop_assert_eq!(&back.triangles, &mesh.triangles);
        prop_assert_eq!(&back.normals, &mesh.normals);
        prop_assert_eq!(back.colors.is_some(), mesh.colors.is_some());
        for (a, b) in back.colors.iter().flatten().flatten().zip(mesh.colors.iter().flatten().flatten()) {
            prop_assert!(near(*a, *b));
        }
        let uv = |m: &TriMesh| -> Vec<f32> {
            m.corner_uv.iter().flatten().flatten().flatten().copied().collect()
        };
        prop_assert_eq!(uv(&back).len(), uv(&mesh).len());
        prop_assert!(uv(&back).iter().zip(uv(&mesh)).all(|(a, b)| (a - b).abs() < 1e-4));
        prop_assert_eq!(back.attributes.len(), mesh.attributes.len());
        for (a, b) in back.attributes.iter().zip(&mesh.attributes) {
            prop_assert_eq!(&a.name, &b.name);
            prop_assert!(a.values.iter().zip(&b.values).all(|(a, b)| *a == f64::from(*b as f32)));
        }
    }

    #[test]
    fn one_format_after_another_gives_what_both_hold(
        w in wanted(),
        seeds in prop::collection::vec(any::<u32>(), 3..40),
        formats in prop::sample::subsequence(vec!["ply", "obj", "off", "glb", "stl"], 2),
        turned: bool,
    ) {
        let mesh = mesh(Wanted { double: false, ..w }, &seeds);
        let [first, second] = if turned { [formats[1], formats[0]] } else { [formats[0], formats[1]] };
        let (between, _) = through(&format!("a.{first}"), &mesh, false);
        let (back, _) = through(&format!("a.{second}"), &between, false);
        let pair = [first, second];
        let holds = |without: &[&str]| !pair.iter().any(|f| without.contains(f));
        // Per corner: STL and GLB number the vertices anew.
        fn corners<T: Copy, U>(m: &TriMesh, of: &[T], number: impl Fn(T) -> U) -> Vec<U> {
            m.triangles.iter().flatten().map(|&v| number(of[v as usize])).collect()
        }
        let same = |a: Vec<f64>, b: Vec<f64>, off: f64| {
            a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= off)
        };
        let places = |m: &TriMesh| corners(m, &m.positions, |p| p).concat();
        // GLB may move the origin.
        let off = if pair.contains(&"glb") { 1e-7 * (2000.0 * seeds.len() as f64 + 1000.0) } else { 0.0 };
        prop_assert!(same(places(&back), places(&mesh), off), "{:?}", pair);
        let normals = |m: &TriMesh| {
            m.normals
                .iter()
                .flat_map(|n| corners(m, n, |n| n.map(f64::from)))
                .flatten()
                .collect::<Vec<_>>()
        };
        let none = vec![];
        prop_assert!(
            same(normals(&back), if holds(&["stl"]) { normals(&mesh) } else { none.clone() }, 1e-6),
            "{:?}",
            pair
        );
        let colors = |m: &TriMesh| {
            let numbers = if holds(&["obj"]) { 4 } else { 3 };
            m.colors
                .iter()
                .flat_map(|c| {
                    corners(m, c, |c| c[..numbers].iter().map(|&c| f64::from(c)).collect::<Vec<_>>())
                })
                .flatten()
                .collect::<Vec<_>>()
        };
        prop_assert!(
            same(colors(&back), if holds(&["stl"]) { colors(&mesh) } else { none.clone() }, 2e-6),
            "{:?}",
            pair
        );
        let uv = |m: &TriMesh| {
            m.corner_uv.iter().flatten().flatten().flatten().map(|&v| f64::from(v)).collect::<Vec<_>>()
        };
        prop_assert!(
            same(uv(&back), if holds(&["stl", "off"]) { uv(&mesh) } else { none }, 1e-4),
            "{:?}",
            pair
        );
    }

    #[test]
    fn columns_of_numbers_give_the_points_back(
        w in wanted(),
        seeds in prop::collection::vec(any::<u32>(), 3..40),
        extension in prop::sample::select(vec!["xyz", "csv", "txt", "asc", "pts"]),
    ) {
        let cloud = mesh(w, &seeds).to_cloud();
        let back = cloud_through(&format!("a.{extension}"), &cloud);
        prop_assert_eq!(&back.positions, &cloud.positions);
        prop_assert_eq!(&back.normals, &cloud.normals);
        prop_assert_eq!(&back.colors, &cloud.colors);
        // Attributes of several numbers become columns of their own; kinds are not written.
        let columns: Vec<Vec<f64>> = cloud.attributes.iter().flat_map(|a| {
            (0..a.width).map(|k| a.values.iter().skip(k).step_by(a.width).copied().collect::<Vec<_>>())
        }).collect();
        let read: Vec<Vec<f64>> = back.attributes.iter().map(|a| a.values.clone()).collect();
        prop_assert_eq!(read, columns);
    }

    #[test]
    fn the_same_cloud_in_every_format_has_the_same_positions(
        seeds in prop::collection::vec(any::<u32>(), 3..40)
    ) {
        let w = Wanted {
            normals: true, colors: true, alpha: false, attributes: 0, uv: false, charts: false, double: true
        };
        let cloud = mesh(w, &seeds).to_cloud();
        for name in ["a.ply", "a.obj", "a.off", "a.xyz", "a.csv", "a.pts"] {
            prop_assert_eq!(cloud_through(name, &cloud), cloud.clone());
        }
    }
}
