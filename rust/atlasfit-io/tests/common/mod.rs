#![allow(dead_code, reason = "each test file uses a part")]
//! Small files of every format, made here, and a folder that vanishes.

use atlasfit::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
use atlasfit_io::{LoadOptions, Loaded, SaveCloud, SaveMesh, load_bytes};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A folder of its own for a test, deleted when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("atlasfit-io-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
    pub fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn read(name: &str, data: &[u8]) -> Loaded {
    load_bytes(Path::new(name), data, &LoadOptions::default()).unwrap()
}

/// A cube of 8 vertices and 12 triangles with everything that a mesh can have.
pub fn cube() -> TriMesh {
    let positions: Vec<[f64; 3]> =
        (0..8).map(|i| [f64::from(i & 1), f64::from(i >> 1 & 1) * 2.0, f64::from(i >> 2) * 3.25]).collect();
    let triangles = vec![
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    let corner_uv =
        (0..12).map(|t| [0, 1, 2].map(|k| [(t * 3 + k) as f32 / 64.0, (t + k) as f32 / 16.0])).collect();
    TriMesh {
        normals: Some((0..8).map(|i| if i % 2 == 0 { [0.0, 0.0, 1.0] } else { [0.0, -1.0, 0.0] }).collect()),
        colors: Some((0..8u8).map(|i| [i * 30, 255 - i, 7, 255].map(|c| f32::from(c) / 255.0)).collect()),
        attributes: vec![Attribute {
            name: "intensity".into(),
            width: 1,
            kind: ScalarKind::F32,
            values: (0..8).map(|i| f64::from(i) * 0.5).collect(),
        }],
        corner_uv: Some(corner_uv),
        corner_normals: None,
        face_chart: Some((0..12).map(|t| t / 2).collect()),
        positions,
        triangles,
    }
}

/// Saves to a file of this name and gives its bytes.
pub fn saved_mesh(name: &str, mesh: &TriMesh, options: &SaveMesh<'_>) -> Vec<u8> {
    let folder = Folder::new();
    atlasfit_io::save_mesh(&folder.join(name), mesh, options).unwrap();
    std::fs::read(folder.join(name)).unwrap()
}

pub fn saved_cloud(name: &str, cloud: &PointCloud) -> Vec<u8> {
    let folder = Folder::new();
    atlasfit_io::save_cloud(&folder.join(name), cloud, &SaveCloud::default()).unwrap();
    std::fs::read(folder.join(name)).unwrap()
}

pub fn pcd_header(data: &str, points: usize) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb label\nSIZE 4 4 4 4 2\n\
         TYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n\
         POINTS {points}\nDATA {data}\n"
    )
}

/// Point i of the PCD samples: position, packed colour, label.
pub fn pcd_point(i: usize) -> ([f32; 3], u32, u16) {
    ([i as f32, 0.5 * i as f32, -1.25], 0x00FF_8000 + i as u32, 7 + (i % 3) as u16)
}

pub fn pcd_binary(points: usize) -> Vec<u8> {
    let mut out = pcd_header("binary", points).into_bytes();
    for i in 0..points {
        let (p, c, l) = pcd_point(i);
        p.iter().for_each(|v| out.extend(v.to_le_bytes()));
        out.extend(c.to_le_bytes());
        out.extend(l.to_le_bytes());
    }
    out
}

/// Packed by literal runs and, where bytes repeat, by one back reference.
pub fn pcd_compressed(points: usize) -> Vec<u8> {
    let all: Vec<_> = (0..points).map(pcd_point).collect();
    let mut body: Vec<u8> = Vec::new();
    for k in 0..3 {
        all.iter().for_each(|p| body.extend(p.0[k].to_le_bytes()));
    }
    all.iter().for_each(|p| body.extend(p.1.to_le_bytes()));
    all.iter().for_each(|p| body.extend(p.2.to_le_bytes()));
    let mut packed: Vec<u8> = Vec::new();
    let mut i = 0;
    while i < body.len() {
        // -1.25 repeats every 4 bytes in the third field.
        let run = (i..body.len()).take_while(|&k| k >= 4 && body[k] == body[k - 4]).count().min(264);
        if run >= 9 {
            packed.extend([0xE0, (run - 9) as u8, 3]);
            i += run;
        } else {
            packed.extend([0, body[i]]);
            i += 1;
        }
    }
    let mut out = pcd_header("binary_compressed", points).into_bytes();
    out.extend((packed.len() as u32).to_le_bytes());
    out.extend((body.len() as u32).to_le_bytes());
    out.extend(packed);
    out
}

/// A LAS record of point format 3 (with GPS time and colour): i scaled by 0.001.
fn las_record(i: i32) -> Vec<u8> {
    let mut r = Vec::new();
    for v in [i, 2 * i, -i] {
        r.extend(v.to_le_bytes());
    }
    r.extend(((100 + i % 1000) as u16).to_le_bytes()); // intensity
    r.extend([0b0001_0001, 2, 0, 0]); // return 1 of 2, class 2
    r.extend(9u16.to_le_bytes()); // source
    r.extend((1e5 + f64::from(i)).to_le_bytes());
    for c in [65535u16, 32768, i as u16] {
        r.extend(c.to_le_bytes());
    }
    r
}

/// A LAS 1.2 header: numbers are thousandths, (1e6, 2e6, 3e6) is added.
pub fn las_header(points: u32, format: u8, vlr: &[u8], record: u16) -> Vec<u8> {
    let mut h = vec![0u8; 227];
    h[..4].copy_from_slice(b"LASF");
    h[24] = 1;
    h[25] = 2;
    h[94..96].copy_from_slice(&227u16.to_le_bytes());
    let vlr_bytes = if vlr.is_empty() { 0 } else { 54 + vlr.len() as u32 };
    h[96..100].copy_from_slice(&(227 + vlr_bytes).to_le_bytes());
    h[100..104].copy_from_slice(&u32::from(!vlr.is_empty()).to_le_bytes());
    h[104] = format;
    h[105..107].copy_from_slice(&record.to_le_bytes());
    h[107..111].copy_from_slice(&points.to_le_bytes());
    for k in 0..3 {
        h[131 + 8 * k..139 + 8 * k].copy_from_slice(&0.001f64.to_le_bytes());
        h[155 + 8 * k..163 + 8 * k].copy_from_slice(&(1e6 * (k + 1) as f64).to_le_bytes());
    }
    if !vlr.is_empty() {
        let mut v = vec![0u8; 54];
        v[2..16].copy_from_slice(b"laszip encoded");
        v[18..20].copy_from_slice(&22204u16.to_le_bytes());
        v[20..22].copy_from_slice(&(vlr.len() as u16).to_le_bytes());
        h.extend(v);
        h.extend(vlr);
    }
    h
}

pub fn las(points: u32) -> Vec<u8> {
    let mut out = las_header(points, 3, &[], 34);
    (0..points as i32).for_each(|i| out.extend(las_record(i)));
    out
}

/// The same point as a record of format 7 (LAS 1.4, packed in layers).
fn las14_record(i: i32) -> Vec<u8> {
    let old = las_record(i);
    let mut r = old[..14].to_vec();
    r.extend([0b0010_0001, 0, 2, 0, 0, 0]);
    r.extend(&old[18..34]);
    r
}

/// LAZ of point format 3 or 7.
pub fn laz(points: u32, format: u8) -> Vec<u8> {
    laz_of(points, format, if format == 3 { las_record } else { las14_record })
}

/// LAZ of these records.
pub fn laz_of(points: u32, format: u8, record: impl Fn(i32) -> Vec<u8>) -> Vec<u8> {
    let items = laz::LazItemRecordBuilder::default_for_point_format_id(format, 0).unwrap();
    let vlr = laz::LazVlr::from_laz_items(items);
    let mut bytes = Vec::new();
    vlr.write_to(&mut bytes).unwrap();
    let header = las_header(points, format | 0x80, &bytes, record(0).len() as u16);
    let mut out = std::io::Cursor::new(header);
    out.set_position(out.get_ref().len() as u64);
    let mut packer = laz::LasZipCompressor::new(&mut out, vlr).unwrap();
    (0..points as i32).for_each(|i| packer.compress_one(&record(i)).unwrap());
    packer.done().unwrap();
    drop(packer);
    out.into_inner()
}

/// Two scans of three points each; the second is moved by (10, 0, 0).
pub fn e57() -> Vec<u8> {
    use e57::{E57Writer, Record, RecordValue, Transform, Translation};
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut bytes, "file").unwrap();
    for scan in 0..2 {
        let prototype = vec![
            Record::CARTESIAN_X_F64,
            Record::CARTESIAN_Y_F64,
            Record::CARTESIAN_Z_F64,
            Record::COLOR_RED_U8,
            Record::COLOR_GREEN_U8,
            Record::COLOR_BLUE_U8,
        ];
        let mut points = writer.add_pointcloud(&format!("scan {scan}"), prototype).unwrap();
        points.set_transform(Some(Transform {
            translation: Translation { x: 10.0 * f64::from(scan), y: 0.0, z: 0.0 },
            ..Transform::default()
        }));
        for i in 0..3 {
            let mut values: Vec<RecordValue> =
                [f64::from(i), 0.125, 1e6].into_iter().map(RecordValue::Double).collect();
            values.extend([255, 0, i64::from(i)].map(RecordValue::Integer));
            points.add_point(values).unwrap();
        }
        points.finalize().unwrap();
    }
    writer.finalize().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// One file of every kind.
pub fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let cube = cube();
    let binary = SaveMesh::default();
    let text = SaveMesh::default().with_ascii(true);
    let cloud = cube.to_cloud();
    let mut out: Vec<(&'static str, Vec<u8>)> = vec![
        ("binary.ply", saved_mesh("a.ply", &cube, &binary)),
        ("ascii.ply", saved_mesh("a.ply", &cube, &text)),
        ("a.obj", saved_mesh("a.obj", &cube, &binary)),
        ("a.off", saved_mesh("a.off", &cube, &binary)),
        ("binary.stl", saved_mesh("a.stl", &cube, &binary)),
        ("ascii.stl", saved_mesh("a.stl", &cube, &text)),
        ("a.glb", saved_mesh("a.glb", &cube, &binary)),
        ("a.xyz", saved_cloud("a.xyz", &cloud)),
        ("a.csv", saved_cloud("a.csv", &cloud)),
        ("binary.pcd", pcd_binary(50)),
        ("compressed.pcd", pcd_compressed(50)),
        ("a.las", las(50)),
        ("a.laz", laz(500, 3)),
        ("layered.laz", laz(500, 7)),
        ("a.e57", e57()),
    ];
    let mut ascii = pcd_header("ascii", 20).into_bytes();
    for i in 0..20 {
        let (p, c, l) = pcd_point(i);
        ascii.extend(format!("{} {} {} {} {l}\n", p[0], p[1], p[2], f32::from_bits(c)).into_bytes());
    }
    out.push(("ascii.pcd", ascii));
    out
}
