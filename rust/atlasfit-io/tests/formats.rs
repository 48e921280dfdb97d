//! Each format says what it holds: exact small cases, and the repairs that are promised.

mod common;

use atlasfit::Vec3;
use atlasfit::geometry::mesh::vertex_normals;
use atlasfit::geometry::{PointCloud, ScalarKind, TriMesh};
use atlasfit_io::{
    Error, Format, LoadOptions, SaveCloud, SaveMesh, Texture, load, load_bytes, save_cloud, save_mesh,
    write_mesh,
};
use common::{Folder, cube, read};
use std::path::Path;

fn notes(loaded: &atlasfit_io::Loaded) -> String {
    loaded.report.notes.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

fn error(name: &str, data: &[u8]) -> String {
    load_bytes(Path::new(name), data, &LoadOptions::default()).map(|l| l.format).unwrap_err().to_string()
}

#[test]
fn every_sample_is_recognised_by_its_content_alone() {
    for (name, data) in common::samples() {
        let loaded = read("file", &data);
        let expected = Format::from_path(Path::new(name)).unwrap();
        assert_eq!(loaded.format, expected, "{name}");
        // A wrong name does not mislead.
        assert_eq!(read("wrong.obj", &data).format, expected, "{name}");
    }
}

#[test]
fn ply_of_every_encoding_gives_the_same() {
    let mesh = cube();
    let little = common::saved_mesh("a.ply", &mesh, &SaveMesh::default());
    let ascii = common::saved_mesh("a.ply", &mesh, &SaveMesh::default().with_ascii(true));
    assert_eq!(read("a.ply", &little).into_mesh(), mesh);
    assert_eq!(read("a.ply", &ascii).into_mesh(), mesh);
    let mut big = b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty double x\n\
        property float y\nproperty short z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        end_header\n"
        .to_vec();
    big.extend(1e-3f64.to_be_bytes());
    big.extend(2.5f32.to_be_bytes());
    big.extend((-7i16).to_be_bytes());
    big.extend([255, 0, 51]);
    let cloud = read("a.ply", &big).cloud;
    assert_eq!(cloud.positions, [[1e-3, 2.5, -7.0]]);
    assert_eq!(cloud.colors, Some(vec![[1.0, 0.0, 0.2, 1.0]]));
}

#[test]
fn ply_polygons_strips_range_grids_and_odd_properties() {
    let text = b"ply\nformat ascii 1.0\nobj_info num_cols 2\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nproperty uint scan_id\nproperty list uchar float pair\n\
        element range_grid 2\nproperty list uchar int vertex_indices\nelement face 3\n\
        property list uchar int vertex_index\nend_header\n0 0 0 7 2 1 2\n1 0 0 8 2 3 4\n1 1 0 9 2 5 6\n\
        0 1 0 4000000000 2 7 8\n0\n1 3\n4 0 1 2 3\n3 0 1 9\n2 0 1\n";
    let l = read("a.ply", text);
    assert_eq!(l.faces, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(l.cloud.attributes[0].values, [7.0, 8.0, 9.0, 4e9]);
    assert_eq!(l.cloud.attributes[0].kind, ScalarKind::U32);
    assert_eq!((l.cloud.attributes[1].width, l.cloud.attributes[1].values.len()), (2, 8));
    let notes = notes(&l);
    assert!(notes.contains("polygons, cut into triangles: 1"), "{notes}");
    assert!(notes.contains("faces that name a vertex that is not there, left out: 1"), "{notes}");
    assert!(notes.contains("faces of fewer than 3 corners, left out: 1"), "{notes}");
    assert!(notes.contains("rows of the element \"range_grid\", which is not used: 2"), "{notes}");
    let strips = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n\
        1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 2\n";
    assert_eq!(read("a.ply", strips).faces, [[0, 1, 2], [2, 1, 3], [0, 1, 2]]);
}

#[test]
fn u_and_v_of_a_cloud_are_numbers_like_others() {
    let text = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nproperty double u\nproperty double v\nend_header\n0 0 0 0.1 1e9\n";
    let cloud = read("a.ply", text).cloud;
    assert_eq!((cloud.attributes[1].name.as_str(), cloud.attributes[1].values[0]), ("v", 1e9));
    assert_eq!(read("a.ply", &common::saved_cloud("a.ply", &cloud)).cloud, cloud);
}

#[test]
fn a_concave_polygon_is_cut_without_folds() {
    // An arrow head: the fan from its first corner would leave the polygon.
    let obj = b"v 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\nv 1 0.1 5\nf 2 3 4 1\nf 1 2 3 4\n";
    let l = read("a.obj", obj);
    let area: f64 = l
        .faces
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| l.cloud.positions[v as usize]);
            let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(cross > 0.0, "a triangle is turned over: {t:?}");
            cross / 2.0
        })
        .sum();
    assert!((area - 2.0 * 0.5).abs() < 1e-12, "{area}");
}

#[test]
fn obj_corners_of_all_forms_relative_indices_and_continued_lines() {
    let obj = b"\xEF\xBB\xBFmtllib a.mtl\r\nv 0 0 0 1 0 0\r\nv 1 0 0 0 1 0\r\nv 0 1 0 0 0 \\\r\n1\r\n\
        vt 0 0\r\nvt 1 0\r\nvt 0,5 1\r\nvn 0 0 1\r\nusemtl m\r\nf 1/1/1 2/2/1 3/1/1\r\n\
        f -3//-1 -2//-1 -1//-1\r\n";
    let l = read("a.obj", obj);
    assert_eq!(l.faces, [[0, 1, 2], [0, 1, 2]]);
    assert_eq!(l.cloud.colors.as_ref().unwrap()[2], [0.0, 0.0, 1.0, 1.0]);
    assert_eq!(l.cloud.normals, Some(vec![[0.0, 0.0, 1.0]; 3]));
    assert_eq!(l.corner_uv.as_ref().unwrap()[0], [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]);
    assert!(notes(&l).contains("triangles without texture coordinates, set to 0: 1"), "{}", notes(&l));
}

#[test]
fn obj_groups_objects_and_materials_become_one_mesh_and_are_counted() {
    let obj = b"mtllib a.mtl\no left\ng side 1\nusemtl red\ns off\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n\
        o right\nusemtl blue\nv 1 1 0\nf 2 4 3\n";
    let l = read("a.obj", obj);
    assert_eq!(l.faces, [[0, 1, 2], [1, 3, 2]]);
    let notes = notes(&l);
    assert!(notes.contains("changes of material, which are not kept: 2"), "{notes}");
    assert!(notes.contains("groups and objects, joined into one mesh: 3"), "{notes}");
}

#[test]
fn off_with_colours_and_normals_on_one_line_and_with_comments() {
    let l = read(
        "a.off",
        b"COFF # c\n3 1 0\n\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 51 255\n3 0 1 2 1 0 0\n",
    );
    assert_eq!(l.cloud.colors.unwrap()[2], [0.0, 0.0, 0.2, 1.0]);
    assert_eq!(l.faces, [[0, 1, 2]]);
    let one = read("a.off", b"OFF 4 2 0 0 0 0 1 0 0 0 1 0 1 1 1.5D+00 3 0 1 2 3 1 3 2");
    assert_eq!(one.faces, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(one.cloud.positions[3], [1.0, 1.0, 1.5]);
    assert_eq!(read("a.off", b"  OFF1 0 0 # c\n1 2 3\n").cloud.positions, [[1.0, 2.0, 3.0]]);
    let noff = read("a.off", b"NOFF\n1 0 0\n1 2 3 0 0 1\n");
    assert_eq!(noff.cloud.normals, Some(vec![[0.0, 0.0, 1.0]]));
}

#[test]
fn stl_corners_are_joined_and_a_cut_file_says_so() {
    let mesh = TriMesh {
        normals: None,
        colors: None,
        attributes: vec![],
        corner_uv: None,
        corner_normals: None,
        face_chart: None,
        ..cube()
    };
    for ascii in [false, true] {
        let data = common::saved_mesh("a.stl", &mesh, &SaveMesh::default().with_ascii(ascii));
        let l = read("a.stl", &data);
        assert_eq!((l.cloud.len(), l.faces.len()), (8, 12));
        assert!(
            notes(&l).contains("repeated corners of triangles, joined where exactly equal: 28"),
            "{}",
            notes(&l)
        );
    }
    let data = common::saved_mesh("a.stl", &mesh, &SaveMesh::default());
    let cut = read("a.stl", &data[..data.len() - 60]);
    assert_eq!(cut.faces.len(), 10);
    assert!(
        notes(&cut).contains("triangles announced by the header but not in the file (it is cut off): 2"),
        "{}",
        notes(&cut)
    );
}

#[test]
fn columns_of_numbers_whatever_separates_and_names_them() {
    let expected = [[1.5, 2.0, -3.0], [4.0, 5.25, 6.0]];
    for text in [
        "1.5 2 -3\n4 5.25 6\n",
        "1.5,2,-3\n4,5.25,6\n",
        "1,5;2;-3\n4;5,25;6\n",
        "1,5\t2,0\t-3\n4,0\t5,25\t6\n",
        "x y z\n1.5 2 -3\n4 5.25 6\n",
        "2\n1.5 2 -3\n4 5.25 6\n",
        "# made by hand\n\n1.5 2 -3\n// more\n4 5.25 6\n",
        "\"z\",\"id\",\"x\",\"y\"\n-3,a,1.5,2\n6,b,4,5.25\n",
    ] {
        assert_eq!(read("a.txt", text.as_bytes()).cloud.positions, expected, "{text}");
    }
    let l = read("a.pts", b"2\n0 0 0 -1200 255 0 0\n1 1 1 37 0 51 255\n");
    assert_eq!(l.cloud.colors.unwrap()[1], [0.0, 0.2, 1.0, 1.0]);
    assert_eq!(
        (l.cloud.attributes[0].name.as_str(), l.cloud.attributes[0].values[0]),
        ("intensity", -1200.0)
    );
    let l = read("a.xyz", b"0 0 0 0 0.6 0.8\n1 1 1 1 0 0\n");
    assert_eq!(l.cloud.normals, Some(vec![[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]]));
    let l = read(
        "a.csv",
        b"x,y,z,nx,ny,nz,r,g,b,label\n0,0,0,0,0,1,255,255,255,3\nbad line\n1,1,1,0,0,1,0,0,0,4\n",
    );
    assert_eq!(l.cloud.len(), 2);
    assert_eq!((l.cloud.attributes[0].name.as_str(), l.cloud.attributes[0].kind), ("label", ScalarKind::I32));
    assert!(
        notes(&l).contains("lines that are not rows of numbers, left out: 1 (first: line 3)"),
        "{}",
        notes(&l)
    );
}

#[test]
fn pcd_of_every_encoding_gives_the_same() {
    let samples: Vec<_> = common::samples().into_iter().filter(|s| s.0.ends_with("pcd")).collect();
    let check = |data: &[u8], n: usize| {
        let cloud = read("a.pcd", data).cloud;
        assert_eq!(cloud.len(), n);
        for i in 0..n {
            let (p, c, label) = common::pcd_point(i);
            assert_eq!(cloud.positions[i], p.map(f64::from));
            let color = [16, 8, 0].map(|s| f32::from((c >> s) as u8) / 255.0);
            assert_eq!(cloud.colors.as_ref().unwrap()[i], [color[0], color[1], color[2], 1.0]);
            assert_eq!(cloud.attributes[0].values[i], f64::from(label));
        }
    };
    check(&common::pcd_binary(50), 50);
    check(&common::pcd_compressed(50), 50);
    check(&samples.iter().find(|s| s.0 == "ascii.pcd").unwrap().1, 20);
    assert!(common::pcd_compressed(50).len() < common::pcd_binary(50).len() * 2);
}

#[test]
fn las_and_laz_keep_survey_coordinates_and_attributes() {
    for data in [common::las(40), common::laz(40, 3), common::laz(40, 7)] {
        let cloud = read("a.las", &data).cloud;
        assert_eq!(cloud.len(), 40);
        for (i, p) in cloud.positions.iter().enumerate() {
            let i = i as f64;
            assert_eq!(*p, [i * 0.001 + 1e6, 2.0 * i * 0.001 + 2e6, -i * 0.001 + 3e6]);
        }
        assert_eq!(cloud.colors.as_ref().unwrap()[1][..2], [1.0, 32768.0 / 65535.0]);
        let value = |name: &str| cloud.attributes.iter().find(|a| a.name == name).unwrap().values[3];
        assert_eq!(value("intensity"), 103.0);
        assert_eq!(value("classification"), 2.0);
        assert_eq!(value("number_of_returns"), 2.0);
        assert_eq!(value("point_source_id"), 9.0);
        assert_eq!(value("gps_time"), 1e5 + 3.0);
        // All zero: not kept.
        assert!(cloud.attributes.iter().all(|a| a.name != "user_data"));
    }
    // Colours that never leave the low byte are 8-bit colours.
    let mut dim = common::las(3);
    let from = dim.len() - 3 * 34;
    for r in 0..3 {
        for (k, c) in [255u16, 51, 0].into_iter().enumerate() {
            dim[from + r * 34 + 28 + 2 * k..][..2].copy_from_slice(&c.to_le_bytes());
        }
    }
    assert_eq!(read("a.las", &dim).cloud.colors.unwrap()[2], [1.0, 0.2, 0.0, 1.0]);
    let big = common::laz(200_000, 7);
    assert_eq!(read("a.laz", &big).cloud.len(), 200_000);
}

#[test]
fn e57_scans_are_moved_by_their_poses_and_numbered() {
    let cloud = read("a.e57", &common::e57()).cloud;
    assert_eq!(cloud.len(), 6);
    assert_eq!(cloud.positions[1], [1.0, 0.125, 1e6]);
    assert_eq!(cloud.positions[4], [11.0, 0.125, 1e6]);
    assert_eq!(cloud.attributes[0].values, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(cloud.colors.unwrap()[2], [1.0, 0.0, 2.0 / 255.0, 1.0]);
}

#[test]
fn glb_comes_back_joined_and_far_coordinates_survive() {
    let mut mesh = cube();
    mesh.face_chart = None;
    mesh.positions.iter_mut().for_each(|p| *p = [p[0] + 4.5e6, p[1] - 3e5, p[2] + 100.0]);
    let folder = Folder::new();
    let path = folder.join("a.glb");
    let png = [0x89, b'P', b'N', b'G'];
    let saved = save_mesh(&path, &mesh, &SaveMesh::default().with_texture(Some(Texture::Png(&png)))).unwrap();
    assert!(saved.lost.is_empty(), "{:?}", saved.lost);
    let back = load(&path, &LoadOptions::default()).unwrap().into_mesh();
    assert_eq!(back.positions, mesh.positions);
    assert_eq!(back.triangles, mesh.triangles);
    assert_eq!(back.normals, mesh.normals);
    assert_eq!(back.attributes, mesh.attributes);
    let close = |a: f32, b: f32| (a - b).abs() < 1e-6;
    let (a, b) = (back.corner_uv.unwrap(), mesh.corner_uv.unwrap());
    assert!(a.iter().flatten().flatten().zip(b.iter().flatten().flatten()).all(|(a, b)| close(*a, *b)));
    let (a, b) = (back.colors.unwrap(), mesh.colors.unwrap());
    assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| close(*a, *b)));
}

#[test]
fn gltf_nodes_strips_and_embedded_buffers() {
    // One triangle as three floats each, twice: moved by a matrix, and mirrored by a scale.
    let bytes: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let text: String = bytes
        .chunks(3)
        .flat_map(|c| {
            let n = u32::from(c[0]) << 16 | u32::from(c[1]) << 8 | u32::from(c[2]);
            [18, 12, 6, 0].map(|s| char::from(DIGITS[(n >> s) as usize & 63]))
        })
        .collect();
    let moved = r#"{"mesh":0,"translation":[0,0,5.0000001]}"#;
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],
        "nodes":[{{"children":[2],"translation":[100,0,0]}},{{"mesh":0,"scale":[-1,1,1]}},{moved}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":5}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{text}"}}]}}"#
    );
    let l = read("a.gltf", json.as_bytes());
    assert_eq!(l.cloud.positions[1], [101.0, 0.0, 5.000_000_1]);
    assert_eq!(l.cloud.positions[4], [-1.0, 0.0, 0.0]);
    assert_eq!(l.faces, [[0, 1, 2], [3, 5, 4]]);
    let folder = Folder::new();
    std::fs::write(folder.join("my data.bin"), &bytes).unwrap();
    let beside = json.replace(&format!("data:application/octet-stream;base64,{text}"), "my%20data.bin");
    std::fs::write(folder.join("a.gltf"), beside).unwrap();
    let l = load(&folder.join("a.gltf"), &LoadOptions::default()).unwrap();
    assert_eq!(l.cloud.positions[1], [101.0, 0.0, 5.000_000_1]);
    let outside = json.replace("data:application/octet-stream;base64,", "../");
    assert!(error("a.gltf", outside.as_bytes()).contains("outside of the folder"));
}

#[test]
fn points_that_are_not_finite_stay_in_place_and_are_counted() {
    let l = read("a.xyz", b"0 0 0\nnan 1 1\n2 2 inf\n3 3 3\n");
    assert_eq!(l.cloud.len(), 4);
    assert_eq!(l.cloud.positions[3], [3.0; 3]);
    assert!(
        notes(&l).contains("points with a coordinate that is not finite, kept in place: 2 (first: point 1)")
    );
}

#[test]
fn errors_name_file_place_finding_and_expectation() {
    let text = error("scan.ply", b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n");
    assert!(text.starts_with("scan.ply, line 3: found \"element vertex many\", expected"), "{text}");
    assert!(error("a.ply", b"").contains("an empty file"));
    assert!(error("a.obj", &[0x1F, 0x8B, 8, 0]).contains("gunzip"));
    let huge = b"ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n\
        property float y\nproperty float z\nend_header\n012345678901";
    assert!(error("a.ply", huge).contains("2000000000 rows"));
    assert!(
        error(
            "a.ply",
            b"ply\nformat ascii 1.0\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
        )
        .contains("\"vertex\"")
    );
}

#[test]
fn the_memory_limit_holds_for_every_format() {
    for (name, data) in common::samples() {
        let options = LoadOptions::default().with_max_memory_bytes(Some(data.len() as u64 + 100));
        let result = load_bytes(Path::new(name), &data, &options);
        assert!(matches!(result, Err(Error::OutOfMemory { .. })), "{name}: {:?}", result.map(|l| l.format));
    }
}

#[test]
fn json_counts_with_what_it_takes_once_it_is_read() {
    let many = vec!["{\"a\":[1,\"\\\"]\"]}"; 20_000].join(",");
    let json = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":[{many}]}}");
    let within = |bytes| {
        let options = LoadOptions::default().with_max_memory_bytes(Some(bytes));
        load_bytes(Path::new("a.gltf"), json.as_bytes(), &options)
    };
    let refused = within(10 * json.len() as u64);
    assert!(matches!(refused, Err(Error::OutOfMemory { .. })), "{:?}", refused.map(|l| l.format));
    let read = within(200 * json.len() as u64);
    assert!(read.is_ok(), "{:?}", read.map(|l| l.format));
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_rest() {
    let folder = Folder::new();
    let path = folder.join("out.ply");
    std::fs::write(&path, "precious").unwrap();
    let bad = TriMesh::new(vec![[0.0; 3]], vec![[0, 0, 9]]);
    assert!(save_mesh(&path, &bad, &SaveMesh::default()).is_err());
    let empty = folder.join("out.glb");
    assert!(save_cloud(&empty, &PointCloud::default(), &SaveCloud::default()).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), b"precious");
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 1);
    assert!(save_cloud(&folder.join("a.las"), &PointCloud::default(), &SaveCloud::default()).is_err());
    assert!(save_cloud(&folder.join("a.what"), &PointCloud::default(), &SaveCloud::default()).is_err());
}

#[test]
fn a_textured_obj_comes_with_its_material_and_image() {
    let folder = Folder::new();
    let path = folder.join("my mesh.obj");
    let saved =
        save_mesh(&path, &cube(), &SaveMesh::default().with_texture(Some(Texture::Png(b"png")))).unwrap();
    let names: Vec<_> = saved.files.iter().map(|f| f.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["my mesh.obj", "my_mesh.png", "my_mesh.mtl"]);
    assert!(std::fs::read_to_string(&saved.files[2]).unwrap().contains("map_Kd my_mesh.png"));
    assert_eq!(std::fs::read(&saved.files[1]).unwrap(), b"png");
    assert_eq!(saved.lost, ["attributes, which OBJ cannot hold: intensity", "chart numbers of the faces"]);
}

#[test]
fn files_of_rows_read_block_by_block_give_what_reading_them_whole_gives() {
    let n = 10_000;
    let cloud = PointCloud {
        normals: Some((0..n).map(|i| [1.0, i as f32, 0.5]).collect()),
        ..PointCloud::from_positions((0..n).map(|i| [f64::from(i), 0.1, -1.0 / f64::from(i + 1)]).collect())
    };
    let mut ply = common::saved_cloud("a.ply", &cloud);
    let at = ply.windows(10).position(|w| w == b"end_header").unwrap();
    ply.splice(at..at, *b"element face 0\nproperty list uchar int vertex_indices\n");
    let folder = Folder::new();
    for (name, data) in [
        ("a.ply", ply),
        ("a.pcd", common::pcd_binary(n as usize)),
        ("a.las", common::las(n as u32)),
        // Packed and text are read whole.
        ("b.pcd", common::pcd_compressed(n as usize)),
        ("b.laz", common::laz(n as u32, 3)),
    ] {
        let path = folder.join(name);
        for len in [data.len(), data.len() + 5, data.len() - 1, data.len() / 2, 1 << 16, (1 << 16) + 1] {
            let mut changed = data.clone();
            changed.resize(len, 7);
            std::fs::write(&path, &changed).unwrap();
            let both =
                [load(&path, &LoadOptions::default()), load_bytes(&path, &changed, &LoadOptions::default())];
            match both {
                [Ok(a), Ok(b)] => assert_eq!((a.cloud, a.report), (b.cloud, b.report), "{name} {len}"),
                [Err(a), Err(b)] => assert_eq!(a.to_string(), b.to_string(), "{name} {len}"),
                [a, b] => panic!("{name} {len}: {:?}, but from memory {:?}", a.is_ok(), b.is_ok()),
            }
        }
    }
}

#[test]
fn the_bytes_of_a_file_of_rows_take_no_memory() {
    let n = 100_000;
    let cloud = PointCloud::from_positions((0..n).map(|i| [f64::from(i), 0.1, -1.0]).collect());
    let folder = Folder::new();
    let path = folder.join("a.ply");
    save_cloud(&path, &cloud, &SaveCloud::default()).unwrap();
    let columns = 24 * n as u64;
    let within = |bytes| load(&path, &LoadOptions::default().with_max_memory_bytes(Some(bytes)));
    assert_eq!(within(columns + (1 << 17)).unwrap().cloud, cloud);
    assert!(matches!(within(columns).unwrap_err(), Error::OutOfMemory { .. }));
}

#[test]
fn the_viewpoint_of_pcd_is_the_scanner_s_place_unless_it_is_the_origin() {
    let read = |viewpoint: &str| {
        let file = format!(
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n\
             VIEWPOINT {viewpoint}\nPOINTS 2\nDATA ascii\n0 0 0\n1 0 0\n"
        );
        load_bytes(Path::new("a.pcd"), file.as_bytes(), &LoadOptions::default()).unwrap().cloud.scanners
    };
    let scanners = read("1 -2 3.5 1 0 0 0").expect("a scanner");
    assert_eq!((scanners.positions, scanners.of_point), (vec![[1.0, -2.0, 3.5]], vec![0, 0]));
    assert_eq!(read("0 0 0 1 0 0 0"), None);
}

#[test]
fn a_name_that_ends_in_gltf_gives_json_with_its_buffer_and_image_beside_it() {
    let folder = Folder::new();
    let options = SaveMesh::default().with_texture(Some(Texture::Png(b"\x89PNG")));
    let text = save_mesh(&folder.join("a b.gltf"), &cube(), &options).unwrap();
    let names: Vec<_> = text.files.iter().map(|f| f.file_name().unwrap().to_string_lossy()).collect();
    assert_eq!(names, ["a b.gltf", "a_b.png", "a_b.bin"]);
    let json = std::fs::read_to_string(&text.files[0]).unwrap();
    assert!(json.starts_with('{') && json.contains("\"uri\":\"a_b.bin\""), "{json}");
    assert_eq!(std::fs::read(&text.files[1]).unwrap(), b"\x89PNG");
    let binary = save_mesh(&folder.join("a.glb"), &cube(), &options).unwrap();
    assert_eq!(binary.files.len(), 1);
    assert_eq!(text.lost, binary.lost);
    let read = |path: &Path| load(path, &LoadOptions::default()).unwrap();
    let (a, b) = (read(&text.files[0]), read(&binary.files[0]));
    assert_eq!(a.texture, b.texture);
    assert_eq!(a.into_mesh(), b.into_mesh());
}

/// The cube with the normals of its faces at the corners of its triangles.
fn creased_cube() -> TriMesh {
    let cube = cube();
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| Vec3(cube.positions[v as usize]));
        (b - a).cross(c - a).normalized().to_f32()
    };
    let corner_normals: Vec<[[f32; 3]; 3]> = cube.triangles.iter().map(|t| [normal(t); 3]).collect();
    let normals = Some(vertex_normals(&cube.positions, &cube.triangles));
    TriMesh { corner_normals: Some(corner_normals), normals, attributes: vec![], face_chart: None, ..cube }
}

#[test]
fn normals_of_corners_go_through_obj_and_glb_and_elsewhere_are_said_to_be_lost() {
    let with_uv = creased_cube();
    let without_uv = TriMesh { corner_uv: None, ..with_uv.clone() };
    for mesh in [with_uv, without_uv] {
        for name in ["a.obj", "a.glb"] {
            let back = read(name, &common::saved_mesh(name, &mesh, &SaveMesh::default())).into_mesh();
            assert_eq!(back.corner_normals, mesh.corner_normals, "{name}");
            assert_eq!((&back.positions, &back.triangles), (&mesh.positions, &mesh.triangles), "{name}");
            assert_eq!(back.corner_uv.is_some(), mesh.corner_uv.is_some(), "{name}");
        }
        for name in ["a.ply", "a.off"] {
            let mut bytes = Vec::new();
            let format = Format::from_path(name.as_ref());
            let lost = write_mesh(&mut bytes, &mesh, &SaveMesh::default().with_format(format));
            assert!(lost.expect("it is written").iter().any(|l| l.contains("normals")), "{name}");
            assert_eq!(read(name, &bytes).corner_normals, None, "{name}");
        }
    }
}

#[test]
fn a_polygon_keeps_the_normals_of_its_corners() {
    // A roof of two squares: at the ridge each has its own normal; the last square says none.
    let obj = b"v 0 0 0\nv 1 0 1\nv 1 1 1\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\nv 3 1 0\n\
                vn -1 0 1\nvn 1 0 1\nvn 0 0 1\n\
                f 1//1 2//1 3//1 4//1\nf 2//2 5//2 6//2 3//2\nf 5//3 7//3 8//3 6//3\nf 5 7 8 6\n";
    let loaded = read("a.obj", obj);
    let polygons = loaded.polygons.clone().expect("squares");
    let mesh = loaded.into_mesh();
    let [left, right, up] = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    let found = mesh.corner_normals.clone().expect("they differ at the ridge");
    assert_eq!(found[..6], [[left; 3], [left; 3], [right; 3], [right; 3], [up; 3], [up; 3]]);
    // Without one of its own a corner has its vertex's: the mean.
    let vertices = mesh.normals.as_ref().expect("every vertex has some");
    assert!(found[6..].iter().zip(&mesh.triangles[6..]).all(|(n, t)| *n == t.map(|v| vertices[v as usize])));
    let saved = common::saved_mesh("a.obj", &mesh, &SaveMesh::default().with_polygons(Some(&polygons)));
    let again = read("a.obj", &saved);
    assert_eq!((again.corner_normals, again.polygons), (Some(found), Some(polygons)));
}
