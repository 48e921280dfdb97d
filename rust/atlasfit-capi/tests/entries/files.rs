//! Files: what is read, what is written.
#![expect(clippy::type_complexity, reason = "tables of calls")]

use crate::scene::*;
use crate::table::*;
use atlasfit_capi::arrays::*;
use atlasfit_capi::files::*;
use atlasfit_capi::points::*;
use atlasfit_capi::save::*;
use atlasfit_capi::status::*;
use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};

/// A path in the tests' own folder.
fn path(name: &str) -> CString {
    CString::new(format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"))).expect("no 0 in it")
}

/// A triangle with all that a file can hold: normals, colours, a label, UVs, a texture.
const PLY: &str = "ply\nformat ascii 1.0\ncomment TextureFile one.png\nelement vertex 3\n\
    property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n\
    property float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
    property ushort label\nelement face 1\nproperty list uchar int vertex_indices\n\
    property list uchar float texcoord\nproperty uint chart\nend_header\n\
    0 0 0 0 0 1 255 0 0 7\n1 0 0 0 0 1 0 255 0 7\n0 1 0 0 0 1 0 0 255 65535\n\
    3 0 1 2 6 0 0 1 0 0 1 4\n";

/// Two triangles with a crease between them.
const CREASED: &str = "v 0 0 0\nv 1 0 1\nv 1 1 1\nv 2 0 0\nvn -1 0 1\nvn 1 0 1\nf 1//1 2//1 3//1\n\
    f 2//2 4//2 3//2\n";

fn opened(name: &str) -> *mut atlasfit_file {
    let mut file = null_mut();
    let status = unsafe { atlasfit_file_load(path(name).as_ptr(), null(), &mut file) };
    assert_eq!(status, ATLASFIT_OK, "{}", last_error());
    file
}

/// Loading, and what a file holds.
pub fn reading(t: &mut Table, s: &Scene) {
    let (ply, cloud) = (path("entries.ply"), path("entries.xyz"));
    std::fs::write(ply.to_str().expect("UTF-8"), PLY).expect("it is written");
    std::fs::write(path("creased.obj").to_str().expect("UTF-8"), CREASED).expect("it is written");
    std::fs::write(path("one.png").to_str().expect("UTF-8"), "not looked at").expect("it is written");
    std::fs::write(cloud.to_str().expect("UTF-8"), "0 0 0\n1 0 nan\n").expect("it is written");
    unsafe {
        let load = "atlasfit_file_load";
        let mut out = null_mut();
        t.want(load, "path NULL", INVALID, atlasfit_file_load(null(), null(), &mut out));
        t.want(load, "out NULL", INVALID, atlasfit_file_load(ply.as_ptr(), null(), null_mut()));
        let endless = vec![b'a' as c_char; 1 << 16];
        t.want(load, "no end", INVALID, atlasfit_file_load(endless.as_ptr(), null(), &mut out));
        let missing = path("missing.ply");
        t.want(load, "missing", ATLASFIT_IO, atlasfit_file_load(missing.as_ptr(), null(), &mut out));
        let damaged = path("damaged.ply");
        std::fs::write(damaged.to_str().expect("UTF-8"), "ply\nformat").expect("it is written");
        t.want(load, "damaged", ATLASFIT_BAD_FILE, atlasfit_file_load(damaged.as_ptr(), null(), &mut out));
        t.run(load, |run| {
            let mut out = null_mut();
            let status = atlasfit_file_load(ply.as_ptr(), run, &mut out);
            assert_eq!(out.is_null(), status != ATLASFIT_OK);
            atlasfit_file_free(out);
            status
        });

        let (file, bare) = (opened("entries.ply"), opened("entries.xyz"));
        let creased = opened("creased.obj");
        let info = output::<atlasfit_file_info>();
        let get = "atlasfit_file_get_info";
        t.handle(get, s.atlas, |h| atlasfit_file_get_info(h, &mut output()));
        t.want(get, "NULL info", INVALID, atlasfit_file_get_info(file, null_mut()));
        t.sized(get, "info", &info, ATLASFIT_OK, |i| atlasfit_file_get_info(file, i));
        let name = "atlasfit_file_notes";
        t.lines(name, bare, s.atlas, |h, text, n, length| atlasfit_file_notes(h, text, n, length));
        getter!(t, atlasfit_file_positions, file, s.atlas, 9, 7f64);
        getter!(t, atlasfit_file_normals, file, s.atlas, 9, 7f32);
        getter!(t, atlasfit_file_colors, file, s.atlas, 12, 7f32);
        getter!(t, atlasfit_file_triangles, file, s.atlas, 3, 7u32);
        getter!(t, atlasfit_file_corner_uv, file, s.atlas, 6, 7f32);
        getter!(t, atlasfit_file_face_charts, file, s.atlas, 1, 7u32);
        getter!(t, atlasfit_file_corner_normals, creased, s.atlas, 18, 7f32);
        getter!(t, atlasfit_file_texture, file, s.atlas, 13, 7u8);
        let none: [(&str, &dyn Fn() -> i32); 6] = [
            ("atlasfit_file_normals", &|| atlasfit_file_normals(bare, null_mut(), 0)),
            ("atlasfit_file_colors", &|| atlasfit_file_colors(bare, null_mut(), 0)),
            ("atlasfit_file_corner_uv", &|| atlasfit_file_corner_uv(bare, null_mut(), 0)),
            ("atlasfit_file_corner_normals", &|| atlasfit_file_corner_normals(file, null_mut(), 0)),
            ("atlasfit_file_face_charts", &|| atlasfit_file_face_charts(bare, null_mut(), 0)),
            ("atlasfit_file_texture", &|| atlasfit_file_texture(bare, null_mut(), 0)),
        ];
        for (name, call) in none {
            t.want(name, "none", ATLASFIT_NOT_AVAILABLE, call());
        }

        let (name, mut width, mut scalar) = ("atlasfit_file_attribute_type", 0, 0);
        t.lines(name, file, s.atlas, |h, text, n, length| {
            atlasfit_file_attribute_type(h, 0, text, n, length, &mut width.clone(), &mut scalar.clone())
        });
        let ask = |i, w, k| atlasfit_file_attribute_type(file, i, null_mut(), 0, &mut 0, w, k);
        t.want(name, "type", ATLASFIT_OK, ask(0, &mut width, &mut scalar));
        assert_eq!((width, scalar), (1, ATLASFIT_U16));
        t.want(name, "nothing wanted", ATLASFIT_OK, ask(0, null_mut(), null_mut()));
        let beyond = ATLASFIT_INDEX_OUT_OF_RANGE;
        t.want(name, "too large", beyond, ask(1, null_mut(), null_mut()));
        let name = "atlasfit_file_attribute";
        t.handle(name, s.atlas, |h| atlasfit_file_attribute(h, 0, [0.0; 3].as_mut_ptr(), 3));
        t.copy(name, 3, 9f64, |to, n| atlasfit_file_attribute(file, 0, to, n));
        t.want(name, "too large", beyond, atlasfit_file_attribute(file, 1, [0.0; 3].as_mut_ptr(), 3));
        let mut labels = [0.0; 3];
        assert_eq!(atlasfit_file_attribute(file, 0, labels.as_mut_ptr(), 3), ATLASFIT_OK);
        assert_eq!(labels, [7.0, 7.0, 65535.0], "labels are exact");
        t.want("atlasfit_file_free", "live", ATLASFIT_OK, atlasfit_file_free(file));
        atlasfit_file_free(bare);
    }
}

/// Saving.
pub fn writing(t: &mut Table, s: &Scene) {
    let name = "atlasfit_file_save";
    let (xyz, corners) = spiky_sheet();
    let sheet =
        atlasfit_points { triangles: corners.as_ptr(), triangle_count: corners.len() / 3, ..points(&xyz) };
    let uv: Vec<f32> = corners.iter().flat_map(|&v| [(v % 40) as f32, (v / 40) as f32]).collect();
    let plain = atlasfit_save_options { corner_uv: uv.as_ptr(), ..init(atlasfit_save_options_init) };
    let ply = path("written.ply");
    let to = |path: &CString, points: *const atlasfit_points, o: *const atlasfit_save_options| unsafe {
        atlasfit_file_save(path.as_ptr(), points, o, null(), null_mut(), 0)
    };
    unsafe {
        t.want(name, "path NULL", INVALID, atlasfit_file_save(null(), &sheet, &plain, null(), null_mut(), 0));
        t.points(name, &s.points(), ATLASFIT_OK, |p| to(&ply, p, null()));
        let first = std::mem::offset_of!(atlasfit_save_options, corner_normals);
        t.sized_grown(name, "options", (&plain, first), ABI, |o| to(&ply, &sheet, o));
        t.run(name, |r| atlasfit_file_save(ply.as_ptr(), &sheet, &plain, r, null_mut(), 0));
        t.want(name, "defaults", ATLASFIT_OK, to(&ply, &sheet, null()));
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_save_options)); 4] = [
            ("ascii", ATLASFIT_OK, &|o| o.ascii = 1),
            ("ascii is 2", INVALID, &|o| o.ascii = 2),
            ("reserved", INVALID, &|o| o.reserved = 1),
            ("texture NULL", INVALID, &|o| o.texture_bytes = 5),
        ];
        for (case, want, spoil) in all {
            let mut o = plain;
            spoil(&mut o);
            t.want(name, format!("options: {case}"), want, to(&ply, &sheet, &o));
        }
        let beyond = [0, 1, 1600u32];
        let wrong = atlasfit_points { triangles: beyond.as_ptr(), triangle_count: 1, ..sheet };
        t.want(name, "no such vertex", ATLASFIT_BAD_FILE, to(&ply, &wrong, null()));
        t.want(name, "extension", ATLASFIT_BAD_FILE, to(&path("a.exe"), &sheet, null()));
        t.want(name, "read only", ATLASFIT_BAD_FILE, to(&path("a.e57"), &sheet, null()));
        t.want(name, "no faces", ATLASFIT_BAD_FILE, to(&path("a.stl"), &points(&xyz), null()));
        t.want(name, "no folder", ATLASFIT_IO, to(&path("none/a.ply"), &sheet, null()));

        // What STL does not hold is told, as far as there is room.
        let stl = path("written.stl");
        for room in [0usize, 1, 6, 4096] {
            let mut lost = vec![7u8; 4097];
            let at = lost.as_mut_ptr().cast();
            let status = atlasfit_file_save(stl.as_ptr(), &sheet, &plain, null(), at, room);
            t.want(name, format!("room for {room}"), ATLASFIT_OK, status);
            assert_eq!(lost[room], 7, "written beyond the buffer");
            assert!(room == 0 || lost[..room].contains(&0));
            assert!(room < 4096 || lost[0] != 0, "something is lost");
        }
        let back = opened("written.ply");
        let mut info = output::<atlasfit_file_info>();
        assert_eq!(atlasfit_file_get_info(back, &mut info), ATLASFIT_OK);
        assert_eq!((info.points, info.triangles, info.has_uv), (1600, 39 * 39 * 2, 1));
        atlasfit_file_free(back);
    }
}
