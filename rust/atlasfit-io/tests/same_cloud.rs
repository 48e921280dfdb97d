//! One cloud in every format gives the same bytes after denoising: no format changes a coordinate, the order,
//! or the count.

mod common;

use atlasfit::geometry::PointCloud;
use atlasfit::{DenoiseOptions, Run, denoise};
use atlasfit_io::{LoadOptions, SaveCloud, SaveMesh, load, save_cloud, save_mesh};
use common::Folder;

/// Points near a sphere in steps of 1/1024: exact as 32-bit floats, as short decimals and as LAS integers.
fn cloud() -> Vec<[i32; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..1500)
        .map(|i| {
            let z = 1.0 - (f64::from(i) + 0.5) / 750.0;
            let (r, angle) = ((1.0 - z * z).sqrt(), golden * f64::from(i));
            // A bump in every point stands for noise.
            let size = 1024.0 * (1.0 + 0.004 * f64::from(i * 7919 % 13 - 6) / 6.0);
            [r * angle.cos(), r * angle.sin(), z].map(|x| (x * size).round() as i32)
        })
        .collect()
}

fn las_record(p: [i32; 3]) -> Vec<u8> {
    let mut record: Vec<u8> = p.iter().flat_map(|v| v.to_le_bytes()).collect();
    record.resize(20, 0);
    record
}

fn with_scale(mut las: Vec<u8>) -> Vec<u8> {
    for k in 0..3 {
        las[131 + 8 * k..139 + 8 * k].copy_from_slice(&(1.0f64 / 1024.0).to_le_bytes());
        las[155 + 8 * k..163 + 8 * k].copy_from_slice(&0f64.to_le_bytes());
    }
    las
}

fn e57(points: &[[f64; 3]]) -> Vec<u8> {
    use e57::{E57Writer, Record, RecordValue};
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut bytes, "file").unwrap();
    let columns = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    let mut out = writer.add_pointcloud("scan", columns).unwrap();
    for p in points {
        out.add_point(p.iter().map(|&x| RecordValue::Double(x)).collect()).unwrap();
    }
    out.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    bytes.into_inner()
}

#[test]
fn the_same_cloud_in_every_format_gives_the_same_bytes() {
    let steps = cloud();
    let n = steps.len();
    let positions: Vec<[f64; 3]> = steps.iter().map(|p| p.map(|x| f64::from(x) / 1024.0)).collect();
    let plain = PointCloud::from_positions(positions.clone());
    let folder = Folder::new();
    // Other writers' files; those of ours lie in the folder, a .gltf with its data beside it.
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut names: Vec<String> = Vec::new();
    for name in ["binary.ply", "text.ply", "a.obj", "a.off", "a.xyz", "a.csv", "a.pts", "a.glb", "text.gltf"]
    {
        let path = folder.join(name);
        save_cloud(&path, &plain, &SaveCloud::default().with_ascii(name.starts_with("text"))).unwrap();
        names.push(name.into());
    }
    let mut las = common::las_header(n as u32, 0, &[], 20);
    steps.iter().for_each(|&p| las.extend(las_record(p)));
    files.push(("a.las".into(), with_scale(las)));
    files.push(("a.laz".into(), with_scale(common::laz_of(n as u32, 0, |i| las_record(steps[i as usize])))));
    files.push(("a.e57".into(), e57(&positions)));
    let header = |data: &str| {
        format!(
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\n\
             POINTS {n}\nDATA {data}\n"
        )
    };
    let mut pcd = header("binary").into_bytes();
    positions.iter().flatten().for_each(|&x| pcd.extend((x as f32).to_le_bytes()));
    files.push(("binary.pcd".into(), pcd));
    let rows: String = positions.iter().map(|p| format!("{} {} {}\n", p[0], p[1], p[2])).collect();
    files.push(("text.pcd".into(), (header("ascii") + &rows).into_bytes()));

    let mut expected: Option<(Vec<u8>, Vec<u8>)> = None;
    for (name, data) in files {
        std::fs::write(folder.join(&name), data).unwrap();
        names.push(name);
    }
    for name in names {
        let cloud = load(&folder.join(&name), &LoadOptions::default()).unwrap().cloud;
        assert_eq!(cloud, plain, "{name}");
        let out = denoise(&cloud, &DenoiseOptions::default(), &mut Run::default()).unwrap();
        let (mesh, points) = (folder.join("surface.ply"), folder.join("points.ply"));
        save_mesh(&mesh, &out.surface, &SaveMesh::default()).unwrap();
        save_cloud(&points, &out.points, &SaveCloud::default()).unwrap();
        let bytes = (std::fs::read(mesh).unwrap(), std::fs::read(points).unwrap());
        assert!(*expected.get_or_insert_with(|| bytes.clone()) == bytes, "{name} denoises otherwise");
    }
}
