//! Polygons, indices of other types, and strides in every direction: what comes out is what the same mesh of
//! packed triangles gives.

use crate::ok;
use crate::scene::*;
use atlasfit_capi::arrays::*;
use atlasfit_capi::buffer::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::faces::*;
use atlasfit_capi::files::*;
use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::result_copy::*;
use atlasfit_capi::save::*;
use atlasfit_capi::status::*;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// The box as six quads.
const QUADS: [u32; 24] = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5];
const STARTS: [u32; 7] = [0, 4, 8, 12, 16, 20, 24];

/// A mesh of such faces, without triangles.
fn polygons(xyz: &[f32], faces: atlasfit_faces) -> atlasfit_mesh {
    atlasfit_mesh { triangles: null(), triangle_count: 0, faces, ..mesh(xyz, &[]) }
}

fn faces(corners: *const c_void, offsets: *const c_void, count: usize, scalar: u32) -> atlasfit_faces {
    atlasfit_faces { corners, offsets, count, scalar, ..init(atlasfit_mesh_init).faces }
}

/// What a layout holds of the faces that were given.
#[derive(Debug, PartialEq)]
struct Uvs {
    corners: Vec<f32>,
    charts: Vec<u32>,
    pages: Vec<u32>,
    torn: Vec<u32>,
    /// The vertex of each corner by the split form, and its UV.
    split: (Vec<u32>, Vec<f32>),
}

fn unwrapped(m: &atlasfit_mesh) -> Uvs {
    let (mut uv, mut info) = (null_mut(), output::<atlasfit_uv_info>());
    unsafe {
        ok(atlasfit_unwrap(m, null(), null(), &mut uv));
        ok(atlasfit_uv_get_info(uv, &mut info));
        let (mut corners, mut charts) = (vec![0f32; 2 * info.corners], vec![0; info.faces]);
        let (mut pages, mut torn) = (vec![0; info.faces], vec![0; info.torn_faces]);
        ok(atlasfit_uv_corners(uv, corners.as_mut_ptr(), corners.len()));
        ok(atlasfit_uv_face_charts(uv, charts.as_mut_ptr(), charts.len()));
        ok(atlasfit_uv_face_pages(uv, pages.as_mut_ptr(), pages.len()));
        ok(atlasfit_uv_face_torn(uv, torn.as_mut_ptr(), torn.len()));
        let n = info.split_vertices;
        let (mut i, mut v, mut p) = (vec![0u32; info.corners], vec![0u32; n], vec![0f32; 2 * n]);
        ok(atlasfit_uv_split(uv, i.as_mut_ptr(), i.len(), v.as_mut_ptr(), p.as_mut_ptr(), n));
        ok(atlasfit_uv_free(uv));
        let at = |i: &u32| *i as usize;
        let split = (
            i.iter().map(|i| v[at(i)]).collect(),
            i.iter().flat_map(|i| [p[2 * at(i)], p[2 * at(i) + 1]]).collect(),
        );
        Uvs { corners, charts, pages, torn, split }
    }
}

#[test]
fn each_corner_of_a_polygon_has_one_uv_that_of_its_triangles() {
    let (xyz, triangles) = cube();
    let of: Vec<u32> = (0..12).map(|t| t / 2).collect();
    let known = unwrapped(&atlasfit_mesh { face_polygon: of.as_ptr(), ..mesh(&xyz, &triangles) });
    let here =
        unwrapped(&polygons(&xyz, faces(QUADS.as_ptr().cast(), STARTS.as_ptr().cast(), 6, ATLASFIT_U32)));
    for q in 0..6 {
        // The first triangle has corners 0, 1, 2 of the quad, the second 0, 2, 3.
        let t = &known.corners[12 * q..12 * q + 12];
        assert_eq!(here.corners[8 * q..8 * q + 6], t[..6]);
        assert_eq!(here.corners[8 * q + 6..8 * q + 8], t[10..]);
        assert_eq!((here.charts[q], here.pages[q]), (known.charts[2 * q], known.pages[2 * q]));
    }
    assert!(here.torn.is_empty());
    assert_eq!((&here.split.0[..], &here.split.1), (&QUADS[..], &here.corners));
}

#[test]
fn indices_of_every_type_and_stride_are_the_same_mesh() {
    let (xyz, _) = cube();
    let packed = faces(QUADS.as_ptr().cast(), STARTS.as_ptr().cast(), 6, ATLASFIT_U32);
    let known = unwrapped(&polygons(&xyz, packed));
    macro_rules! of {
        ($t:ty, $scalar:expr) => {{
            let (corners, starts) = (QUADS.map(|v| v as $t), STARTS.map(|o| o as $t));
            let given = faces(corners.as_ptr().cast(), starts.as_ptr().cast(), 6, $scalar);
            assert_eq!(unwrapped(&polygons(&xyz, given)), known);
            // Corners beside other numbers, as Blender had its loops.
            let loops = QUADS.map(|v| [v as $t, 99]);
            let stride = 2 * size_of::<$t>();
            let given = faces(loops.as_ptr().cast(), starts.as_ptr().cast(), 6, $scalar);
            assert_eq!(unwrapped(&polygons(&xyz, atlasfit_faces { corner_stride: stride, ..given })), known);
        }};
    }
    of!(u8, ATLASFIT_U8);
    of!(i8, ATLASFIT_I8);
    of!(u16, ATLASFIT_U16);
    of!(i16, ATLASFIT_I16);
    of!(u32, ATLASFIT_U32);
    of!(i32, ATLASFIT_I32);
    of!(u64, ATLASFIT_U64);
    of!(i64, ATLASFIT_I64);
}

#[test]
fn columns_that_lie_apart_are_the_same_mesh() {
    let (xyz, triangles) = cube();
    let known = unwrapped(&mesh(&xyz, &triangles));
    // All x, then all y, then all z; all first corners, then all second, then all third: column-major.
    let apart: Vec<f32> = (0..24).map(|i| xyz[3 * (i % 8) + i / 8]).collect();
    let columns: Vec<i64> = (0..36).map(|i| i64::from(triangles[3 * (i % 12) + i / 12])).collect();
    let given = atlasfit_faces {
        corner_stride: 12 * 8,
        face_stride: 8,
        ..faces(columns.as_ptr().cast(), null(), 12, ATLASFIT_I64)
    };
    assert_eq!(unwrapped(&atlasfit_mesh { component_stride: 8 * 4, ..polygons(&apart, given) }), known);
    let rows = faces(triangles.as_ptr().cast(), null(), 12, ATLASFIT_U32);
    assert_eq!(unwrapped(&polygons(&xyz, rows)), known);
    // Points too.
    let xyz = scan(1500);
    let apart: Vec<f64> = (0..4500).map(|i| xyz[3 * (i % 1500) + i / 1500]).collect();
    let same = atlasfit_points { component_stride: 1500 * 8, ..points(&apart) };
    assert_eq!(denoised(&same), denoised(&points(&xyz)));
}

/// Denoised positions.
fn denoised(p: &atlasfit_points) -> Vec<f64> {
    let (mut result, mut xyz) = (null_mut(), vec![0f64; 3 * p.count]);
    let options = atlasfit_denoise_options { uv: 0, ..init(atlasfit_denoise_options_init) };
    unsafe {
        ok(atlasfit_denoise(p, &options, null(), &mut result));
        ok(atlasfit_result_point_positions(result, xyz.as_mut_ptr(), xyz.len()));
        ok(atlasfit_result_free(result));
    }
    xyz
}

#[test]
fn outliers_follow_their_neighbours_in_polygons() {
    let (xyz, _) = spiky_sheet();
    let quads: Vec<i32> =
        (0..39 * 39).map(|i| i / 39 * 40 + i % 39).flat_map(|a| [a, a + 1, a + 41, a + 40]).collect();
    let offsets: Vec<i32> = (0..=39 * 39).map(|i| 4 * i).collect();
    let faces = faces(quads.as_ptr().cast(), offsets.as_ptr().cast(), 39 * 39, ATLASFIT_I32);
    let at = denoised(&atlasfit_points { faces, ..points(&xyz) });
    assert!(at[3 * SPIKE + 2].abs() < 0.5, "{}", at[3 * SPIKE + 2]);
}

#[test]
fn ignored_faces_keep_their_numbers_and_have_no_chart() {
    let (xyz, triangles) = cube();
    let mut ignored = [0u8; 6];
    ignored[2] = 1;
    let quads = faces(QUADS.as_ptr().cast(), STARTS.as_ptr().cast(), 6, ATLASFIT_U32);
    let m = atlasfit_mesh { face_ignored: ignored.as_ptr(), ..polygons(&xyz, quads) };
    let here = unwrapped(&m);
    assert_eq!((here.charts.len(), here.charts[2], here.pages[2]), (6, u32::MAX, u32::MAX));
    assert!(here.charts.iter().enumerate().all(|(f, c)| f == 2 || *c < 6));
    let mut t = output::<atlasfit_topology>();
    ok(unsafe { atlasfit_measure_topology(&m, null(), &mut t) });
    assert_eq!((t.faces, t.boundary_edges), (10, 4));
    // Of triangles too.
    let ignored: Vec<u8> = (0..12).map(|t| u8::from(t / 2 == 2)).collect();
    let m = atlasfit_mesh { face_ignored: ignored.as_ptr(), ..mesh(&xyz, &triangles) };
    let charts = unwrapped(&m).charts;
    assert!((0..12).all(|t| (charts[t] == u32::MAX) == (t / 2 == 2)), "{charts:?}");
}

#[test]
fn polygons_that_do_not_lie_flat_are_told_and_measured_by_their_worst_triangle() {
    // A face that winds once and a half around an axis, beside a square.
    let mut xyz = vec![0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let turn = |k: usize, r: f32| {
        let a = k as f32 * 0.5;
        [3.0 + r * a.cos(), r * a.sin(), 0.1 * k as f32]
    };
    xyz.extend((0..19).flat_map(|k| turn(k, 1.0)));
    xyz.extend((0..19).rev().flat_map(|k| turn(k, 0.5)));
    let corners: Vec<u16> = (0..42).collect();
    let given = faces(corners.as_ptr().cast(), [0u16, 4, 42].as_ptr().cast(), 2, ATLASFIT_U16);
    let m = polygons(&xyz, given);
    let here = unwrapped(&m);
    assert_eq!((here.charts.len(), here.corners.len()), (2, 84));
    assert_eq!(here.torn, [1]);
    let with_uv = atlasfit_mesh { corner_uv: here.corners.as_ptr(), ..m };
    let (mut q, mut stretch) = (output::<atlasfit_uv_quality>(), [0f32; 2]);
    ok(unsafe { atlasfit_measure_uv(&with_uv, null(), &mut q, stretch.as_mut_ptr(), 2) });
    assert!(stretch[1] > stretch[0] && q.faces == 38, "{stretch:?} {}", q.faces);
    let mut few = [0f32; 1];
    let status = unsafe { atlasfit_measure_uv(&with_uv, null(), &mut q, few.as_mut_ptr(), 1) };
    assert_eq!(status, ATLASFIT_BUFFER_TOO_SMALL);
}

#[test]
fn results_come_in_the_caller_s_type_and_strides() {
    let s = Scene::new(1500);
    let n = s.report.points;
    let (mut xyz, mut charts) = (vec![0f64; 3 * n], vec![0u32; n]);
    // All x, all y, all z, as floats; charts as shorts, one in three of a wider array.
    let (mut apart, mut wide) = (vec![0f32; 3 * n], vec![7i16; 3 * n]);
    let buffer = init(atlasfit_buffer_init);
    let columns = atlasfit_buffer {
        data: apart.as_mut_ptr().cast(),
        capacity: n,
        stride: 4,
        component_stride: 4 * n,
        ..buffer
    };
    let shorts = atlasfit_buffer {
        data: wide.as_mut_ptr().cast(),
        capacity: n,
        stride: 6,
        scalar: ATLASFIT_I16,
        ..buffer
    };
    unsafe {
        ok(atlasfit_result_point_positions(s.result, xyz.as_mut_ptr(), 3 * n));
        ok(atlasfit_result_point_charts(s.result, charts.as_mut_ptr(), n));
        ok(atlasfit_result_copy(s.result, ATLASFIT_POINT_POSITIONS, &columns));
        ok(atlasfit_result_copy(s.result, ATLASFIT_POINT_CHARTS, &shorts));
    }
    assert!((0..3 * n).all(|i| apart[i % 3 * n + i / 3] == xyz[i] as f32));
    let expected = |c: u32| if c == u32::MAX { -1 } else { c as i16 };
    assert!((0..n).all(|i| wide[3 * i] == expected(charts[i]) && wide[3 * i + 1..3 * i + 3] == [7, 7]));
    assert!(charts.contains(&u32::MAX), "the strays are on no chart");
}

#[test]
fn files_hold_the_normals_of_the_corners_of_polygons_and_give_them_back() {
    let (xyz, _) = cube();
    let xyz: Vec<f64> = xyz.iter().map(|&x| f64::from(x)).collect();
    let (corners, starts) = (QUADS.map(i64::from), STARTS.map(i64::from));
    let quads = atlasfit_points {
        faces: faces(corners.as_ptr().cast(), starts.as_ptr().cast(), 6, ATLASFIT_I64),
        ..points(&xyz)
    };
    // A number per quad, so that those of a vertex differ.
    let normals: Vec<f32> = (0..24).flat_map(|c| [0.0, (c / 4) as f32, 1.0]).collect();
    let options =
        atlasfit_save_options { corner_normals: normals.as_ptr(), ..init(atlasfit_save_options_init) };
    let path = std::ffi::CString::new(format!("{}/creased_quads.obj", env!("CARGO_TARGET_TMPDIR")));
    let path = path.expect("no 0 in it");
    let (mut file, mut info) = (std::ptr::null_mut(), output::<atlasfit_file_info>());
    let mut back = vec![0f32; 12 * 9];
    unsafe {
        ok(atlasfit_file_save(path.as_ptr(), &quads, &options, null(), null_mut(), 0));
        ok(atlasfit_file_load(path.as_ptr(), null(), &mut file));
        ok(atlasfit_file_get_info(file, &mut info));
        ok(atlasfit_file_corner_normals(file, back.as_mut_ptr(), back.len()));
        atlasfit_file_free(file);
    }
    assert_eq!((info.triangles, info.has_corner_normals), (12, 1));
    let expected: Vec<f32> = (0..36).flat_map(|c| [0.0, (c / 6) as f32, 1.0]).collect();
    assert_eq!(back, expected);
}

#[test]
fn files_hold_polygons_as_they_are_with_one_uv_per_corner() {
    let (xyz, _) = cube();
    let xyz: Vec<f64> = xyz.iter().map(|&x| f64::from(x)).collect();
    // The six quads, and a face of two corners, which is none.
    let corners: Vec<i64> = QUADS.iter().map(|&v| i64::from(v)).chain([0, 1]).collect();
    let starts: Vec<i64> = STARTS.iter().map(|&s| i64::from(s)).chain([26]).collect();
    let scan = |corners: &[i64]| atlasfit_points {
        faces: faces(corners.as_ptr().cast(), starts.as_ptr().cast(), 7, ATLASFIT_I64),
        ..points(&xyz)
    };
    let uv: Vec<f32> = (0..26).flat_map(|c| [c as f32 / 32.0, 0.25]).collect();
    let charts = [0, 1, 2, 3, 4, 5, 6u32];
    let options = atlasfit_save_options {
        corner_uv: uv.as_ptr(),
        face_charts: charts.as_ptr(),
        ascii: 1,
        ..init(atlasfit_save_options_init)
    };
    let save = |name: &str, points: &atlasfit_points| {
        let path = format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"));
        let c = std::ffi::CString::new(path.clone()).expect("no 0 in it");
        (path, unsafe { atlasfit_file_save(c.as_ptr(), points, &options, null(), null_mut(), 0) })
    };
    let (ply, status) = save("quads.ply", &scan(&corners));
    ok(status);
    let text = std::fs::read_to_string(ply).expect("it was written");
    assert!(text.contains("element face 6\n"), "{text}");
    // Corners, UVs and the chart of the second quad.
    let second = "4 4 5 7 6 8 0.125 0.25 0.15625 0.25 0.1875 0.25 0.21875 0.25 1";
    assert!(text.lines().any(|l| l.trim_end() == second), "{text}");
    // What holds only triangles gets those.
    let (stl, status) = save("quads.stl", &scan(&corners));
    ok(status);
    assert_eq!(std::fs::read_to_string(stl).expect("it was written").matches("endfacet").count(), 12);
    let mut beyond = corners.clone();
    beyond[5] = 8;
    assert_eq!(save("beyond.ply", &scan(&beyond)).1, ATLASFIT_INDEX_OUT_OF_RANGE);
}
